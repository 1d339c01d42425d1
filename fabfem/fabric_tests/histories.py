"""Laws along a history: from a file of columns, or from a path of the Chang–Hicher model."""

from collections.abc import Iterator
from functools import singledispatch
from itertools import product
from typing import Any

import numpy as np

from fabfem.case import FabricCase
from fabfem.case import fabric as said
from fabfem.fabric_tests.columns import DRIVE, FABRIC, drive_columns, fabric_columns, headers, rows
from fabfem.fabric_tests.curves import Curve, curves, start
from fabfem.fabric_tests.drives import Block, Measured, Value
from fabfem.fabric_tests.group import Group
from umat.fabric_history import evolve
from umat.mandel import Array

LABELS = ("law", "path", "b [-]", "alpha [degree]", "record")


@singledispatch
def histories(drive: Any, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    """Return the histories of a drive; `CaseError` if it has none that the laws can be run along."""
    raise TypeError(f"{type(drive).__name__} holds no history")


@histories.register
def _(drive: said.History, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    from fabfem.fabric_tests.files import read_histories

    return read_histories(drive, case, laws)


@histories.register
def _(drive: said.Loading, case: FabricCase, laws: tuple[Curve, ...]) -> tuple[Group, ...]:
    from fabfem.fabric_tests.loadings import compute_histories

    return compute_histories(drive, case)


def measure(drive: said.History | said.Loading, case: FabricCase) -> Measured:
    """Return the table of all laws along all histories."""
    laws = curves(case)
    groups = histories(drive, case, laws)
    for curve, group in product(laws, groups):  # what cannot start is said before anything is written
        start(case, curve, group.given.stress[0], None if group.fabric is None else group.fabric[0])
    size = sum(len(group.labels) for group in groups)
    records = sum(len(group.labels) * len(group.given.stress) for group in groups)
    remains = (("laws", str(len(laws))), ("histories", str(size)), ("records", str(records)))
    return Measured((*LABELS, *headers(case.unit_system)), _blocks(case, laws, groups), len(laws) * size, remains)


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
