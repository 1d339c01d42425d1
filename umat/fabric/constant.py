"""A fabric that does not change: the original Chang–Hicher model (h = 0)."""

from typing import NamedTuple

from .law import law


class Constant(NamedTuple):
    """No parameters."""


@law(Constant, "fabric")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return zero."""
    return (0.0 * fabric[0], 0.0 * fabric[1], 0.0 * fabric[2], 0.0 * fabric[3], 0.0 * fabric[4], 0.0 * fabric[5])
