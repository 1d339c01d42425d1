"""All that an element test writes, as it goes on: the history, the report, directional distributions."""

from pathlib import Path as File
from typing import Any

import numpy as np

import umat
from fabfem.case.element import Path, Probe
from fabfem.laboratory.columns import COMPONENTS, Row, zeta
from fabfem.laboratory.landmarks import Rows, interpolated, landmarks
from fabfem.laboratory.probes import ProbeFile
from fabfem.laboratory.roses import RoseFiles
from fabfem.laboratory.specimen import Specimen
from fabfem.laboratory.stages import End, Point
from fabfem.output.history import History
from fabfem.output.report import Report
from fabfem.timing import Timer
from umat import mandel, measures
from umat.mandel import FACTOR

PHASES = ("read", "material", "paths", "output")
STANDING = ("stage", "increment [-]", "fraction [-]")


class Recorder:
    """All that an element test writes."""

    def __init__(self, specimen: Specimen, folder: File, timer: Timer) -> None:
        self.specimen, self.folder, self.timer = specimen, folder, timer
        _clear(folder)
        self.headers = [*STANDING, *(column.header for column in specimen.columns)]
        self.history = History(folder / "history.csv", self.headers)
        self.report = Report(folder / "report.json", **_head(specimen))
        self.roses = _roses(specimen, folder)
        self.probes: ProbeFile | None = None
        self.values: tuple[Any, ...] = ()
        self.count = 0
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
        self.probes = self.probes or ProbeFile(self.folder, self.specimen.case.unit_system.label("stress"))
        ends = self.probes.write(self.specimen, stage, state)
        reason = "" if ends == stage.directions else f"{stage.directions - ends} of the probes were refused"
        self.report.content["stages"].append(
            {"name": stage.name, "kind": "probe", "status": "completed", "reason": reason, "probes": ends}
        )
        self._write()

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
        total = self.timer.total()
        self.report.write({**self.timer.spent, "other": total - sum(self.timer.spent.values()), "total": total})


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
    case, units = specimen.case, specimen.case.unit_system
    return {
        "case": case.path.name,
        "title": case.title,
        "units": {**units._asdict(), "stress": units.label("stress")},
        "columns": [column.header for column in specimen.columns],
        "accuracy": case.accuracy.curve,
        "omitted": list(specimen.omitted),
        "resolved_case": case.model_dump(mode="json", exclude_none=True),
        "stages": [],
    }


def _roses(specimen: Specimen, folder: File) -> RoseFiles | None:
    asked = specimen.case.output.roses
    if asked is None:
        return None
    last = [stage.name for stage in specimen.case.stage if isinstance(stage, Path)][-1]
    return RoseFiles(folder, asked, asked.stage or last)


def _clear(folder: File) -> None:
    """Remove the results and pictures of an earlier run."""
    for pattern in ("fields_*.vtu", "fields.pvd", "history.csv", "roses.csv", "probes.csv", "report.json", "*.png"):
        for file in folder.glob(pattern):
            file.unlink()
