"""Points under way on a leg, each with its own steps: made, judged, accepted or shortened.

A step that the material or Newton's method refuses, or whose halves differ from it by too much, is made shorter; easy
ones are followed by longer ones. A point whose step falls below `Controls.turning` is led by its strain from then on,
if `Controls.beyond` lets it; one whose step falls below `Controls.smallest` stops.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .interface import elastic_tangent
from .legs import Leg
from .mandel import Array, deviator, dot, norm
from .step import Course, Found, Task, of, solve

RUNNING, DONE, REFUSED, BEYOND, WATCHED = range(5)
"""What became of a point: under way; at the end of the leg; no step is small enough; led by its strain as far as it may
be without reaching the end; stopped by the caller's watch."""

FIRST, REACH, LEAST = 0.05, 3.0, 1e-4
"""Longest correction of the strain: in the first step, over the strain of the step before, and at least [-]."""


class Controls(NamedTuple):
    """How a leg is followed; sizes are fractions of the leg."""

    tolerance: float = 1e-9  #: on a condition, relative to the stress and to the step's strain [-]
    largest: float = 1.0  #: step
    smallest: float = 1e-7  #: step below which a point stops
    max_iterations: int = 12  #: Newton's, of a step
    easy: int = 4  #: iterations up to which the next step is larger
    growth: float = 1.5  #: of an easy step
    error: float = 0.0  #: most difference between a step and its halves, of stress and of strain [-]; 0 makes no halves
    beyond: float = 0.0  #: deviatoric strain √(2/3)‖Δe‖ up to which strain leads where stress cannot [-]; 0 stops there
    turning: float = 1e-4  #: step below which the strain takes the lead


class Moment(NamedTuple):
    """Where n points are on the leg."""

    fraction: Array
    """(n,) of the leg."""
    strain: Array
    """(n, 6) strain since the start of the leg [-]."""
    state: Any
    """State of the material."""
    ended: NDArray[np.int64]
    """(n,) `RUNNING`, `DONE`, `REFUSED`, `BEYOND` or `WATCHED`."""
    led: NDArray[np.bool_]
    """(n,) whether the strain leads."""
    code: NDArray[np.int64]
    """(n,) the material's status at the last step that was refused; 0 where it refused none."""
    steps: NDArray[np.int64]
    """(n,) steps taken so far, halves not counted."""
    work: NDArray[np.int64]
    """(n,) evaluations of the material so far."""
    error: Array
    """(n,) sum of the differences between steps and their halves so far; 0 without halves [-]."""


Watch = Callable[[Any], NDArray[np.bool_]]
"""Which points (n,) of a state stop."""


class Walk:
    """The points under way: what changes from step to step."""

    def __init__(self, material: Any, state: Any, size: float) -> None:
        n = len(state.stress)
        self.state, self.strain, self.origin = state, np.zeros((n, 6)), state.stress.copy()
        self.tangent = np.array(elastic_tangent(material, state))
        self.reached, self.size = np.zeros(n), np.full(n, size)
        self.last, self.length = np.zeros((n, 6)), np.zeros(n)
        self.ended, self.led = np.full(n, RUNNING), np.zeros(n, bool)
        self.steps, self.work, self.code = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.error = np.zeros(n)

    def moment(self) -> Moment:
        """Return where the points are now."""
        return Moment(
            self.reached.copy(),
            self.strain.copy(),
            self.state,
            self.ended.copy(),
            self.led.copy(),
            self.code.copy(),
            self.steps.copy(),
            self.work.copy(),
            self.error.copy(),
        )


class Way(NamedTuple):
    """What does not change on the way."""

    material: Any
    directions: Any
    leg: Leg
    course: Course | None
    controls: Controls
    records: int
    watch: Watch | None

    def task(self, walk: Walk, ids: NDArray[np.intp], end: Array, length: Array) -> Task:
        """Return what a step of the points `ids` has to meet."""
        leg = Leg(*(part[ids] for part in self.leg))
        course = self.course or (lambda fraction: fraction[:, None] * leg.value)
        last = walk.last[ids]
        direction = last / np.maximum(norm(last), np.finfo(float).tiny)[:, None]
        longest = np.where(norm(last) > 0.0, np.maximum(REACH * norm(last), LEAST), FIRST)
        return Task(leg, course, walk.origin[ids], end, walk.led[ids], direction, length, longest)


def _put(array: Array, ids: NDArray[np.intp], values: Array) -> Array:
    """Return a copy with new values of some points."""
    array = array.copy()
    array[ids] = values
    return array


def step(way: Way, walk: Walk, ids: NDArray[np.intp], fraction: float) -> None:
    """Take one step with the points `ids`, not beyond `fraction`: those that fail try less of it next time."""
    led = walk.led[ids]
    end = walk.reached[ids] + walk.size[ids]
    end = np.where(led, walk.reached[ids], np.where(end > fraction * (1.0 - 1e-9), fraction, end))
    found, share = _made(way, walk, ids, end)
    overshot = led & (found.fraction > 1.0)
    met = (found.iterations > 0) & (share <= 1.0) & ~overshot
    _accept(
        way,
        walk,
        ids[met],
        Found(*(of(part, met) if k == 0 else part[met] for k, part in enumerate(found))),
        share[met],
    )
    _retreat(way, walk, ids[~met], end[~met], share[~met], found.status[~met])
    arrived = ids[overshot]  # the fraction has risen to the end of the leg: it is met exactly
    walk.led[arrived], walk.size[arrived] = False, 1.0


def _made(way: Way, walk: Walk, ids: NDArray[np.intp], end: Array) -> tuple[Found, Array]:
    """Return the step, in halves where errors are asked for, and its error over the admitted one (n,)."""
    control = way.controls
    old, strain, tangent = of(walk.state, ids), walk.strain[ids], walk.tangent[ids]
    newton = (control.tolerance, control.max_iterations)
    task = way.task(walk, ids, end, walk.length[ids])
    whole = solve(way.material, way.directions, old, strain, tangent, task, *newton)
    walk.work[ids] += whole.work
    if not control.error:
        return whole, np.zeros(len(ids))
    half = task._replace(end=np.where(task.led, task.end, 0.5 * (walk.reached[ids] + end)), length=0.5 * task.length)
    first = solve(way.material, way.directions, old, strain, tangent, half, *newton)
    rest = task.length - dot(task.direction, first.increment)
    half = task._replace(end=np.where(task.led, first.fraction, end), length=rest)
    second = solve(
        way.material,
        way.directions,
        first.state,
        strain + first.increment,
        first.tangent,
        half,
        *newton,
    )
    walk.work[ids] += first.work + second.work
    together = second._replace(
        increment=first.increment + second.increment,
        iterations=np.where(first.iterations > 0, np.minimum(whole.iterations, second.iterations), 0),
    )
    return together, _difference(whole, together, strain) / control.error


def _difference(whole: Found, halves: Found, strain: Array) -> Array:
    """Return how much a step and its halves differ (n,): in stress and in the strain of the leg, relative to them."""
    tiny = np.finfo(float).tiny
    with np.errstate(invalid="ignore", over="ignore"):
        stress = norm(whole.state.stress - halves.state.stress) / np.maximum(norm(halves.state.stress), tiny)
        gone = np.maximum(norm(strain + halves.increment), norm(halves.increment))
        return np.maximum(stress, norm(whole.increment - halves.increment) / np.maximum(gone, tiny))


def _accept(way: Way, walk: Walk, ids: NDArray[np.intp], found: Found, share: Array) -> None:
    """Move the points `ids` and choose their next step."""
    control = way.controls
    walk.state = type(walk.state)(*(_put(a, ids, b) for a, b in zip(walk.state, found.state, strict=True)))
    walk.strain[ids] += found.increment
    walk.tangent[ids] = found.tangent
    walk.error[ids] += share * control.error
    taken = np.abs(found.fraction - walk.reached[ids])
    walk.reached[ids], walk.last[ids] = found.fraction, found.increment
    walk.steps[ids] += 1
    easy = (found.iterations <= control.easy) & (share < 0.3)
    led = walk.led[ids]
    grown = np.where(easy, np.maximum(walk.size[ids], control.growth * taken), taken)
    walk.size[ids] = np.where(led, walk.size[ids], np.minimum(grown, control.largest))
    longest = control.beyond / way.records if control.beyond else np.inf
    longer = np.where(easy, control.growth, 1.0) * walk.length[ids]
    walk.length[ids] = np.where(led, np.minimum(longer, longest), norm(found.increment))
    _end(way, walk, ids)


def _end(way: Way, walk: Walk, ids: NDArray[np.intp]) -> None:
    """Say which of the points `ids` have arrived, or gone as far as strain may lead them."""
    sheared = np.sqrt(2.0 / 3.0) * norm(deviator(walk.strain[ids]))
    far = walk.led[ids] & ((sheared >= way.controls.beyond) | (walk.reached[ids] <= 0.0))
    walk.ended[ids[far]] = BEYOND
    walk.ended[ids[walk.reached[ids] >= 1.0]] = DONE
    if way.watch is not None and ids.size:
        walk.ended[ids[way.watch(of(walk.state, ids))]] = WATCHED


def _retreat(way: Way, walk: Walk, ids: NDArray[np.intp], end: Array, share: Array, code: NDArray[np.int8]) -> None:
    """Shorten the next step of the points `ids`; below the smallest, strain takes the lead or the point stops."""
    control, led = way.controls, walk.led[ids]
    less = np.where(share > 1.0, np.clip(0.9 / np.sqrt(np.maximum(share, 1.0)), 0.2, 0.8), 0.5)
    walk.code[ids] = code
    walk.size[ids] = np.where(led, walk.size[ids], less * (end - walk.reached[ids]))
    walk.length[ids] = np.where(led, less * walk.length[ids], walk.length[ids])
    turns = ~led & (walk.size[ids] < control.turning) & (control.beyond > 0.0) & (norm(walk.last[ids]) > 0.0)
    walk.led[ids[turns]] = True
    lost = np.where(led, walk.length[ids] < control.smallest * control.beyond, walk.size[ids] < control.smallest)
    walk.ended[ids[lost & ~turns]] = REFUSED
