"""A path of the laboratory: its legs one after the other, and how it ended."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfem.case.paths import Path
from fabfem.laboratory.plans import plan
from fabfem.laboratory.specimen import Specimen
from umat import mandel, status
from umat.legs import Leg
from umat.mandel import Array
from umat.path import BEYOND, DONE, REFUSED, Controls, Moment, march
from umat.walk import Watch

SHARE = 0.1
"""Part of the accuracy of the curves that one step may err by."""


class Point(NamedTuple):
    """Where the specimen is: one row of the history to be."""

    stage: str
    """Name of the stage."""
    increment: int
    """Number of the row in its stage; 0 is the start."""
    fraction: float
    """Fraction of the stage's legs."""
    strain: Array
    """(6,) strain of the stage."""
    state: Any
    """State of the material, of one point."""
    leg: int
    """Number of the leg, from 0; a stage without reversals has one."""
    steps: int = 0
    """Steps since the start of the stage."""
    work: int = 0
    """Evaluations of the material since then."""


class End(NamedTuple):
    """How a stage ended."""

    status: str
    """``completed``, ``liquefied``, ``beyond_peak`` or ``stopped``."""
    reason: str
    """Why it ended before its end, in a sentence; empty when completed."""
    steps: int
    """Steps of all legs."""
    work: int
    """Evaluations of the material."""
    error: float
    """Sum of the differences between steps and their halves [-], an upper estimate of the path's error."""


def path(specimen: Specimen, stage: Path, state: Any, strain: Array) -> Iterator[Point | End]:
    """Yield the points of a stage that starts from a state and a strain (6,), and last of all its `End`."""
    todo = plan(stage, state.stress[0])
    watch = _liquefies(specimen.atmosphere * stage.liquefied, state)
    origin, start, row, error = state.stress[0], strain, 0, 0.0
    steps = work = 0
    yield Point(stage.name, 0, 0.0, strain, state, 0)
    for number, target in enumerate(todo.targets):
        done = todo.on_stress @ (state.stress[0] - origin) + todo.on_strain @ (strain - start)
        leg, base, seen = Leg(todo.on_stress, todo.on_strain, target - done), strain, 0
        rows, how = stage.increments * todo.turns, controls(specimen, stage)
        for moment in march(specimen.material, specimen.directions, state, leg, rows, how, todo.course, watch):
            if moment.steps[0] > seen:
                row, seen = row + 1, moment.steps[0]
                fraction = (number + float(moment.fraction[0])) / len(todo.targets)
                gone = steps + seen, work + int(moment.work[0])
                yield Point(stage.name, row, fraction, base + moment.strain[0], moment.state, number, *gone)
        state, strain = moment.state, base + moment.strain[0]
        steps, work, error = steps + int(moment.steps[0]), work + int(moment.work[0]), error + float(moment.error[0])
        if moment.ended[0] != DONE:
            yield End(*_why(specimen, stage, moment), steps, work, error)
            return
    yield End("completed", "", steps, work, error)


def controls(specimen: Specimen, stage: Path) -> Controls:
    """Return how the legs of a stage are followed."""
    return Controls(error=SHARE * specimen.case.accuracy.curve, beyond=stage.strain_limit)


def _liquefies(least: float, start: Any) -> Watch | None:
    """Return the watch for a mean stress that falls below the least, ``None`` where none is set."""
    if least <= 0.0:
        return None
    above = mandel.p(start.stress) >= least  # a test may start with less

    def watch(state: Any) -> NDArray[np.bool_]:
        pressure = mandel.p(state.stress)
        above[:] |= pressure >= least
        return np.asarray(above & (pressure < least))

    return watch


def _why(specimen: Specimen, stage: Path, moment: Moment) -> tuple[str, str]:
    """Return the status and the sentence of a leg that did not come to its end."""
    at = f"at {100.0 * float(moment.fraction[0]):.3g} % of the way to its target"
    unit = specimen.case.unit_system.label("stress")
    pressure = float(mandel.p(moment.state.stress)[0])
    if moment.ended[0] == BEYOND:
        return "beyond_peak", (
            f"the stress cannot reach its target: {at} strain has led beyond the peak, "
            f"to the strain_limit of {stage.strain_limit:g}"
        )
    if moment.ended[0] == REFUSED:
        code = int(moment.code[0])
        cause = status.message(code) if code else "no strain increment, however small, meets the six conditions"
        hint = "" if code or specimen.directions is None else "; a finer rule of directions may"
        return "stopped", f"{at}: {cause.rstrip('.')}{hint}"
    return "liquefied", f"the mean effective stress fell to {pressure:.3g} {unit} {at}"
