"""Histories from a file of columns; their names and units are in docs/fabric_laws.md."""

import numpy as np

from fabfem.case import CaseError, FabricCase, suggest
from fabfem.case import fabric as said
from fabfem.fabric_tests.columns import AXES, read_lines
from fabfem.fabric_tests.curves import Curve
from fabfem.fabric_tests.drives import blamed
from fabfem.fabric_tests.group import Group
from umat.fabric_history import Given, reads
from umat.mandel import FACTOR, Array, p

NUMBERS = {"stress": 6, "strain": 6, "plastic_strain": 6, "state_parameter": 1}


def read_histories(drive: said.History, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    """Return the histories of a file; `CaseError` names the line that is wrong, or what a law misses."""
    with blamed(case, "history.file"):
        columns, names = _read(case, drive)
    groups = []
    for name in dict.fromkeys(names):
        mine = np.array([other == name for other in names])
        groups.append(_group(drive, name, {key: values[mine] for key, values in columns.items()}))
    for curve in laws:
        for group in groups:
            _check(case, curve, group, columns)
    return tuple(groups)


def _read(case: FabricCase, drive: said.History) -> tuple[dict[str, Array], list[str]]:
    """Return the numbers by the names of `docs/fabric_laws.md`, and the name of each row's path."""
    lines = read_lines(case, drive.file)
    if len(lines) < 3:
        raise ValueError(f"{drive.file} needs a header and two records at least")
    headers = [header.split("[")[0].strip() for header in lines[0]]
    for number, line in enumerate(lines, 1):
        if len(line) != len(headers):
            raise ValueError(f"{drive.file}, row {number}: has {len(line)} entries where the header has {len(headers)}")
    wanted = {
        name: name for name in ("path", "state_parameter", *(f"{k}_{a}" for k in list(NUMBERS)[:3] for a in AXES))
    }
    if "psi" in headers and "state_parameter" not in headers:
        wanted["state_parameter"] = "psi"  # as element tests call it
    lines[1:] = _of_stage(drive, lines[1:], headers)
    for name, other in drive.columns.items():
        _rename(case, wanted, headers, name, other)
    at = {name: headers.index(other) for name, other in wanted.items() if other in headers}
    names = [line[at["path"]] for line in lines[1:]] if "path" in at else ["history"] * (len(lines) - 1)
    numbers = {name: np.array(_numbers(drive, lines, place)) for name, place in at.items() if name != "path"}
    return numbers, names


def _of_stage(drive: said.History, lines: list[list[str]], headers: list[str]) -> list[list[str]]:
    """Return the rows of the stage that is asked for; strains of element tests begin anew in each."""
    if "stage" not in headers:
        if drive.stage is not None:
            raise ValueError(f"{drive.file} has no column 'stage'")
        return lines
    place = headers.index("stage")
    stages = list(dict.fromkeys(line[place] for line in lines))
    if drive.stage is None and len(stages) > 1:
        raise ValueError(f"{drive.file} has the stages {', '.join(stages)}; history.stage must say which")
    kept = [line for line in lines if line[place] == (drive.stage or stages[0])]
    if len(kept) < 2:
        raise ValueError(
            f"{drive.file} has no stage '{drive.stage}' of two records at least; there are {', '.join(stages)}"
        )
    return kept


def _rename(case: FabricCase, wanted: dict[str, str], headers: list[str], name: str, other: str) -> None:
    other, place = other.split("[")[0].strip(), f"{case.path.name}: history.columns.{name}"
    if name not in wanted:
        raise CaseError(f"{place}: is no column of a history{suggest(name, wanted)}")
    if other not in headers:
        raise CaseError(f"{place}: the file has no column '{other}'{suggest(other, headers)}")
    wanted[name] = other


def _numbers(drive: said.History, lines: list[list[str]], place: int) -> list[float]:
    """Return a column; rows are counted with the header, without comments."""
    found = []
    for number, line in enumerate(lines[1:], 2):
        try:
            value = float(line[place])
        except ValueError:
            what = f"no number ({line[place]!r})"
            raise ValueError(f"{drive.file}, row {number}, column '{lines[0][place]}': {what}") from None
        if not np.isfinite(value):
            raise ValueError(f"{drive.file}, row {number}, column '{lines[0][place]}': not finite ({value})")
        found.append(value)
    return found


def _group(drive: said.History, name: str, columns: dict[str, Array]) -> Group:
    """Return one history; a shear component that the file leaves out is zero."""
    m = len(next(iter(columns.values()), np.zeros(0)))
    found, missing = {}, set()
    for kind, count in NUMBERS.items():
        keys = [kind] if count == 1 else [f"{kind}_{axes}" for axes in AXES]
        if not any(key in columns for key in keys):
            missing.add(kind)
        values = np.stack([columns.get(key, np.zeros(m)) for key in keys], axis=-1)
        found[kind] = values[:, 0, None] if count == 1 else (values * FACTOR)[:, None]
    if drive.plastic == "total":
        found["plastic_strain"] = found["strain"]
        missing = missing - {"plastic_strain"} | ({"plastic_strain"} if "strain" in missing else set())
    return Group(((name, "", ""),), Given(**found), missing=frozenset(missing))


def _check(case: FabricCase, curve: Curve, group: Group, columns: dict[str, Array]) -> None:
    """Refuse a history without what a law reads, or with a mean pressure that is not positive."""
    file = case.path.name
    called = {"stress": "stress", "ratio": "stress", "strain": "strain", "plastic": "plastic_strain"}
    needed = {called.get(name, name) for name in reads(curve.law)} - {"fabric"}
    for kind in sorted(needed & group.missing):
        hint = "; plastic = 'total' takes the total strain" if kind == "plastic_strain" else ""
        raise CaseError(f"{file}: history.file: has no {kind}, which the law '{curve.name}' reads{hint}")
    for axes in AXES[: 2 if curve.planar else 3] if "stress" in needed else ():
        if f"stress_{axes}" not in columns:
            raise CaseError(f"{file}: history.file: has no stress_{axes}, which the law '{curve.name}' reads")
    if "stress" in needed and not curve.planar and p(group.given.stress).min() <= 0.0:
        raise CaseError(f"{file}: history.file: the mean pressure must be positive; compression is positive")
