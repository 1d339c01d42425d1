"""The units a case is written in: a length and a force, from which all others follow.

The numerical core is unit-free: every number of a case is read in the units that the case names (metre and
kilonewton unless it says otherwise, hence stress in kPa and unit weight in kN/m3), and every result comes out in
them. The factors to SI serve the material presets, whose tables have units of their own.
"""

from typing import NamedTuple

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048, "in": 0.0254}
FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kip": 4448.2216152605}

NAMED_STRESSES = {
    ("N", "m"): "Pa",
    ("kN", "m"): "kPa",
    ("MN", "m"): "MPa",
    ("N", "mm"): "MPa",
    ("kN", "mm"): "GPa",
    ("lbf", "in"): "psi",
    ("kip", "in"): "ksi",
}

DIMENSIONS = {
    "none": (0, 0),
    "angle": (0, 0),
    "length": (0, 1),
    "force": (1, 0),
    "line_force": (1, -1),
    "stress": (1, -2),
    "stress2": (2, -4),
    "unit_weight": (1, -3),
    "moment": (1, 1),
}
"""Powers of (force, length) of every quantity that a case or a result can hold."""


class Units(NamedTuple):
    """A consistent set of units, named by its length and its force."""

    length: str = "m"
    """Unit of length, a key of `LENGTHS`."""
    force: str = "kN"
    """Unit of force, a key of `FORCES`."""

    @property
    def metres(self) -> float:
        """Length of the unit of length [m]."""
        return LENGTHS[self.length]

    @property
    def newtons(self) -> float:
        """Size of the unit of force [N]."""
        return FORCES[self.force]

    @property
    def pascals(self) -> float:
        """Size of the unit of stress [Pa]."""
        return self.newtons / self.metres**2

    def label(self, quantity: str) -> str:
        """Name of the unit of a quantity, as written in headers and on axes: ``kPa``, ``kN/m3``, ``-``.

        Parameters
        ----------
        quantity : str
            A key of `DIMENSIONS`.
        """
        force, length = DIMENSIONS[quantity]
        if quantity == "angle":
            return "deg"
        if quantity == "stress2":
            return f"({self.label('stress')})2"
        if (force, length) == (1, -2) and (self.force, self.length) in NAMED_STRESSES:
            return NAMED_STRESSES[self.force, self.length]
        above = " ".join([self.force] * force + [_power(self.length, length)] * (length > 0))
        below = f"/{_power(self.length, -length)}" if length < 0 else ""
        return above + below or "-"


def _power(unit: str, exponent: int) -> str:
    return unit if exponent == 1 else f"{unit}{exponent}"
