"""What failed, as small folders in ``replay/`` of a result: what it takes to run it alone (`fabfem.replay`).

``point_000`` and on: a point that its material refused, with state, strain increment, parameters and directions; the
last five are kept. ``stage``: where a run stopped, with the case, the mesh and the state before.
"""

import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fabfem.case import Case
from fabfem.output.archive import write_archive

if TYPE_CHECKING:  # an element test imports nothing of the finite elements
    from fabfem.fem.increment import Cutback
    from fabfem.fem.points import Refused

FOLDER, FILE = "replay", "failure.npz"
KEPT = 5
"""Points kept."""


class PointFailure(NamedTuple):
    """A point that its material refused."""

    case: str
    """Name of the case."""
    stage: str
    fraction: float
    """Fraction of the stage at which the increment began."""
    size: float
    """Size of the increment, as a fraction of the stage."""
    reason: str
    refused: "Refused"


class StageFailure(NamedTuple):
    """Where a run stopped."""

    name: str
    """Name of the case file."""
    tables: dict[str, Any]
    """The case with all defaults; its mesh is a file beside this one."""
    start: Any
    """The last state, from which its scene goes on; None at the beginning."""
    stage: str
    fraction: float
    """Fraction of the stage that was done."""
    reason: str


def keep_points(case: Case, folder: Path, cutbacks: "Iterable[Cutback]") -> None:
    """Write the refused points of some cut-backs; the last five of a result are kept."""
    for cutback in cutbacks:
        if cutback.refused is not None:
            there = sorted((folder / FOLDER).glob("point_*"))
            number = int(there[-1].name.removeprefix("point_")) + 1 if there else 0
            told = (case.path.name, cutback.stage, cutback.fraction, cutback.size, cutback.reason)
            _write(folder / FOLDER / f"point_{number:03d}", PointFailure(*told, cutback.refused))
            for old in there[: len(there) + 1 - KEPT]:
                shutil.rmtree(old)


def keep_stage(case: Case, folder: Path, start: Any, ended: tuple[str, float, str], mesh: Path | None = None) -> None:
    """Write where a run stopped: from the state `start`; `ended` is stage, fraction, reason."""
    tables = case.model_dump(mode="json", exclude_none=True, exclude={"sweep", "study", "calibration"})
    home = folder / FOLDER / "stage"
    home.mkdir(parents=True, exist_ok=True)
    if mesh is not None:
        copy = home / f"mesh{mesh.suffix}"
        shutil.copyfile(mesh, copy)
        kept = {key: value for key, value in tables["mesh"].items() if key not in ("script", "parameters")}
        tables["mesh"] = kept | {"file": copy.name}
    _write(home, StageFailure(case.path.name, tables, start, *ended))


def clear(folder: Path) -> None:
    """Remove what failed in an earlier run."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)


def _write(home: Path, failure: PointFailure | StageFailure) -> None:
    home.mkdir(parents=True, exist_ok=True)
    write_archive(home / FILE, failure)
