"""One step of a path: Newton's method for strain and fraction, from six conditions and one on the length of the step.

The unknowns are the strain increment Δε and the fraction t of the leg. Six equations are the leg's,
S (σ − σ0) + E ε = v(t); the seventh says how long the step is: t itself is given, or, where stress control cannot go
on, the strain along a direction d, d:Δε = δ. The fraction may then fall, so that limit points are passed. At a corner
of a perfectly plastic yield surface the equations leave a part of the strain open; the least one is taken.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .interface import update
from .legs import Leg
from .mandel import Array, dot, norm
from .status import OK

UNDETERMINED = 1e-11

Course = Callable[[Array], Array]
"""What the six conditions add up to, (n, 6), at fractions (n,) of the leg; for a straight leg t v."""


class Task(NamedTuple):
    """What a step of n points has to meet."""

    leg: Leg
    """Conditions of each point, (n, 6, 6) twice."""
    course: Course
    """Their values by the fraction."""
    origin: Array
    """(n, 6) stress at the start of the leg."""
    end: Array
    """(n,) fraction at the end of the step, or a guess where the strain leads [-]."""
    led: NDArray[np.bool_]
    """(n,) whether the strain leads instead of the fraction."""
    direction: Array
    """(n, 6) direction of the leading strain (d)."""
    length: Array
    """(n,) leading strain (δ) [-]."""
    longest: Array
    """(n,) strain that one correction may add [-]; near a peak the tangent alone asks for far too much."""


class Found(NamedTuple):
    """What a step came to."""

    state: Any
    """State of the material."""
    tangent: Array
    """(n, 6, 6) tangent."""
    status: NDArray[np.int8]
    """(n,) status of the material at the last iteration."""
    increment: Array
    """(n, 6) strain increment [-]."""
    fraction: Array
    """(n,) fraction reached."""
    iterations: NDArray[np.int64]
    """(n,) iterations; 0 where the equations could not be met."""
    work: NDArray[np.int64]
    """(n,) evaluations of the material."""


@np.errstate(all="ignore")  # a trial far off is found not to be finite, and shortened
def solve(
    material: Any, directions: Any, old: Any, strain: Array, tangent: Array, task: Task, tolerance: float, most: int
) -> Found:
    """Return the step from `old` and the strain (n, 6) of the leg so far; a correction the material refuses is halved.

    `tolerance` is on each condition, relative to the stress and to the strain of the step; `most` bounds the
    iterations.
    """
    n = len(strain)
    increment, fraction = np.zeros((n, 6)), task.end.copy()
    iterations, work = np.zeros(n, np.int64), np.zeros(n, np.int64)
    missing = _missing(task, old.stress, strain, fraction)
    change = _corrected(task, tangent, missing, task.length, fraction)
    for iteration in range(1, most + 1):
        trial, share = increment + change[:, :6], fraction + change[:, 6]
        response = update(material, directions, trial, old)
        work += response.work
        good = response.status == OK
        increment[good], fraction[good] = trial[good], share[good]
        missing = _missing(task, response.stress, strain + trial, share)
        scale = _scale(task.leg, norm(response.stress) + norm(old.stress), norm(trial))
        rest = np.where(task.led, task.length - dot(task.direction, trial), 0.0)
        met = good & np.all(abs(missing) <= tolerance * scale, axis=1) & (abs(rest) <= 1e-6 * task.length)
        iterations[met & (iterations == 0)] = iteration
        iterations[~met] = 0
        if met.all():
            break
        newer = _corrected(task, response.tangent, missing, rest, share)
        change = np.where(good[:, None], newer, 0.5 * change)
        change[met] = 0.0
    return Found(response.state, response.tangent, response.status, increment, fraction, iterations, work)


def _missing(task: Task, stress: Array, strain: Array, fraction: Array) -> Array:
    """Return what the conditions lack (n, 6)."""
    there = apply(task.leg.on_stress, stress - task.origin) + apply(task.leg.on_strain, strain)
    return task.course(fraction) - there


def _scale(leg: Leg, stress: Array, strain: Array) -> Array:
    """Return the size (n, 6) of each condition's terms in the step."""
    return norm(leg.on_stress) * stress[:, None] + norm(leg.on_strain) * strain[:, None]


def _corrected(task: Task, tangent: Array, missing: Array, rest: Array, fraction: Array) -> Array:
    """Return the least correction (n, 7) of strain increment and fraction, along the tangent, or as long as it may be.

    rest: (n,) leading strain that is missing.
    """
    n = len(tangent)
    matrix, right = np.zeros((n, 7, 7)), np.zeros((n, 7))
    on_stress, on_strain = task.leg.on_stress, task.leg.on_strain
    size = norm(on_stress) * np.linalg.norm(tangent, axis=(1, 2))[:, None] + norm(on_strain)
    scale = 1.0 / np.where(np.isfinite(size), np.maximum(size, np.finfo(float).tiny), 1.0)
    matrix[:, :6, :6] = (on_stress @ tangent + on_strain) * scale[..., None]
    speed = _speed(task.course, fraction) * scale
    unit = np.maximum(
        norm(speed), np.finfo(float).tiny
    )  # so that the column of the fraction has the size of the others
    matrix[:, :6, 6] = -speed / unit[:, None]
    matrix[:, 6, :6], matrix[:, 6, 6] = np.where(task.led[:, None], task.direction, 0.0), ~task.led
    right[:, :6], right[:, 6] = missing * scale, np.where(task.led, rest, 0.0)
    good = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    matrix[~good] = 0.0
    right[~good] = 0.0
    found = apply(np.asarray(np.linalg.pinv(matrix, rcond=UNDETERMINED), dtype=float), right)
    found[:, 6] = np.where(task.led, found[:, 6] / unit, 0.0)
    return found * np.minimum(1.0, task.longest / np.maximum(norm(found[:, :6]), np.finfo(float).tiny))[:, None]


def _speed(course: Course, fraction: Array) -> Array:
    """Return dv/dt (n, 6)."""
    step = 1e-6
    return (course(fraction + step) - course(fraction - step)) / (2.0 * step)


def of(part: Any, ids: NDArray[np.intp] | NDArray[np.bool_]) -> Any:
    """Return some points of a record of arrays, or of records of them."""
    return part[ids] if isinstance(part, np.ndarray) else type(part)(*(of(array, ids) for array in part))


def apply(matrix: Array, vector: Array) -> Array:
    """Return (n, i) products of (n, i, j) and (n, j)."""
    return np.einsum("nij,nj->ni", matrix, vector)
