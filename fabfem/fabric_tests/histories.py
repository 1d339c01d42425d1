"""Laws along a history: from a file of columns, or from a path of the Chang–Hicher model."""

import csv
from collections.abc import Iterator
from functools import singledispatch
from itertools import product
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.case import CaseError, FabricCase, suggest
from fabfem.case import fabric as said
from fabfem.fabric_tests.columns import AXES, DRIVE, FABRIC, drive_columns, fabric_columns, headers, rows
from fabfem.fabric_tests.curves import VERTICAL, Curve, curves, start
from fabfem.fabric_tests.drives import Block, Measured, Value, blamed
from fabfem.substance import Surroundings, substance
from umat import path as paths
from umat.fabric_history import Given, evolve, reads
from umat.mandel import FACTOR, IDENTITY, Array, p

LABELS = ("law", "path", "b [-]", "alpha [degree]", "record")
NUMBERS = {"stress": 6, "strain": 6, "plastic_strain": 6, "state_parameter": 1}


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


def measure(drive: said.History | said.Loading, case: FabricCase) -> Measured:
    """Return the table of all laws along all histories."""
    laws = curves(case)
    groups = histories(drive, case, laws)
    size = sum(len(group.labels) for group in groups)
    records = sum(len(group.labels) * len(group.given.stress) for group in groups)
    remains = (("laws", str(len(laws))), ("histories", str(size)), ("records", str(records)))
    return Measured((*LABELS, *headers(case.unit_system)), _blocks(case, laws, groups), remains)


def _blocks(case: FabricCase, laws: tuple[Curve, ...], groups: tuple[Group, ...]) -> Iterator[Block]:
    for curve, group in product(laws, groups):
        begin = start(case, curve, group.given.stress[0], None if group.fabric is None else group.fabric[0])
        done = evolve(curve.law, group.given, begin, curve.update)
        drive = drive_columns(group.given)
        found = fabric_columns(done.fabric, group.given.stress, curve.planar)
        last = done.reached + 1
        for i, label in enumerate(group.labels):
            columns = [column[:last, i] for column in (*drive, *found)]
            reason = f"law {curve.name}, path {label[0]}: {done.reason or group.reason}"
            yield Block(
                list(rows((curve.name, *label), columns)),
                _summary(curve, label, columns) | _distance(group, done.fabric[:, i], i, curve) | {"work": done.work},
                reason if done.reason or group.reason else "",
            )


def _summary(curve: Curve, label: tuple[Value, ...], columns: list[Array]) -> dict[str, Any]:
    """Return peaks and ends of a curve."""
    names = [*DRIVE, *FABRIC]
    eta, fabric, b = (columns[names.index(name)] for name in ("eta", "F_q", "F_b"))
    found: dict[str, Any] = {"law": curve.name, "path": label[0], "records": len(eta) - 1}
    for name, values in (("eta", eta), ("F_q", fabric)):
        if np.isfinite(values).any():
            top = int(np.nanargmax(values))
            found |= {f"{name}_peak": float(values[top]), f"{name}_peak_record": top, f"{name}_end": _end(values)}
    return found | {"F_b_end": _end(b)}


def _distance(group: Group, fabric: Array, i: int, curve: Curve) -> dict[str, float]:
    """Return how far the law goes from the fabric of the material that computed the path."""
    if group.fabric is None or curve.planar:
        return {}
    return {"distance_from_model": float(np.nanmax(np.abs(fabric - group.fabric[:, i])))}


def _end(values: Array) -> float | None:
    return float(values[-1]) if np.isfinite(values[-1]) else None


# --- where histories come from --------------------------------------------------------------------------------------


@singledispatch
def histories(drive: Any, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    """Return the histories of a drive."""
    raise TypeError(f"{type(drive).__name__} holds no history")


@histories.register
def _(drive: said.History, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    with blamed(case, "history.file"):
        columns, names = _read(case, drive)
    groups = []
    for name in dict.fromkeys(names):
        mine = np.array([other == name for other in names])
        groups.append(_group(drive, name, {key: values[mine] for key, values in columns.items()}))
    for curve in laws:
        _check(case, curve, groups[0], columns)
    return tuple(groups)


def _read(case: FabricCase, drive: said.History) -> tuple[dict[str, Array], list[str]]:
    """Return the numbers by the names of `docs/fabric_laws.md`, and the name of each row's path."""
    source = case.locate(drive.file)
    try:
        with source.open(encoding="utf-8", newline="") as file:
            lines = [line for line in csv.reader(line for line in file if not line.startswith("#")) if line]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{drive.file} cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(lines) < 3:
        raise ValueError(f"{drive.file} needs a header and two records at least")
    headers = [header.split("[")[0].strip() for header in lines[0]]
    wanted = {
        name: name for name in ("path", "state_parameter", *(f"{k}_{a}" for k in list(NUMBERS)[:3] for a in AXES))
    }
    for name, other in drive.columns.items():
        _rename(case, wanted, headers, name, other)
    at = {name: headers.index(other) for name, other in wanted.items() if other in headers}
    names = [line[at["path"]] for line in lines[1:]] if "path" in at else ["history"] * (len(lines) - 1)
    numbers = {name: np.array(_numbers(drive, lines, place)) for name, place in at.items() if name != "path"}
    return numbers, names


def _rename(case: FabricCase, wanted: dict[str, str], headers: list[str], name: str, other: str) -> None:
    other = other.split("[")[0].strip()
    if name not in wanted:
        raise CaseError(f"{case.path.name}: history.columns.{name}: is no column of a history{suggest(name, wanted)}")
    if other not in headers:
        raise CaseError(
            f"{case.path.name}: history.columns.{name}: the file has no column '{other}'{suggest(other, headers)}"
        )
    wanted[name] = other


def _numbers(drive: said.History, lines: list[list[str]], place: int) -> Iterator[float] | list[float]:
    found = []
    for number, line in enumerate(lines[1:], 2):
        try:
            value = float(line[place])
        except (ValueError, IndexError):
            got = line[place] if place < len(line) else "nothing"
            raise ValueError(
                f"{drive.file}, line {number}, column '{lines[0][place]}': not a number ({got!r})"
            ) from None
        if not np.isfinite(value):
            raise ValueError(f"{drive.file}, line {number}, column '{lines[0][place]}': not finite ({value})")
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


@histories.register
def _(drive: said.Loading, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    from umat.chang_hicher.material import critical_void_ratio
    from umat.plastic_strain import plastic_strain

    ((name, table),) = case.material.items()
    with blamed(case, f"material.{name}"):
        sand = substance(table, Surroundings(case.unit_system, VERTICAL, flat=False))
        variants = list(product(drive.b, drive.alpha))
        stress = np.tile(drive.pressure * IDENTITY, (len(variants), 1))
        state = umat.initial_state(sand.material, sand.directions, stress, **sand.needs)
    seen = _follow(drive, sand, state, variants)
    plastic = plastic_strain(sand.material, sand.directions, seen.stress, seen.strain, seen.fabric, seen.void_ratio)
    psi = seen.void_ratio - critical_void_ratio(sand.material, p(seen.stress))
    labels = [(f"b={b:g} alpha={alpha:g}", b, alpha) for b, alpha in variants]
    records = np.isfinite(seen.stress[..., 0]).sum(axis=0)
    groups = []
    for count in np.unique(records)[::-1]:
        mine = np.flatnonzero(records == count)
        parts = [array[:count, mine] for array in (seen.stress, seen.strain, plastic, psi)]
        why = (
            "" if count == len(psi) else f"the material stopped after {count - 1} of {len(psi) - 1} records of the path"
        )
        groups.append(Group(tuple(labels[i] for i in mine), Given(*parts), seen.fabric[:count, mine], reason=why))
    return tuple(groups)


def _follow(drive: said.Loading, sand: Any, state: Any, variants: list[tuple[float, float]]) -> paths.History:
    """Return one history of all legs; strains add up, and a point that stopped in one leg stays stopped."""
    kept: list[paths.History] = []
    strain, alive = np.zeros((len(variants), 6)), np.ones(len(variants), bool)
    for leg in drive.leg:
        each = [_leg(leg, b, alpha) for b, alpha in variants]
        conditions = paths.Leg(*(np.array(part) for part in zip(*each, strict=True)))
        done = paths.follow(sand.material, sand.directions, state, conditions, records=leg.records)
        shift = 0 if not kept else 1
        arrays = [
            np.array(array[shift:]) for array in (done.stress, done.strain + strain, done.void_ratio, done.fabric)
        ]
        for array in arrays:
            array[:, ~alive] = np.nan
        kept.append(done._replace(**dict(zip(("stress", "strain", "void_ratio", "fabric"), arrays, strict=True))))
        alive &= done.reached >= 1.0
        strain, state = np.nan_to_num(strain + done.strain[-1]), done.state
    joined = {
        name: np.concatenate([getattr(one, name) for one in kept])
        for name in ("stress", "strain", "void_ratio", "fabric")
    }
    return kept[-1]._replace(**joined)


def _leg(leg: said.Leg, b: float, alpha: float) -> paths.Leg:
    """Return the conditions of a leg."""
    if leg.pressure is not None:
        return paths.isotropic(leg.pressure)
    strain = float(leg.strain or 0.0)
    if leg.kind == "triaxial":
        return paths.triaxial(strain)
    return {"constant_p": paths.constant_p, "undrained": paths.undrained}[leg.kind](strain, alpha, b)
