"""What a run is made of: a space, materials on zones, stages, controls.

Newton sees the points only through `points`, the matrix only through `assembly`, and the solver only through `linear`;
each works on the elements of its space, be it all of them or one rank's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from fabfem.fem.pores import PoreWater
from fabfem.fem.space import Space
from fabfem.fem.stages import Stage
from umat import symmetric_tangent, weakened

States = dict[str, Any]


class Zone(NamedTuple):
    """The points of a zone and what they are made of."""

    material: Any
    """Parameter record of `umat`."""
    directions: Any
    """Contact directions, or None."""
    state: Any
    """Initial state, `umat.initial_state(...)`."""
    points: Any
    """Slice or ids, `space.points_of(mesh.zone(name))`."""


@dataclass(frozen=True)
class Controls:
    """Tolerances and limits of the iteration.

    Attributes
    ----------
    tolerance : float
        Out-of-balance force on free dofs over the larger of internal (reactions included) and external force.
    max_iterations : int
        Linear solves in one increment.
    easy : int
        Linear solves at or below which the next increment grows.
    growth : float
        By how much.
    rise : float
        How many times larger a correction may make the residual before it is halved. Newton often needs a step up;
        `docs/architecture.md` has what was tried.
    turn : float
        How much of the residual's work along a correction may be left when it is taken, whatever its sign; beyond, the
        correction is shortened. It lets the norm rise across a kink, but no correction overshoot; infinity asks
        nothing.
    backtracks : int
        Times that one correction is shortened, at most.
    viscosity : float
        Stress that resists the rate of strain, over the elastic stress that the rate would make in one stage: what
        softens or jumps then takes a finite part of the stage, and small increments are well posed. See
        `docs/footing.md` for what it costs; every increment reports the share of the forces.
    held : float
        Share of the points that may keep their old stress and state in an increment that the material refuses them,
        as if they flowed under constant stress; every increment reports their number.
    extrapolate : bool
        Start from the last increment's displacement, where there is one in the stage, instead of a solve with the
        last tangent: a fifth to a quarter fewer solves.
    reuse : bool
        Make the last correction with the factors of the one before, where they promise balance; see `newton`.
    """

    tolerance: float = 1e-6
    max_iterations: int = 16
    easy: int = 6
    growth: float = 1.5
    rise: float = 10.0
    turn: float = 0.8
    backtracks: int = 4
    viscosity: float = 0.0
    held: float = 0.0
    extrapolate: bool = True
    reuse: bool = True


@dataclass(frozen=True)
class Model:
    """Everything that `march` needs; `water` needs a `PorousSpace`.

    `solver` is "auto", "superlu", "pardiso" or "multigrid".
    """

    space: Space
    zones: Mapping[str, Zone]
    stages: tuple[Stage, ...]
    controls: Controls = field(default_factory=Controls)
    solver: str = "auto"
    water: PoreWater | None = None

    def __post_init__(self) -> None:
        """Refuse zones that leave points out or share them."""
        count = np.zeros(self.space.npoints, int)
        for zone in self.zones.values():
            count[zone.points] += 1
        if (count != 1).any():
            element = int(np.flatnonzero(count != 1)[0]) // self.space.nq
            raise ValueError(f"element {element} belongs to {count[element * self.space.nq]} zones instead of one.")

    @property
    def states(self) -> States:
        """Initial states by zone."""
        return {name: zone.state for name, zone in self.zones.items()}


def symmetric(zones: Mapping[str, Zone]) -> bool:
    """Whether the stiffness is symmetric whatever the points do."""
    return all(symmetric_tangent(zone.material) for zone in zones.values())


def weaken(zones: Mapping[str, Zone], factor: float, spared: Sequence[str] = ()) -> dict[str, Zone]:
    """The zones with the strength of their materials divided by `factor`, except those `spared`."""
    if factor == 1.0:
        return dict(zones)
    return {
        name: zone if name in spared else zone._replace(material=weakened(zone.material, factor))
        for name, zone in zones.items()
    }
