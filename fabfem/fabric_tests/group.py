"""Histories of stress and strain that laws are run along."""

from typing import NamedTuple

from fabfem.fabric_tests.drives import Value
from umat.fabric_history import Given
from umat.mandel import Array


class Group(NamedTuple):
    """Histories of the same length."""

    labels: tuple[tuple[Value, Value, Value], ...]
    """Name, b and α of each; empty text where it has none."""
    given: Given
    """What the points go through."""
    fabric: Array | None = None
    """(m + 1, n, 6) fabric of the material that computed the path."""
    missing: frozenset[str] = frozenset()
    """Quantities that the history does not have."""
    reason: str = ""
    """Why the path ended before its end."""
