"""Element tests: one stress point, or many, led along a path by six linear conditions.

A `Leg` (see `legs`) holds six conditions on the stress and the strain since its start, S Δσ + E Δε = v. They are met
at the fractions t of the leg, S Δσ + E Δε = t v, by Newton's method on the strain with the tangent of the point, so a
path is as accurate as `umat.update` and drifts from no condition. Each point takes its own steps: halved where it
refuses them, grown where they are easy, cut at the fractions that are recorded. Compression is positive.

*Accuracy.* Within a step the strain is straight, whatever the conditions. With `Controls.error` a step is also made in
two halves; the halves are kept, and stress and strain of the whole step may differ from theirs by so much.

*Limit points.* Where stress control cannot go on, at the peak, a point with `Controls.beyond` is led by its strain: the
step has a given length along the last strain increment and the fraction t is an unknown, which falls behind the peak.
Should it rise to the end of the leg after all, the leg is done.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .legs import (
    Leg,
    biaxial,
    component,
    constant_p,
    fixed_axes,
    isotropic,
    one_dimensional,
    principal_dyads,
    simple_shear,
    strained,
    stress_direction,
    stressed,
    triaxial,
    undrained,
)
from .mandel import Array, norm
from .step import Course
from .walk import BEYOND, DONE, REFUSED, RUNNING, WATCHED, Controls, Moment, Walk, Watch, Way, step

__all__ = [
    "BEYOND",
    "DONE",
    "REFUSED",
    "RUNNING",
    "WATCHED",
    "Controls",
    "History",
    "Leg",
    "Moment",
    "biaxial",
    "component",
    "constant_p",
    "fixed_axes",
    "follow",
    "isotropic",
    "march",
    "one_dimensional",
    "principal_dyads",
    "simple_shear",
    "strained",
    "stress_direction",
    "stressed",
    "triaxial",
    "undrained",
]


class History(NamedTuple):
    """What n points went through; the first of m + 1 records is the start. NaN after a point stopped."""

    fraction: Array
    """(m + 1,) of the leg."""
    stress: Array
    """(m + 1, n, 6) stress."""
    strain: Array
    """(m + 1, n, 6) strain since the start of the leg [-]."""
    void_ratio: Array
    """(m + 1, n) void ratio (e) [-]; NaN for materials without."""
    fabric: Array
    """(m + 1, n, 6) fabric anisotropy tensor (F) [-]; NaN for materials without."""
    state: Any
    """The state at the end, or where a point stopped."""
    reached: Array
    """(n,) fraction of the leg that was reached; 1 is all of it."""
    steps: NDArray[np.int64]
    """(n,) steps taken."""
    work: NDArray[np.int64]
    """(n,) evaluations of the material."""


def march(
    material: Any,
    directions: Any,
    state: Any,
    leg: Leg,
    records: int = 100,
    controls: Controls | None = None,
    course: Course | None = None,
    watch: Watch | None = None,
) -> Iterator[Moment]:
    """Yield the `Moment` at the start of a leg and at each of `records` equal fractions, until every point has ended.

    A point that is led by its strain is recorded after each of its steps, and before it within long strains.

    Parameters
    ----------
    material, directions, state
        As for `umat.update`; the state is left untouched.
    leg : Leg
        Conditions, for all points or for each.
    records : int
        Equal fractions that are recorded.
    controls : Controls, optional
        How the leg is followed.
    course : callable, optional
        What the conditions add up to, (n, 6), at fractions (n,), instead of t v.
    watch : callable, optional
        Says which points of a new state stop there.
    """
    controls = controls or Controls()
    if records < 1:
        raise ValueError(f"a history needs at least one record, got {records}")
    way = Way(material, directions, _checked(leg, len(state.stress)), course, controls, records, watch)
    walk = Walk(material, state, min(1.0 / records, controls.largest))
    yield walk.moment()
    record, before = 1, walk.moment()
    while (walk.ended == RUNNING).any():
        fraction = min(record / records, 1.0)
        while (ids := _behind(way, walk, fraction, before)).size:
            step(way, walk, ids, fraction)
        before = walk.moment()
        record += not ((walk.ended == RUNNING) & ~walk.led & (walk.reached < fraction)).any()
        yield before


def _behind(way: Way, walk: Walk, fraction: float, before: Moment) -> NDArray[np.intp]:
    """Return the points that go on before the next record.

    They go to its fraction, or by one step where strain leads or soon will: by a long step of the strain that it may
    lead, without which the curve would have no records near its peak.
    """
    longest = way.controls.beyond / way.records if way.controls.beyond else np.inf
    driven = ((norm(way.leg.on_stress) > 0.0) & (way.leg.value != 0.0)).any(axis=1)
    near = ~driven | (norm(walk.strain - before.strain) < longest)
    waiting = np.where(walk.led, walk.steps == before.steps, (walk.reached < fraction) & near)
    return np.flatnonzero((walk.ended == RUNNING) & waiting)


def follow(
    material: Any,
    directions: Any,
    state: Any,
    leg: Leg,
    records: int = 100,
    controls: Controls | None = None,
    course: Course | None = None,
) -> History:
    """Return the `History` of the points of `state` along a leg, recorded at `records` equal fractions.

    A point ends where stress control does: `Controls.beyond` is for `march`.
    """
    controls = (controls or Controls())._replace(beyond=0.0)
    moments = list(march(material, directions, state, leg, records, controls, course))
    end = moments[-1]
    seen = [_seen(moment) for moment in moments]
    seen += [tuple(np.full_like(array, np.nan) for array in seen[-1])] * (records + 1 - len(seen))
    stress, strain, void_ratio, fabric = (np.array(column) for column in zip(*seen, strict=True))
    fractions = np.arange(records + 1) / records
    return History(fractions, stress, strain, void_ratio, fabric, end.state, end.fraction, end.steps, end.work)


def _checked(leg: Leg, n: int) -> Leg:
    """Return the leg of each point; ValueError if conditions are not six of six numbers."""
    shapes = ((n, 6, 6), (n, 6, 6), (n, 6))
    try:
        return Leg(*(np.broadcast_to(np.asarray(a, float), shape) for a, shape in zip(leg, shapes, strict=True)))
    except ValueError:
        got = ", ".join(str(np.shape(a)) for a in leg)
        raise ValueError(
            f"a leg has six conditions, (6, 6), (6, 6) and (6,), for all or each of {n} points; got {got}"
        ) from None


def _seen(moment: Moment) -> tuple[Array, ...]:
    """Return stress, strain, void ratio and fabric now; NaN where a point has stopped or the material has none."""
    n, state = len(moment.fraction), moment.state
    values = (state.stress, moment.strain, getattr(state, "void_ratio", None), getattr(state, "fabric", None))
    shapes = (n, 6), (n, 6), (n,), (n, 6)
    seen = tuple(np.full(shape, np.nan) if a is None else np.array(a) for a, shape in zip(values, shapes, strict=True))
    for array in seen:
        array[moment.ended == REFUSED] = np.nan
    return seen
