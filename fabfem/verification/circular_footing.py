"""Circular footings on Tresca ground: q/c = 5.69 smooth, 6.05 rough [Shield 1955, Eason & Shield 1960].

Flow without volume change about an axis is what locks elements; the mean volume strain frees them.
"""

from collections.abc import Iterator

from fabfem.verification.ground import Ground, footing, settled
from fabfem.verification.row import Row
from fabfem.verification.scene import Tables, solve

CAPACITY = {False: 5.69, True: 6.05}
"""Whether the footing is rough -> q/c."""

CLAY: Tables = {
    "model": "mohr_coulomb",
    "youngs_modulus": 1e3,
    "poisson_ratio": 0.45,
    "cohesion": 1.0,
    "friction_angle": 0.0,
}
ELEMENTS: dict[str, tuple[str, Tables]] = {
    "triangle6, mean volume strain": ("triangle", {"mesh": {"volume_strain": "mean"}}),
    "quad8": ("quad", {}),
}
"""Name -> linear cell, tables."""


def rows() -> Iterator[Row]:
    """Yield the smooth and the rough footing with two elements."""
    for name in ELEMENTS:
        yield from (capacity(name, rough) for rough in CAPACITY)


def capacity(name: str, rough: bool) -> Row:
    """Return the row of a footing with an element of the table."""
    cell_type, tables = ELEMENTS[name]
    answer = solve(footing(CLAY, 0.04, rough, axial=True) | tables, Ground(2.0, 1.5, 0.01).mesh(cell_type))
    note = settled(answer, name.partition(",")[0])
    kind = "rough" if rough else "smooth"
    return Row(f"q/c {kind}, {name}", CAPACITY[rough], answer.final("load"), 0.02, answer.seconds, note)
