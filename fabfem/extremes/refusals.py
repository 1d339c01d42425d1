"""Bodies that have no answer: each has to be refused, and the reason has to name what is missing."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from fabfem.case import CaseError
from fabfem.fem.box import grid_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.mesh import Mesh
from fabfem.verification.scene import Tables, held, solve, stage


class Refusal(NamedTuple):
    """A body without an answer, and what was said of it."""

    what: str
    wanted: str
    """Words that the reason must have."""
    said: str
    """The reason; empty where there was none."""
    seconds: float

    @property
    def green(self) -> bool:
        """Whether the reason names what is missing."""
        return self.wanted in self.said


def refusals() -> Iterator[Refusal]:
    """Yield what is said of every body of the table."""
    for what, (wanted, make) in BODIES.items():
        start = perf_counter()
        tables, mesh = make()
        try:
            said = solve(tables, mesh).stopped
        except CaseError as error:
            said = str(error)
        yield Refusal(what, wanted, said, perf_counter() - start)


def loose() -> tuple[Tables, Mesh]:
    """Return a body that nothing holds sideways."""
    return _block(held(bottom="y"), pressure=[{"boundary": "top", "value": 1.0}]), grid_mesh("quad", _CUTS)


def torn() -> tuple[Tables, Mesh]:
    """Return a body whose upper half only lies beside the lower one."""
    mesh = grid_mesh("quad", _CUTS)
    upper = mesh.cells[mesh.points[mesh.cells].mean(axis=1)[:, 1] > 0.5]
    below = mesh.cells[mesh.points[mesh.cells].mean(axis=1)[:, 1] < 0.5]
    number = np.arange(len(mesh.points))
    nodes = np.unique(upper)
    number[nodes] = len(mesh.points) + np.arange(len(nodes))
    used, cells = np.unique(np.concatenate([below, number[upper]]), return_inverse=True)
    points = np.concatenate([mesh.points, mesh.points[nodes]])[used]
    cells = cells.reshape(-1, 4)
    zones = {"lower": np.arange(len(below)), "upper": np.arange(len(below), len(cells))}
    at = {"bottom": points[:, 1] == 0.0, "top": points[:, 1] == 1.0}
    sides = {name: outer_facets(cells, "quad", np.flatnonzero(there)) for name, there in at.items()}
    body = replace(mesh, points=points, cells=cells, zones=zones, boundaries=sides)
    return _block(held(bottom="xy"), pressure=[{"boundary": "top", "value": 1.0}]), body


def overloaded() -> tuple[Tables, Mesh]:
    """Return a layer of clay under twice the shear that it carries."""
    clay = {"model": "mohr_coulomb", "youngs_modulus": 1e3, "cohesion": 1.0, "friction_angle": 0.0}
    held_up = held(bottom="xy", left="y", right="y", top="y")
    tables = _block(held_up, traction=[{"boundary": "top", "x": 2.0}]) | {"material": {"clay": clay}}
    return tables, grid_mesh("quad", _CUTS)


def pulled() -> tuple[Tables, Mesh]:
    """Return sand without cohesion that is pulled."""
    sand = {"model": "mohr_coulomb", "youngs_modulus": 1e3, "friction_angle": 30.0, "dilation_angle": 30.0}
    tables = _block(held(bottom="xy"), pressure=[{"boundary": "top", "value": -1.0}]) | {"material": {"sand": sand}}
    return tables, grid_mesh("quad", _CUTS)


BODIES: dict[str, tuple[str, Callable[[], tuple[Tables, Mesh]]]] = {
    "block that nothing holds sideways": ("rigid motion of the body free", loose),
    "block torn in two, the upper half loose": ("zone 'upper' can move without strain", torn),
    "clay sheared with twice its strength": ("stopped at 50", overloaded),
    "sand without cohesion, pulled": ("stopped at 0", pulled),
}
"""What -> words that the reason must have, tables and mesh."""

_CUTS = [np.linspace(0.0, 1.0, 5)] * 2


def _block(support: list[Tables], **load: list[Tables]) -> Tables:
    return {
        "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
        "material": {"block": {"model": "elastic", "youngs_modulus": 1e3}},
        "support": support,
        "stage": [stage("load", 0.1, 0.1, **load)],
    }
