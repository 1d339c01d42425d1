"""The march through the stages: increments that grow, halve, are tried again, and give up at a stated size.

`march` yields every converged increment. Where it cannot go on, its last item is a `Stopped` that says why and where;
nothing is raised and nothing that converged is lost. What drives a stage is chosen by the type of its goal (`COURSES`):
without one, the fraction of its loads and motions.
"""

from collections.abc import Generator, Iterator
from importlib import import_module
from typing import NamedTuple

import numpy as np

from fabfem.fem.increment import (
    Collapsed,
    Cutback,
    Increment,
    Place,
    Step,
    Stopped,
    advanced,
    increment,
)
from fabfem.fem.loads import Loading, loading
from fabfem.fem.model import Controls, Model
from fabfem.fem.newton import solve_increment
from fabfem.fem.pace import Flowed, Pace
from fabfem.fem.points import Refusal, elastic_tangents, stress_of
from fabfem.fem.space import Space
from fabfem.fem.stages import ArcLength, DisplacementControl, Stage, StrengthSearch
from fabfem.fem.start import Start, misfit
from fabfem.fem.systems import systems_of
from fabfem.fem.trial import Equilibrium, System, Trial

__all__ = ["Collapsed", "Cutback", "Increment", "Start", "Stopped", "march", "reaction"]

COURSES = {
    StrengthSearch: "fabfem.fem.safety",
    DisplacementControl: "fabfem.fem.follow",
    ArcLength: "fabfem.fem.follow",
}
"""Module whose `through` goes through a stage with such a goal."""

TOO_FAST = 4.0
"""Error of a time step, over what the stage allows, at which it is done again."""

Course = Generator[Increment | Stopped | Collapsed, None, tuple[Equilibrium | None, int]]


class Progress(NamedTuple):
    """What a stage without a goal has come to."""

    fraction: float
    size: float
    """Size to try next."""
    guess: np.ndarray | None = None
    """(ndof,) displacement increment to start from."""
    flowed: Flowed = Flowed()


def march(model: Model, start: Start | None = None) -> Iterator[Increment | Stopped | Collapsed]:
    """Iterate over the converged increments of all stages; a `Stopped` ends a run that cannot go on.

    A `Collapsed` ends a stage that searched for the factor of safety, and the run with it. With `start`, the `resume`
    of an increment of an earlier march, it goes on after that increment, to the last bit as that march did. Raises
    ValueError where a stage is impossible or `start` does not fit the model.
    """
    if start is not None and (why := misfit(model, start)):
        raise ValueError(f"the march cannot be taken up at this start: {why}.")
    return _all_stages(model, systems_of(model), start)


def reaction(space: Space, increment: Increment, boundary: str, component: str) -> float:
    """Force that the supports of a boundary exert on the body along a component."""
    return space.total(increment.internal_force - increment.external_force, space.dofs_on(boundary, component))


def _all_stages(model: Model, systems: list[System], start: Start | None) -> Iterator[Increment | Stopped | Collapsed]:
    space = model.space
    now = Equilibrium(np.zeros(space.ndof), model.states, np.zeros(space.ndof), np.zeros((0, 0, 0)))
    number, time = (start.number, start.time) if start else (0, 0.0)
    done = start.stage_index if start else 0
    del systems[:done]
    for index, stage in enumerate(model.stages[done:], done):
        system = systems.pop(0)  # what it holds goes with the stage: pattern, solver, factors
        if start and index == done:
            now, place = start.now, Place(stage, index, number, time, start.origin, start.progress)
        else:
            try:
                now = _begun(now, stage, system)
            except ValueError as error:
                yield Stopped(stage.name, index, 0.0, f"a zone cannot change its material: {error}", -1, (), {})
                return
            place = Place(stage, index, number, time, now.force)
        course = _course(place, system, now)
        del now  # its arrays live as long as the course needs them
        reached, number = yield from course
        if reached is None:
            return
        now = reached
        if stage.zero_displacement:
            now = now._replace(displacement=space.at_rest(now.displacement))
        time += stage.duration


def _begun(now: Equilibrium, stage: Stage, system: System) -> Equilibrium:
    """The state in which a stage begins: materials changed, forces those of the zones that are there."""
    states = now.states | {name: change.begin(now.states[name]) for name, change in stage.changes.items()}
    force = system.space.internal_force(stress_of(system.space, system.zones, states))
    return Equilibrium(now.displacement, states, force, elastic_tangents(system.space, system.zones, states))


def _course(place: Place, system: System, now: Equilibrium) -> Course:
    """The way through a stage that its goal asks for."""
    load = loading(system.space, place.stage.loads)
    if place.stage.released:
        load = load.released(system.constraints.keep_unknown(place.origin - load.total(0.0)))
    if place.stage.goal is None:
        return _through(place, system, now, load)
    return import_module(COURSES[type(place.stage.goal)]).through(place, system, now, load)


def _through(place: Place, system: System, now: Equilibrium, load: Loading) -> Course:
    """Yield the increments of a stage; return its last equilibrium, None where it stopped, and their number so far."""
    stage, number = place.stage, place.number
    pace, at = Pace(system.water, stage.time_tolerance), place.progress or Progress(0.0, stage.first)
    while at.fraction < 1.0:
        spent = dict(system.timer.spent)
        step = _tried(stage, system, load, now, at, pace)
        trial = step.solved.end
        if isinstance(trial, Refusal):
            timings = system.timer.since(spent)
            yield Stopped(stage.name, place.stage_index, at.fraction, trial.reason, trial.point, step.cutbacks, timings)
            return None, number
        number, old = number + 1, now
        now, at = advanced(old, trial), _gone_on(stage, system, at, old, step, trial, pace)
        done = increment(
            place._replace(number=number, progress=at), system, old, now, step, trial, system.timer.since(spent)
        )
        del old, step, trial  # a tangent of all points is large
        yield done
        del done
    return now, number


def _gone_on(
    stage: Stage, system: System, at: Progress, old: Equilibrium, step: Step, trial: Trial, pace: Pace
) -> Progress:
    """What the stage has come to after an increment from `old`."""
    last = old.displacement, trial.step, step.size
    size = _next_size(stage, system.controls, step, pace.error(at.flowed, *last))
    guess = _extrapolated(system, trial.step, step.size, min(size, 1.0 - step.fraction))
    return Progress(step.fraction, size, guess, pace.after(at.flowed, *last))


def _tried(stage: Stage, system: System, load: Loading, now: Equilibrium, at: Progress, pace: Pace) -> Step:
    """The next increment, made smaller until it converges or its size is below the stage's smallest."""
    cutbacks: tuple[Cutback, ...] = ()
    fraction, size, guess, flowed = at
    end = next(mark for mark in stage.marks if mark > fraction + 1e-9)
    while True:
        target = fraction + size if fraction + 1.001 * size < end else end
        size = target - fraction
        forces = load.total(target)
        solved = solve_increment(system, now, forces, size, guess)
        answer = solved.end
        may_shrink = 0.5 * size >= stage.smallest
        if (
            isinstance(answer, Trial)
            and may_shrink
            and pace.error(flowed, now.displacement, answer.step, size) > TOO_FAST
        ):
            answer = Refusal("the pore pressure changes faster than the time step can follow")
        if isinstance(answer, Trial):
            return Step(solved, target, size, forces, load.on_soil(target), cutbacks)
        cutbacks += (Cutback(stage.name, fraction, size, *answer, solved.residuals),)
        size, guess = 0.5 * size, None
        if size < stage.smallest:
            return Step(solved._replace(end=answer), target, size, forces, forces, cutbacks)


def _next_size(stage: Stage, controls: Controls, step: Step, pace: float) -> float:
    """The size to try next: larger after an easy increment without cut-back, as far as the flow of water allows."""
    easy = step.solved.iterations <= controls.easy and not step.cutbacks
    growth = controls.growth if easy else 1.0
    if pace > 0.0:
        growth = float(np.clip(0.9 * pace**-0.5, 0.3, growth))
    return float(np.clip(step.size * growth, stage.smallest, stage.largest))


def _extrapolated(system: System, last: np.ndarray, last_size: float, size: float) -> np.ndarray | None:
    """The last displacement increment carried on to the next size, where the controls ask for that."""
    if system.water is not None:  # a drain lets pressures fall in one step only
        return None
    return last * (size / last_size) if system.controls.extrapolate else None
