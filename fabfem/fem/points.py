"""The batch of all points: what their materials answer to a strain increment, and how stiff they are.

A refusal is a value that names the first point that refused. Everything works on the points of a space, be it the whole
one or one rank's.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from fabfem.fem.model import States, Zone
from fabfem.fem.space import Space
from umat import elastic_tangent, update
from umat.interface import Response
from umat.status import message


class Refused(NamedTuple):
    """A point that its material refused, with all that its answer depends on."""

    zone: str
    point: int
    material: Any
    directions: Any
    state: Any
    """State of one point, before."""
    strain_increment: np.ndarray
    """(1, 6)"""
    status: int


class Refusal(NamedTuple):
    """Why something could not be done, and at which point (-1: no point in particular)."""

    reason: str
    point: int = -1
    refused: Refused | None = None
    """The point alone, where a material refused it."""


class Batch(NamedTuple):
    """Answer of all points."""

    stress: np.ndarray
    """(npoints, 6)"""
    tangent: np.ndarray
    """(npoints, k, k) between the components that the kinematics can strain."""
    states: States
    worst_point: int
    """Point with the largest integration error."""
    worst_error: float
    error: np.ndarray
    """(npoints,) integration error of every point."""
    held: int
    """Points that keep their old stress and state."""


HELD_STIFFNESS = 0.01
"""Tangent of a held point over the elastic one; its stress is constant, so this only steadies the iteration."""


MANY, AT_ONCE = 16384, 4096
"""Points of a zone from which they are not asked all at once, and how many are then: of their tangents (6, 6) only the
part that the kinematics needs is kept. In a small run the allocator would give back what each part took (a tenth
slower)."""


def update_points(
    space: Space, zones: Mapping[str, Zone], strain_increment: np.ndarray, old: States, may_hold: float = 0.0
) -> Batch | Refusal:
    """The answer of all points to a strain increment (npoints, 6), or the first point that refused.

    Points without a zone have no stress and no stiffness; states of other zones are handed on.

    `may_hold` is the share of all points that may refuse and are held instead.
    """
    held, states, tangent, error = 0, dict(old), _no_tangent(space), np.zeros(space.npoints)
    for name, zone in zones.items():
        strain = strain_increment[zone.points]
        states[name], status = _answered(space, zone, strain, old[name], tangent, error)
        refused = np.flatnonzero(status)
        held += len(refused)
        if held > may_hold * space.npoints:
            return _refused(name, zone, strain_increment, old[name], status, refused)
    stress = stress_of(space, zones, states)
    bad = _not_finite(stress, tangent)
    if len(bad):
        return Refusal(f"{len(bad)} points have a stress or tangent that is not finite", int(bad[0]))
    return Batch(stress, tangent, states, int(error.argmax()), float(error.max()), error, held)


def _answered(
    space: Space, zone: Zone, strain: np.ndarray, old: Any, tangent: np.ndarray, error: np.ndarray
) -> tuple[Any, np.ndarray]:
    """New state and status of the points of a zone; their tangent and error are put among those of all points."""
    new, status = type(old)(*(np.empty_like(part) for part in old)), np.zeros(len(strain), np.int8)
    for part, where in _parts(zone.points, len(strain)):
        before = _some(old, part)
        response = update(zone.material, zone.directions, strain[part], before)
        whole, error[where] = _held(zone, before, response)
        tangent[where] = space.kinematics.between(whole)
        status[part] = response.status
        for values, piece in zip(new, response.state, strict=True):
            values[part] = piece
    return new, status


def _held(zone: Zone, old: Any, response: Response) -> tuple[np.ndarray, np.ndarray]:
    """Tangent (n, 6, 6) and error of the points of a response; those that refused are held."""
    refused = response.status != 0
    if not refused.any():
        return response.tangent, response.error
    soft = HELD_STIFFNESS * elastic_tangent(zone.material, old)
    return np.where(refused[:, None, None], soft, response.tangent), np.where(refused, 0.0, response.error)


def _parts(points: slice | np.ndarray, count: int) -> Iterator[tuple[slice, slice | np.ndarray]]:
    """Which points of a zone are asked together, and where they are among all."""
    size = AT_ONCE if count > MANY else max(count, 1)
    for begin in range(0, count, size):
        part = slice(begin, min(begin + size, count))
        if isinstance(points, slice):
            first = points.start or 0
            yield part, slice(first + part.start, first + part.stop)
        else:
            yield part, points[part]


def _some(state: Any, part: slice | np.ndarray) -> Any:
    """The state of some points."""
    return type(state)(*(values[part] for values in state))


def _no_tangent(space: Space) -> np.ndarray:
    k = len(space.kinematics.active)
    return np.zeros((space.npoints, k, k))


def _refused(
    name: str, zone: Zone, strain_increment: np.ndarray, old: Any, status: np.ndarray, refused: np.ndarray
) -> Refusal:
    """The refusal that names the first point of a zone that refused."""
    first = refused[:1]
    points = np.arange(len(strain_increment))[zone.points]
    strain, state = strain_increment[points[first]], _some(old, first)
    point, code = int(points[first[0]]), int(status[first[0]])
    alone = Refused(name, point, zone.material, zone.directions, state, strain, code)
    return Refusal(f"{len(refused)} points of zone '{name}': {message(code)}", point, alone)


def _not_finite(stress: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Points with a stress or tangent that is not finite; a finite sum has finite terms."""
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(stress.sum() + tangent.sum()):
            return np.zeros(0, int)
    return np.flatnonzero(~(np.isfinite(stress).all(axis=1) & np.isfinite(tangent).all(axis=(1, 2))))


def elastic_tangents(space: Space, zones: Mapping[str, Zone], states: States) -> np.ndarray:
    """(npoints, k, k) elastic tangents between active components; zero where there is no zone."""
    tangent = _no_tangent(space)
    for name, zone in zones.items():
        for part, where in _parts(zone.points, len(states[name].stress)):
            elastic = elastic_tangent(zone.material, _some(states[name], part))
            tangent[where] = space.kinematics.between(elastic)
    return tangent


def tangents(space: Space, zones: Mapping[str, Zone], strain_increment: np.ndarray, old: States) -> np.ndarray:
    """(npoints, 6, 6) tangents, for who needs more than the stiffness; the points are asked for them once more."""
    tangent = np.zeros((space.npoints, 6, 6))
    for name, zone in zones.items():
        response = update(zone.material, zone.directions, strain_increment[zone.points], old[name])
        tangent[zone.points], _ = _held(zone, old[name], response)
    return tangent


def stress_of(space: Space, zones: Mapping[str, Zone], states: States) -> np.ndarray:
    """(npoints, 6) stress of the states; zero where there is no zone."""
    if len(zones) == 1:
        ((name, zone),) = zones.items()
        if isinstance(zone.points, slice) and zone.points.indices(space.npoints) == (0, space.npoints, 1):
            return states[name].stress
    stress = np.zeros((space.npoints, 6))
    for name, zone in zones.items():
        stress[zone.points] = states[name].stress
    return stress
