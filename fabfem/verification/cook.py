"""Cook's membrane: a tapered panel clamped on one side and sheared on the other, E = 1, ν = 1/3, plane stress.

There is no plane stress here; a slab 1/10 thick, free on both faces, is one but for the clamped edge. The middle of
the right edge moves up by 23.96 [Cook, Malkus & Plesha]; the axes are x, z in the panel and y across it.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fabfem.fem.box import grid_mesh
from fabfem.fem.mesh import Mesh
from fabfem.verification.row import Row
from fabfem.verification.scene import Tables, held, solve, stage

THICKNESS = 0.1
ELEMENTS: dict[str, tuple[str, int, Tables]] = {
    "hexahedron20": ("hexahedron", 8, {}),
    "hexahedron, mean volume strain": ("hexahedron", 32, {"mesh": {"order": 1}}),
    "tetra10": ("tetra", 12, {}),
}
"""Name -> linear cell, cells along each edge, tables."""


def rows() -> Iterator[Row]:
    """Yield the tip's movement with three elements."""
    for name, (cell_type, cells, tables) in ELEMENTS.items():
        answer = solve(panel() | tables, panel_mesh(cell_type, cells))
        note = answer.stopped or f"{cells} x {cells} cells"
        yield Row(f"tip, {name}", 23.96, answer.final("tip"), 0.01, answer.seconds, note)


def panel_mesh(cell_type: str, cells: int) -> Mesh:
    """Return the panel, whose left edge is 44 and whose right edge is 16 long."""
    unit = np.linspace(0.0, 1.0, cells + 1)
    mesh = grid_mesh(cell_type, [unit, np.array([0.0, THICKNESS]), unit])
    x, y, z = mesh.points.T
    return replace(mesh, points=np.stack([48.0 * x, y, 44.0 * x + z * (44.0 - 28.0 * x)], axis=1))


def panel() -> Tables:
    """Return the tables of the panel; the load on its right edge is one for a thickness of one."""
    return {
        "scene": {"kind": "boundary_value", "kinematics": "solid"},
        "material": {"panel": {"model": "elastic", "youngs_modulus": 1.0, "poisson_ratio": 1.0 / 3.0}},
        "solver": {"tolerance": 1e-8},
        "support": held(left="xz", front="y"),
        "stage": [stage("shear", 1.0, 1.0, traction=[{"boundary": "right", "z": 1.0 / 16.0}])],
        "probe": [{"name": "tip", "point": [48.0, 0.0, 52.0], "component": "z"}],
    }
