"""Thick cylinders and holes: a slice of a ring between two planes that hold the axial displacement.

Boundaries are ``inner``, ``outer``, ``bottom`` and ``top``; what is computed needs one row of elements.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from fabfem.fem.box import grid_mesh
from fabfem.fem.mesh import Mesh
from fabfem.verification.scene import Answer, Tables, held


def ring_mesh(cell_type: str, radii: np.ndarray, aspect: float = 1.0) -> Mesh:
    """Return a ring of linear cells cut at ascending radii, one cell high, the first `aspect` times as wide as high."""
    mesh = grid_mesh(cell_type, [radii, np.array([0.0, (radii[1] - radii[0]) / aspect])])
    names = {"left": "inner", "right": "outer"}
    return replace(mesh, boundaries={names.get(name, name): facets for name, facets in mesh.boundaries.items()})


def ring(material: Tables, stages: list[Tables], **tables: Any) -> Tables:
    """Return the tables of a ring in plane strain, with the displacement of both walls in its history."""
    probes = [{"name": wall, "boundary": wall, "component": "r"} for wall in ("inner", "outer")]
    return {
        "scene": {"kind": "boundary_value", "kinematics": "axisymmetric"},
        "material": {"ring": material},
        "solver": {"tolerance": 1e-8},
        "support": held(bottom="z", top="z"),
        "stage": stages,
        "probe": probes,
        **tables,
    }


def pressing(boundary: str, value: float, name: str = "pressure", **increments: float) -> Tables:
    """Return a load stage at whose end there is a pressure on a wall."""
    sizes = {"initial": 1.0, "maximum": 1.0} | increments
    return {"name": name, "kind": "load", "pressure": [{"boundary": boundary, "value": value}], "increments": sizes}


def at_wall(answer: Answer, wall: str) -> np.ndarray:
    """Return the (6,) smoothed stress at a wall, compression positive."""
    space = answer.problem.model.space
    return space.nodal(answer.state_stress)[np.unique(space.mesh.boundary(wall))].mean(axis=0)


def yielded_radius(answer: Answer) -> float:
    """Return the radius half-way between the last point with plastic strain and the next one outwards."""
    assert answer.last is not None
    (state,) = answer.last.states.values()
    radius = answer.problem.model.space.points[:, 0]
    inside = radius[state.plastic_strain > 0.0].max(initial=radius.min())
    return float(0.5 * (inside + radius[radius > inside * (1.0 + 1e-9)].min(initial=radius.max())))
