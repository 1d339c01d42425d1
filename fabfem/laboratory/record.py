"""All that an element test writes, as it goes on: the history, the report, directional distributions."""

from collections.abc import Mapping, Sequence
from pathlib import Path as File
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.case.paths import Path, Probe
from fabfem.failures import clear as clear_failures
from fabfem.laboratory.columns import COMPONENTS, Row, zeta
from fabfem.laboratory.landmarks import Rows, interpolated, landmarks
from fabfem.laboratory.probes import ProbeFile
from fabfem.laboratory.roses import RoseFiles
from fabfem.laboratory.specimen import Specimen
from fabfem.laboratory.stages import End, Point
from fabfem.output.checkpoints import PATTERN as CHECKPOINTS
from fabfem.output.checkpoints import Checkpoint, Checkpoints
from fabfem.output.history import History
from fabfem.output.report import Report, about
from fabfem.timing import Timer
from umat import mandel, measures
from umat.mandel import FACTOR, Array

PHASES = ("read", "material", "paths", "output")
STANDING = ("stage", "increment [-]", "fraction [-]")


class Reached(NamedTuple):
    """Where a stage begins."""

    number: int
    """Number of the stage, from 0."""
    state: Any
    strain: Array
    """(6,) at the end of the stage before."""


class Written(NamedTuple):
    """What the files of a run have come to, for a checkpoint."""

    history: int = 0
    probes: int = 0
    """Sizes of the tables [bytes]."""
    roses: Any = None
    stages: Sequence[Any] = ()
    """The report's entries."""
    values: tuple[Any, ...] = ()
    increments: int = 0
    wall_time: Mapping[str, float] = {}


class Recorder:
    """All that an element test writes."""

    def __init__(
        self, specimen: Specimen, folder: File, timer: Timer, identity: dict[str, Any], written: Written | None = None
    ) -> None:
        self.specimen, self.folder, self.timer, self.identity = specimen, folder, timer, identity
        then = written or Written()
        self.headers = [*STANDING, *(column.header for column in specimen.columns)]
        self.history = History(folder / "history.csv", self.headers, then.history)
        _clear(folder, [name for _, name in then.roses[2]] if then.roses else [], bool(written))
        self.report = Report(folder / "report.json", **_head(specimen))
        self.report.content["stages"] = list(then.stages)
        self.roses = _roses(specimen, folder, then.roses)
        self.probes = ProbeFile(folder, _stress_unit(specimen), then.probes) if then.probes else None
        self.values: tuple[Any, ...] = then.values
        self.count = then.increments
        timer.resume(then.wall_time, then.wall_time.get("total", 0.0))
        self._checkpoints = Checkpoints(folder, 0.0)
        self._rows: list[Row] = []
        self._first = 0

    def add(self, point: Point) -> None:
        """Write a row."""
        with self.timer.phase("output"):
            row = self._row(point)
            measured = (float(column.value(row)) for column in self.specimen.columns)
            self.values = (point.stage, point.increment, point.fraction, *measured)
            self.history.write(self.values)
            self._rows.append(row)
            self._first += point.leg == 0
            self.count += point.increment > 0
            if self.roses:
                strain = float(measures.deviatoric_strain(point.strain))
                self.roses.offer(self.specimen, point.state, point.stage, point.increment, strain)

    def _row(self, point: Point) -> Row:
        stress = point.state.stress[0]
        before = (self._rows[-1].stress, self._rows[-1].strain) if self._rows else (stress, point.strain)
        fields = umat.state_fields(self.specimen.material, point.state)
        return Row(stress, point.strain, before, fields, self.specimen.zeta)

    def end_path(self, stage: Path, end: End) -> None:
        """Say in the report how a path ended and which states it passed."""
        rows = _gathered(self._rows[: self._first], end.status != "liquefied")
        places = landmarks(rows)
        self.report.content["stages"].append(
            {
                "name": stage.name,
                "kind": stage.kind,
                **end._asdict(),
                "increments": len(self._rows) - 1,
                "states": {name: self._described(rows, place) for name, place in places.items()},
            }
        )
        self._rows, self._first = [], 0
        self._write()

    def _described(self, rows: Rows, place: float) -> dict[str, Any]:
        """Return what the report says of a state on the way."""
        low = min(int(place), len(self._rows) - 1)
        around = self._rows[low], self._rows[min(low + 1, len(self._rows) - 1)]
        return _between(around, place - low) | {
            "increment": place,
            "strain": dict(zip(COMPONENTS, interpolated(rows.strain, place) / FACTOR, strict=True)),
        }

    def probe(self, stage: Probe, state: Any) -> None:
        """Run the probes of a stage and write them."""
        self.probes = self.probes or ProbeFile(self.folder, _stress_unit(self.specimen))
        ends = self.probes.write(self.specimen, stage, state)
        reason = "" if ends == stage.directions else f"{stage.directions - ends} of the probes were refused"
        self.report.content["stages"].append(
            {"name": stage.name, "kind": "probe", "status": "completed", "reason": reason, "probes": ends}
        )
        self._write()

    def keep(self, reached: Reached) -> None:
        """Write a checkpoint where a stage begins."""
        probes, roses = self.probes.size if self.probes else 0, self.roses.memory() if self.roses else None
        time = {**self.timer.spent, "total": self.timer.total()}
        stages = tuple(self.report.content["stages"])
        written = Written(self.history.size, probes, roses, stages, self.values, self.count, time)
        self._checkpoints.write(reached.number, Checkpoint(self.identity, reached, written._asdict()))

    def end(self, status: str, reason: str) -> tuple[str, str]:
        """Say how the run ended, close, and return status and reason."""
        self.report.content["increments"] = self.count
        self.report.end(status, reason)
        self._write()
        for file in (self.history, self.roses, self.probes):
            if file:
                file.close()
        return status, reason

    def _write(self) -> None:
        self.report.write_timed(self.timer)


def _between(rows: tuple[Row, Row], share: float) -> dict[str, Any]:
    """Return the measures of a state between two rows, interpolated."""
    low, high = (_state(row) for row in rows)
    return {
        name: (1.0 - share) * low[name] + share * high[name] if name != "F" else _mixed(low, high, share)
        for name in low
    }


def _mixed(low: dict[str, Any], high: dict[str, Any], share: float) -> dict[str, float]:
    return {name: (1.0 - share) * low["F"][name] + share * high["F"][name] for name in low["F"]}


def _state(row: Row) -> dict[str, Any]:
    """Return what is said of a state: stress, strain, and void ratio and fabric where the material has them."""
    found: dict[str, Any] = {
        "p": float(mandel.p(row.stress)),
        "q": float(mandel.q(row.stress)),
        "eta": float(mandel.eta(row.stress)),
        "eps_q": float(measures.deviatoric_strain(row.strain)),
        "eps_v": float(mandel.trace(row.strain)),
    }
    if "void_ratio" in row.fields:
        found |= {"e": row.void_ratio, "psi": row.psi}
    if "fabric" in row.fields:
        found |= {"F_norm": float(mandel.norm(row.fabric)), "A": float(measures.anisotropy(row.fabric, row.stress))}
        found |= {"zeta": zeta(row)} if row.zeta else {}
        found["F"] = dict(zip(COMPONENTS, row.fabric / FACTOR, strict=True))
    return found


def _gathered(rows: list[Row], ending: bool) -> Rows:
    """Return the rows of a stage as arrays."""
    nan = np.full(len(rows), np.nan)
    has = rows[0].fields
    void_ratio = np.array([row.void_ratio for row in rows]) if "void_ratio" in has else nan
    fabric = np.array([mandel.norm(row.fabric) for row in rows]) if "fabric" in has else nan
    return Rows(
        np.array([row.stress for row in rows]), np.array([row.strain for row in rows]), void_ratio, fabric, ending
    )


def _head(specimen: Specimen) -> dict[str, Any]:
    """Return what a report says before anything has run."""
    case = specimen.case
    return {
        **about(case),
        "columns": [column.header for column in specimen.columns],
        "accuracy": case.accuracy.curve,
        "omitted": list(specimen.omitted),
        "resolved_case": case.model_dump(mode="json", exclude_none=True),
        "stages": [],
    }


def _stress_unit(specimen: Specimen) -> str:
    return specimen.case.unit_system.label("stress")


def _roses(specimen: Specimen, folder: File, kept: Any) -> RoseFiles | None:
    asked = specimen.case.output.roses
    if asked is None:
        return None
    last = [stage.name for stage in specimen.case.stage if isinstance(stage, Path)][-1]
    return RoseFiles(folder, asked, asked.stage or last, kept)


def _clear(folder: File, kept: Sequence[str], resumed: bool) -> None:
    """Remove the results and pictures of an earlier run, or what it has that is later than its checkpoint."""
    later = ("fields_*.vtu", "*.png", ".*.part")
    first = ("fields.pvd", "roses.csv", "probes.csv", "report.json", CHECKPOINTS)
    if not resumed:
        clear_failures(folder)
    for pattern in later if resumed else (*later, *first):
        for file in folder.glob(pattern):
            if file.name not in kept:
                file.unlink()
