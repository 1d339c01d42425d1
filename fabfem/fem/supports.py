"""What is held or tied: displacement components of boundaries, fixed or moved by a ramp, and rigid bodies.

What they make of the dofs of a stage is in `constraints`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fabfem.fem.space import Space

MOTIONS = {
    ("x", "y"): ("x", "y", "rotation"),
    ("r", "z"): ("z",),
    ("r", "z", "theta"): ("z", "rotation"),
    ("x", "y", "z"): ("x", "y", "z", "rotation_z", "rotation_x", "rotation_y"),
}
"""Names of the rigid motions of a body by the displacement components of the scene, as `kinematics.modes` orders them;
a rotation is counter-clockwise [rad]."""


@dataclass(frozen=True)
class Support:
    """One held component of a boundary; `displacement` [length] is added in equal parts over the stage.

    A held pore pressure takes the value `displacement` [stress] at once: there the water drains.
    """

    boundary: str
    component: str
    displacement: float = 0.0


@dataclass(frozen=True)
class RigidBody:
    """A rigid body on a boundary, such as a footing or a platen.

    Attributes
    ----------
    boundary : str
    ties : tuple of str
        Components in which the nodes follow the body: all for a rough one, that across the boundary for a smooth one.
    point : tuple of float
        What rotations turn about and forces act at.
    motion : mapping of str to float
        Motions (`MOTIONS`) added in equal parts over the stage; what it does not name is free.
    """

    boundary: str
    ties: tuple[str, ...]
    point: tuple[float, ...]
    motion: Mapping[str, float] = field(default_factory=dict)


def body_modes(space: Space, body: RigidBody) -> tuple[np.ndarray, np.ndarray]:
    """The tied dofs (k,) of a body and how each follows its rigid motions (k, nmotion)."""
    dofs = np.sort(np.concatenate([space.dofs_on(body.boundary, component) for component in body.ties]))
    nodes, ncomp = dofs // len(space.components), len(space.components)
    if len(body.point) != space.mesh.dim:
        raise ValueError(f"the point of a rigid body has {space.mesh.dim} coordinates, not {len(body.point)}.")
    arm = space.mesh.points[nodes] - np.asarray(body.point) * (not space.kinematics.radial)
    modes = space.kinematics.modes(arm)
    return dofs, modes[:, np.arange(len(dofs)), dofs % ncomp].T
