"""What a run will cost, before it runs: time from the rates of earlier runs of the same kind on this machine.

A rate is measured at first use, by a pilot: the problem is marched for some seconds and left. It is stored, and the
rates of a run that completed replace those of a pilot (`fabfem.rates`). The kind of a run is all that decides how
dear a point and an increment are: kinematics, element, materials with their laws and rules, tolerances and stages.
The size of the mesh and the number of increments may differ; time is taken to grow with the points and, in the solver,
with the unknowns to the power 1.25 in a plane and 1.6 in space, between those of a matrix's entries and of its factors.
"""

import time
from typing import Any, NamedTuple

from fabfem import rates as kept
from fabfem.boundary_value.problem import Problem
from fabfem.case import BoundaryValueCase
from fabfem.case.stages import AnyStage
from fabfem.fem.model import Controls
from fabfem.fem.solve import Increment, march
from fabfem.rates import Price, Stopwatch, share_of, source, start_of

PILOT, PATIENCE = 10.0, 30.0
"""Own time, and wall time, after which a pilot is left with the increment that goes on then [s]."""
GROWTH = {2: 1.25, 3: 1.6}
"""Power of the unknowns with which a linear solve grows, by the dimension of the mesh."""
GROWING = ("material", "assembly", "linear_solve")
"""Phases of an increment."""
APART = ("mesh", "probe", "reaction", "derived", "output", "title", "sweep", "study", "calibration", "errors")
"""Tables that do not decide the kind of a run."""


class Rates(NamedTuple):
    """What a kind of run costs on this machine."""

    material: float
    """Points, assembly and output, for each point and linear solve [s]."""
    linear: float
    """Linear solve, over the unknowns to their power [s]."""
    solves: float
    """Linear solves of an increment."""
    increments: float
    """Increments over those that the sizes of the stages promise."""
    fixed: float
    """What does not grow: the start of the program, mesh, kernels [s]."""
    whole: bool
    """Whether a whole run was measured, or a pilot."""


def price(problem: Problem) -> Price:
    """Return what a problem will cost; without rates of its kind a pilot measures them, in ten seconds or so."""
    rates = stored(problem.case)
    if rates is None:
        rates = _pilot(problem)
        _store(problem.case, rates)
    return Price(predicted(problem, rates), source(rates.whole, "its first increments"))


def predicted(problem: Problem, rates: Rates) -> float:
    """Return the wall time of a problem at some rates [s]."""
    solves = expected(problem.case) * rates.increments * rates.solves
    return rates.fixed + solves * (rates.material * problem.model.space.npoints + rates.linear * _unknowns(problem))


def expected(case: BoundaryValueCase) -> int:
    """Return the increments that the sizes of the stages promise, where none is refused."""
    return sum(_increments(stage) for stage in case.stage)


def _increments(stage: AnyStage) -> int:
    done, size, count = 0.0, stage.increments.initial, 0
    while done < 1.0 - 1e-9:
        done, size, count = done + size, min(size * Controls.growth, stage.increments.maximum), count + 1
    return count


def remember(problem: Problem, report: dict[str, Any]) -> None:
    """Store the rates of a run that completed, from its report."""
    free = share_of(report)
    spent = {phase: free * seconds for phase, seconds in report["wall_time"].items()}
    rates = measured(problem, spent, [i["iterations"] for i in report["increments"]], 1.0)
    _store(problem.case, rates._replace(fixed=rates.fixed + start_of(report)))


def measured(problem: Problem, spent: dict[str, float], iterations: list[int], share: float) -> Rates:
    """Return the rates of a run, or of a share of it, from the wall time by phase [s] and the solves of increments."""
    solves = max(sum(iterations), 1)
    grown = sum(spent.get(phase, 0.0) for phase in ("material", "assembly", "output"))
    return Rates(
        material=grown / solves / problem.model.space.npoints,
        linear=spent["linear_solve"] / solves / _unknowns(problem),
        solves=solves / max(len(iterations), 1),
        increments=len(iterations) / max(share * expected(problem.case), 1.0) if share == 1.0 else 1.0,
        fixed=max(spent.get("total", 0.0) - grown - spent["linear_solve"], 0.0),
        whole=share == 1.0,
    )


def _pilot(problem: Problem) -> Rates:
    """Return the rates of the first increments; one made before, which loads kernels, counts as part of the start."""
    start, loading = time.process_time(), Stopwatch()
    next(march(problem.model))
    first = 0.0 if loading.compiled else loading.free
    steps: list[Increment] = []
    laps: list[float] = []
    watch, lap, done = Stopwatch(), Stopwatch(), True
    for step in march(problem.model):
        if isinstance(step, Increment):
            steps, laps, lap = [*steps, step], [*laps, lap.free], Stopwatch()
        if watch.free > PILOT or watch.wall > PATIENCE:
            done = False
            break
    late = slice(0 if done else 1, None) if len(steps) > 1 else slice(None)
    wall = sum(step.timings[name] for step in steps[late] for name in GROWING)
    share = sum(laps[late]) / wall if wall else 1.0
    spent = {name: share * sum(step.timings[name] for step in steps[late]) for name in GROWING}
    rates = measured(problem, spent, [step.iterations for step in steps[late]], float(done))
    return rates._replace(fixed=start + max(first - (laps[0] if laps else 0.0), 0.0), whole=False)


def stored(case: BoundaryValueCase) -> Rates | None:
    """Return the rates of the kind of a case, if they are known."""
    return kept.known(Rates, _kind(case))


def _store(case: BoundaryValueCase, rates: Rates) -> None:
    kept.store(_kind(case), rates._asdict())


def _kind(case: BoundaryValueCase) -> dict[str, Any]:
    """Return what tells the kind of a run."""
    said = case.model_dump(mode="json", exclude=set(APART))
    for stage in said["stage"]:
        stage.pop("increments")
    box = case.mesh.box and case.mesh.box.shape
    return said | {"mesh": {"order": case.mesh.order, "points": case.mesh.points, "box": box}}


def _unknowns(problem: Problem) -> float:
    return float(problem.model.space.ndof ** GROWTH[problem.model.space.mesh.dim])
