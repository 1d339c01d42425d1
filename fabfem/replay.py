"""A failure run again alone: the same point, or the same stage from the same state, and whether it ends as it did.

A point is answered by `umat.update` alone, as in an element test. The compiled kernel keeps no record of its local
iteration; that of the micromechanical material is therefore printed by the same source run without the compiler, in a
process of its own (`fabfem.trace`). Materials in closed form do not iterate.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from functools import singledispatch
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.case import CaseError, case_from
from fabfem.failures import FILE, FOLDER, PointFailure, StageFailure
from fabfem.output.archive import ArchiveError, read_archive
from fabfem.run import replay_case
from umat.status import message


class Replayed(NamedTuple):
    """What came of a failure when it was run again."""

    folder: Path
    same: bool
    """Whether it ended as it did."""
    lines: tuple[str, ...]


def replay(folder: Path) -> Iterator[Replayed]:
    """Run the failures of a folder again: one of them, or all of a result.

    Raises
    ------
    CaseError
        If there are none, or a file cannot be read.
    """
    found = (
        [folder] if (folder / FILE).is_file() else sorted(path.parent for path in folder.rglob(f"{FOLDER}/*/{FILE}"))
    )
    if not found:
        raise CaseError(f"{folder}: there is no failure to run again")
    for home in found:
        try:
            failure = read_archive(home / FILE)
        except ArchiveError as error:
            raise CaseError(str(error)) from None
        same, lines = again(failure, home)
        yield Replayed(home, same, tuple(lines))


@singledispatch
def again(failure: Any, home: Path) -> tuple[bool, list[str]]:
    """Run a failure again; return whether it ended as it did, and what to tell."""
    raise CaseError(f"{home / FILE}: is no failure")


@again.register
def _(failure: PointFailure, home: Path) -> tuple[bool, list[str]]:
    point = failure.refused
    response = umat.update(point.material, point.directions, point.strain_increment, point.state)
    status = int(response.status[0])
    lines = [
        f"point {point.point} of zone '{point.zone}' in stage {failure.stage} of {failure.case}, from "
        f"{100 * failure.fraction:.4g} % on, increment of {100 * failure.size:.4g} %",
        f"stress before {_numbers(point.state.stress[0])}",
        f"strain increment {_numbers(point.strain_increment[0])}",
        f"then: status {point.status}, {message(point.status)}",
        f"now:  status {status}, {message(status)} ({int(response.work[0])} evaluations)",
    ]
    return status == point.status, [*lines, *_iterations(point, home)]


@again.register
def _(failure: StageFailure, home: Path) -> tuple[bool, list[str]]:
    case = case_from(failure.tables, home / failure.name)
    ended, tries = replay_case(case, failure.start)
    then = (failure.stage, failure.fraction, failure.reason)
    lines = [f"stage {failure.stage} of {failure.name} from {100 * failure.fraction:.4g} % on", *tries]
    lines += [f"then: {failure.reason}", f"now:  {ended[2] if ended else 'it goes on'}"]
    return ended == then, lines


def _iterations(point: Any, home: Path) -> list[str]:
    """Return the local iteration of a point, a line each."""
    if point.directions is None:
        return ["its answer is in closed form, without iteration"]
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "fabfem.trace", str(home / FILE)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
    if done.returncode:
        return [f"the local iteration cannot be shown: {(done.stderr.splitlines() or ['no output'])[-1]}"]
    return ["local iteration, without the compiler:", *done.stdout.splitlines()]


def _numbers(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in values) + ")"
