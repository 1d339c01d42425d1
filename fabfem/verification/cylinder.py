"""Elastic thick cylinders: Lamé's, and the nearly incompressible one that locks elements.

Plane strain, pressure p inside radius a, nothing outside radius b. With A = p a²/(b² − a²):
u = (1 + ν) A ((1 − 2ν) r + b²/r)/E, σ_r = A (b²/r² − 1), σ_θ = −A (b²/r² + 1), compression positive [Lamé 1852].
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from fabfem.verification.ring import at_wall, pressing, ring, ring_mesh
from fabfem.verification.row import Row
from fabfem.verification.scene import Answer, Tables, solve

NEARLY = 0.4999
"""Poisson's ratio of the nearly incompressible cylinder."""

ELEMENTS: dict[str, tuple[str, int, Tables]] = {
    "quad, mean volume strain": ("quad", 60, {"mesh": {"order": 1}}),
    "triangle, mean volume strain": ("triangle", 120, {"mesh": {"order": 1}}),
    "quad8": ("quad", 10, {}),
    "triangle6": ("triangle", 10, {}),
    "quad8, mean volume strain": ("quad", 10, {"mesh": {"volume_strain": "mean"}}),
    "triangle6, mean volume strain": ("triangle", 10, {"mesh": {"volume_strain": "mean"}}),
}
"""Name -> linear cell, cells across the wall, tables."""


def rows() -> Iterator[Row]:
    """Yield Lamé's displacements and hoop stresses, then the nearly incompressible cylinder with every flat element."""
    yield from lame()
    for name in ELEMENTS:
        yield from incompressible(name)


def lame() -> Iterator[Row]:
    """Yield the rows of a = 1, b = 2, p = 1, E = 1, ν = 0.3."""
    answer = cylinder(1.0, 2.0, 1.0, 1.0, 0.3, "quad", 16)
    yield Row("Lamé, u(a)", 1.906667, answer.final("inner"), 0.01, answer.seconds, "16 quad8")
    yield Row("Lamé, u(b)", 1.213333, answer.final("outer"), 0.01)
    yield Row("Lamé, tension σ_θ(a)", 1.666667, _tension(answer, "inner"), 0.01)
    yield Row("Lamé, tension σ_θ(b)", 0.666667, _tension(answer, "outer"), 0.01)


def incompressible(name: str) -> Iterator[Row]:
    """Yield the rows of a = 0.1, b = 0.2 m, p = 60 MPa and E = 200 GPa, whose references are those of ν = ½."""
    cell_type, across, tables = ELEMENTS[name]
    answer = cylinder(0.1, 0.2, 60.0, 2e5, NEARLY, cell_type, across, **tables)
    note = f"{across} across the wall, ν = {NEARLY}"
    yield Row(f"u_r(a), {name}", 6e-5, answer.final("inner"), 0.005, answer.seconds, note)
    yield Row(f"u_r(b), {name}", 3e-5, answer.final("outer"), 0.005)
    yield Row(f"tension σ_θ(a), {name}", 100.0, _tension(answer, "inner"), 0.005)
    yield Row(f"tension σ_θ(b), {name}", 40.0, _tension(answer, "outer"), 0.005)


def cylinder(
    a: float, b: float, pressure: float, modulus: float, ratio: float, cell_type: str, across: int, **tables: Any
) -> Answer:
    """Return the answer of an elastic cylinder under a pressure inside, cells in proportion to their radius."""
    material = {"model": "elastic", "youngs_modulus": modulus, "poisson_ratio": ratio}
    mesh = ring_mesh(cell_type, np.geomspace(a, b, across + 1))
    return solve(ring(material, [pressing("inner", pressure)], **tables), mesh)


def _tension(answer: Answer, wall: str) -> float | None:
    """Return the hoop stress at a wall, tension positive."""
    return answer.measured(lambda done: -at_wall(done, wall)[2])
