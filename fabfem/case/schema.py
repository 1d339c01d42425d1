"""What every case says, whatever its scene."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PrivateAttr

from fabfem.case.materials import AnyMaterial
from fabfem.case.study import Calibration, Study, Sweep
from fabfem.case.table import Identifier, NotNegative, Table
from fabfem.units import FORCES, LENGTHS, Units


class AnyScene(Table):
    """What is solved."""

    kind: str
    """Kind of scene."""


class UnitNames(Table):
    """Units of every number in the case and in its results."""

    length: Literal[*LENGTHS] = "m"  # type: ignore[valid-type]
    """Unit of length."""
    force: Literal[*FORCES] = "kN"  # type: ignore[valid-type]
    """Unit of force."""


class Checkpoint(Table):
    """When a run keeps a state that it can go on from; one is kept when it ends, too."""

    seconds: NotNegative = 30.0
    """Time between two [s]; longer where writing would take more than a twentieth of the time."""
    increments: Annotated[int, Field(ge=1)] | None = None
    """Increments between two, instead of a time."""


class Case(Table):
    """What every case says."""

    title: str = ""
    """What the case is, in a line."""
    scene: AnyScene
    """What is solved."""
    units: UnitNames = UnitNames()
    """Units of the case."""
    material: Annotated[dict[Identifier, AnyMaterial], Field(min_length=1)]
    """Materials by name."""
    sweep: Sweep | None = None
    """Runs of the case with the product of some parameters."""
    study: Study | None = None
    """Runs of the case with other settings, for their error and time."""
    calibration: Calibration | None = None
    """Runs of the case that fit parameters to measured curves."""

    checkpoint: Checkpoint = Checkpoint()
    """When a run keeps a state that it can go on from."""

    _path: Path = PrivateAttr(Path("case.toml"))

    @property
    def path(self) -> Path:
        """File that the case was read from."""
        return self._path

    @property
    def unit_system(self) -> Units:
        """Units of the case."""
        return Units(self.units.length, self.units.force)

    def locate(self, file: str) -> Path:
        """Return the path of a file that the case names, which is relative to the case file."""
        return self._path.parent / file
