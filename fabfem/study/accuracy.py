"""What the study of a case found of the error of its settings, kept beside it: ``NAME.study.json`` of ``NAME.toml``.

It holds for the case as it was studied. Once something in it is changed, what was measured may no longer be so, and is
not said; the first place that differs is.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import Case, CaseError
from fabfem.identity import ASIDE, differences
from fabfem.output.atomic import write_atomic
from fabfem.study.verdict import listed

CLASSES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
"""Errors that a class ends at."""
DEARER = 1.2
"""Ratio of times from which one is the greater; less is the machine's."""
MARGIN = 0.8
"""Part of the error that other settings leave at most, to be named as better."""


class Accuracy(NamedTuple):
    """Error that a study found of the settings of a case."""

    case: dict[str, Any]
    """The case that was studied."""
    quantity: str
    """Quantity of interest."""
    error: float
    """Distance from the truth."""
    doubt: float
    """How far the truth itself may be off."""
    shares: dict[str, float]
    """What each knob changes when it alone is turned to its last value."""
    better: tuple[str, float, float] | None = None
    """Settings with the smallest error of all, that error, and their time over that of the case as it stands."""

    @property
    def largest(self) -> float | None:
        """End of the class that the error with its doubt lies in; None beyond the last."""
        return next((end for end in CLASSES if self.error + self.doubt <= end), None)


def file_beside(case: Path) -> Path:
    """Return where the accuracy of a case is kept."""
    return case.with_suffix(".study.json")


def keep(case: Case, folder: Path) -> Path:
    """Keep beside the case what the study in a folder found; `CaseError` if the case as it stands has no result."""
    found = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    own, truth, column = found["standing"], found["truth"], found["quantity"]["column"]
    if own is None or own["error"] is None:
        raise CaseError(f"{case.path.name}: with its own settings the case has no {column} to keep")
    better = _better(found["rows"], own["error"])
    kept = Accuracy(_settings(case), column, own["error"], truth["doubt"] or 0.0, own["shares"], better)
    write_atomic(file_beside(case.path), json.dumps(kept._asdict(), indent=1) + "\n")
    return file_beside(case.path)


def _better(rows: list[dict[str, Any]], error: float) -> tuple[str, float, float] | None:
    """Return the run of least error with its cost; None where the case's own settings are as good."""
    timed = [row for row in rows if row["error"] is not None and row["time"]]
    own = next((row for row in timed if not row["setting"]), None)
    best = min(timed, key=lambda row: row["error"], default=None)
    if own is None or best is None or best["error"] > MARGIN * error:
        return None
    return best["setting"], best["error"], best["time"] / own["time"]


def _settings(case: Case) -> dict[str, Any]:
    """Return what the case says, without defaults and without what only says more about it."""
    aside = ASIDE | {"output", "errors"}
    return dict(json.loads(json.dumps(case.model_dump(mode="json", exclude_defaults=True, exclude=aside))))


def accuracy_of(case: Case) -> Accuracy | None:
    """Return what is kept beside a case; None if nothing is, or nothing that can be read."""
    try:
        return Accuracy(**json.loads(file_beside(case.path).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def accuracy_sentence(case: Case) -> str:
    """Return the error class of the settings of a case in a sentence; empty where no study is kept beside it."""
    kept = accuracy_of(case)
    if kept is None:
        return ""
    changed = differences({"case": kept.case}, {"case": _settings(case), "hash": ""})
    if changed:
        return f"not known: the study kept beside the case was made when {changed[0]}"
    size = f"up to {100.0 * kept.largest:g} %" if kept.largest else f"over {100.0 * CLASSES[-1]:g} %"
    knobs = f"; {listed(kept.shares)}" if kept.shares else ""
    said = f"{size} of {kept.quantity} (its study: {100.0 * kept.error:.2g} %{knobs})"
    if kept.better is None:
        return said
    setting, left, times = kept.better
    cost = f"for {times:.2g} times the cost" if times > DEARER else "at no greater cost"
    return f"{said}; {setting}: {100.0 * left:.2g} % {cost}"
