"""What PROPS and STATEV of an exported routine hold; places are counted from 0 here and from 1 in Fortran."""

from typing import NamedTuple

from umat.chang_hicher import ChangHicher
from umat.directions import Directions

#: places in PROPS
VOID_RATIO, NORM, BEDDING_ANGLE, AZIMUTH, VERTICAL = range(5)
PROPERTIES = (
    "initial void ratio (e)",
    "norm of the initial fabric (F), 0 if absent",
    "bedding angle [degrees], 0 if absent",
    "azimuth of the dip [degrees], from the first horizontal axis, 0 if absent",
    "vertical axis, 1, 2 or 3; if absent or 0, 2 for NTENS = 4 and 3 for NTENS = 6",
)
#: places in STATEV
BEGUN, VOID, GAP, FABRIC, OUT_OF_PLANE, SLIP = 0, 1, 2, 3, 9, 11


class Layout(NamedTuple):
    """Numbers in STATEV."""

    directions: int
    """Number of contact directions (N)."""
    forces: int
    """Components of the contact forces that are kept: 3 in the rate form, none in the total form."""

    @property
    def state_variables(self) -> int:
        """NSTATV, at least."""
        return SLIP + self.directions * (1 + self.forces)

    def lines(self) -> tuple[str, ...]:
        """Return a line on each part of PROPS and STATEV, numbered from 1."""
        first = SLIP + self.directions
        parts = [
            "1     0 before the first call, 1 after",
            "2     void ratio (e)",
            "3     gap: volumetric strain by which an opened packing has come apart",
            "4-9   fabric tensor F: 11, 22, 33, 12, 13, 23",
            "10-11 stresses 13 and 23, kept here where NTENS = 4",
            f"12-{first} sliding of {self.directions} contact directions over the grain diameter",
        ]
        if self.forces:
            parts.append(f"{first + 1}-{self.state_variables} their contact forces")
        return (
            *(f"PROPS({k + 1})  {text}" for k, text in enumerate(PROPERTIES)),
            *(f"STATEV {text}" for text in parts),
        )


def layout_of(material: ChangHicher, directions: Directions) -> Layout:
    """Return the layout of a material with its contact directions."""
    return Layout(len(directions), 3 if material.localisation == "rate" else 0)
