"""What a run will cost, before it runs: time from the rates of earlier runs of the same kind on this machine.

A rate is measured at first use, by a pilot: the problem is marched for some seconds and left. It is stored in the
user's cache, and the rates of a run that completed replace those of a pilot. The kind of a run is all that decides how
dear a point and an increment are: kinematics, element, materials with their laws and rules, tolerances and stages.
The size of the mesh and the number of increments may differ; time is taken to grow with the points and, in the solver,
with the unknowns to the power 1.25 in a plane and 1.6 in space, between those of a matrix's entries and of its factors.
"""

import hashlib
import json
import time
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.boundary_value.problem import Problem
from fabfem.case import BoundaryValueCase
from fabfem.case.stages import AnyStage
from fabfem.fem.model import Controls
from fabfem.fem.solve import Increment, march
from fabfem.output.atomic import write_atomic
from umat.cache import user_cache

PILOT = 10.0
"""Time after which a pilot is left, with the increment that goes on then [s]."""
GROWTH = {2: 1.25, 3: 1.6}
"""Power of the unknowns with which a linear solve grows, by the dimension of the mesh."""
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
    """What does not grow [s]."""
    whole: bool
    """Whether a whole run was measured, or a pilot."""


class Price(NamedTuple):
    """What a run will cost."""

    seconds: float
    """Wall time [s]."""
    source: str
    """Where the rates come from."""


def price(problem: Problem) -> Price:
    """Return what a problem will cost; without rates of its kind a pilot measures them, in ten seconds or so."""
    rates = stored(problem.case)
    if rates is None:
        rates = _pilot(problem)
        _store(problem.case, rates)
    source = "a run of this kind on this machine" if rates.whole else "its first increments on this machine"
    return Price(predicted(problem, rates), source)


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
    _store(problem.case, measured(problem, report["wall_time"], [i["iterations"] for i in report["increments"]], 1.0))


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
    """Return the rates of the first increments; one made before, which compiles and loads kernels, does not count."""
    next(march(problem.model))
    begun, steps = time.perf_counter(), []
    for step in march(problem.model):
        if not isinstance(step, Increment):
            break
        steps.append(step)
        if time.perf_counter() - begun > PILOT:
            break
    counted = steps[1:] or steps
    names = ("material", "assembly", "linear_solve")
    spent = {name: sum(step.timings[name] for step in counted) for name in names}
    first = time.perf_counter() - begun - sum(sum(step.timings.values()) for step in steps)
    return measured(problem, spent, [step.iterations for step in counted], 0.0)._replace(fixed=max(first, 0.0))


def stored(case: BoundaryValueCase) -> Rates | None:
    """Return the rates of the kind of a case, if they are known."""
    try:
        return Rates(**json.loads(_file(case).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def _store(case: BoundaryValueCase, rates: Rates) -> None:
    file = _file(case)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(file, json.dumps(rates._asdict()) + "\n")
    except OSError:
        return  # a cache that cannot be written costs no more than the next pilot


def _file(case: BoundaryValueCase) -> Path:
    """Return the file of the rates of a kind of run."""
    said = case.model_dump(mode="json", exclude=set(APART))
    for stage in said["stage"]:
        stage.pop("increments")
    said["mesh"] = {"order": case.mesh.order, "points": case.mesh.points, "box": case.mesh.box and case.mesh.box.shape}
    key = hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]
    return user_cache() / "fabfem-rates" / f"{key}.json"


def _unknowns(problem: Problem) -> float:
    return float(problem.model.space.ndof ** GROWTH[problem.model.space.mesh.dim])
