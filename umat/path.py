"""Element tests: one stress point, or many, led along a path by six linear conditions.

A `Leg` holds six conditions on the stress and the strain since its start, S Δσ + E Δε = v. They are met at the
fractions t of the leg, S Δσ + E Δε = t v, by Newton's method on the strain with the tangent of the point, so a path is
as accurate as `umat.update` and drifts from no condition. Each point takes its own steps: halved where it refuses them,
grown where they are easy, cut at the fractions that are recorded. Compression is positive.

The presets return legs. Axes: `vertical` and `horizontal` span the plane in which principal axes are turned by α from
the vertical; the third axis is that of the intermediate principal stress, b = (σ2 − σ3)/(σ1 − σ3).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .directions import AXES, Axis
from .interface import Response, elastic_tangent, update
from .mandel import IDENTITY, Array, deviator, from_tensor, norm
from .status import OK

UNDETERMINED = 1e-11


class Leg(NamedTuple):
    """Six conditions S Δσ + E Δε = v, for all points (6, 6) or for each (n, 6, 6)."""

    on_stress: Array
    """(6, 6) coefficients of the stress (S) [-]."""
    on_strain: Array
    """(6, 6) coefficients of the strain (E); where S is not zero [stress], else [-]."""
    value: Array
    """(6,) what they add up to at the end of the leg (v)."""


class Controls(NamedTuple):
    """How a leg is followed; sizes are fractions of the leg."""

    tolerance: float = 1e-9  #: on a condition, relative to the stress and to the step's strain [-]
    largest: float = 1.0  #: step
    smallest: float = 1e-7  #: step below which a point stops
    max_iterations: int = 12  #: Newton's, of a step
    easy: int = 4  #: iterations up to which the next step is larger
    growth: float = 1.5  #: of an easy step


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


class _Walk:
    """The points under way: what changes from step to step."""

    def __init__(self, material: Any, state: Any, size: float) -> None:
        n = len(state.stress)
        self.state, self.strain, self.origin = state, np.zeros((n, 6)), state.stress.copy()
        self.tangent = np.array(elastic_tangent(material, state))
        self.reached, self.size = np.zeros(n), np.full(n, size)
        self.stopped = np.zeros(n, bool)
        self.steps, self.work = np.zeros(n, np.int64), np.zeros(n, np.int64)


def follow(
    material: Any, directions: Any, state: Any, leg: Leg, records: int = 100, controls: Controls | None = None
) -> History:
    """Return the `History` of the points of `state` along a leg, recorded at `records` equal fractions."""
    controls = controls or Controls()
    if records < 1:
        raise ValueError(f"a history needs at least one record, got {records}")
    leg = _checked(leg, len(state.stress))
    fractions = np.arange(records + 1) / records
    walk = _Walk(material, state, min(1.0 / records, controls.largest))
    seen = [_seen(walk)]
    for fraction in fractions[1:]:
        while (ids := np.flatnonzero(~walk.stopped & (walk.reached < fraction))).size:
            _step(material, directions, walk, ids, leg, fraction, controls)
        seen.append(_seen(walk))
    stress, strain, void_ratio, fabric = (np.array(column) for column in zip(*seen, strict=True))
    return History(fractions, stress, strain, void_ratio, fabric, walk.state, walk.reached, walk.steps, walk.work)


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


def _seen(walk: _Walk) -> tuple[Array, ...]:
    """Return stress, strain, void ratio and fabric now; NaN where a point has stopped or the material has none."""
    n = len(walk.reached)
    values = (
        walk.state.stress,
        walk.strain,
        getattr(walk.state, "void_ratio", None),
        getattr(walk.state, "fabric", None),
    )
    shapes = (n, 6), (n, 6), (n,), (n, 6)
    seen = tuple(np.full(shape, np.nan) if a is None else np.array(a) for a, shape in zip(values, shapes, strict=True))
    for array in seen:
        array[walk.stopped] = np.nan
    return seen


def _of(state: Any, ids: NDArray[np.intp]) -> Any:
    """Return the state of some points."""
    return type(state)(*(array[ids] for array in state))


def _step(
    material: Any, directions: Any, walk: _Walk, ids: NDArray[np.intp], leg: Leg, fraction: float, controls: Controls
) -> None:
    """Take one step with the points `ids`, not beyond `fraction`: those that fail try half of it next time."""
    end = walk.reached[ids] + walk.size[ids]
    end = np.where(end > fraction * (1.0 - 1e-9), fraction, end)
    old, strain = _of(walk.state, ids), walk.strain[ids]
    own = Leg(
        leg.on_stress[ids],
        leg.on_strain[ids],
        end[:, None] * leg.value[ids] + _apply(leg.on_stress[ids], walk.origin[ids]),
    )
    response, increment, iterations, work = _newton(material, directions, old, strain, walk.tangent[ids], own, controls)
    walk.work[ids] += work
    met = iterations > 0
    done, failed = ids[met], ids[~met]
    walk.state = type(walk.state)(*(_put(a, done, b[met]) for a, b in zip(walk.state, response.state, strict=True)))
    walk.strain[done] += increment[met]
    walk.tangent[done] = response.tangent[met]
    taken = end[met] - walk.reached[done]
    walk.reached[done] = end[met]
    walk.steps[done] += 1
    grown = np.where(iterations[met] <= controls.easy, np.maximum(walk.size[done], controls.growth * taken), taken)
    walk.size[done] = np.minimum(grown, controls.largest)
    walk.size[failed] = 0.5 * (end[~met] - walk.reached[failed])
    walk.stopped[failed] = walk.size[failed] < controls.smallest


def _put(array: Array, ids: NDArray[np.intp], values: Array) -> Array:
    """Return a copy with new values of some points."""
    array = array.copy()
    array[ids] = values
    return array


def _apply(matrix: Array, vector: Array) -> Array:
    return np.einsum("nij,nj->ni", matrix, vector)


def _newton(
    material: Any, directions: Any, old: Any, strain: Array, tangent: Array, leg: Leg, controls: Controls
) -> tuple[Response, Array, NDArray[np.int64], NDArray[np.int64]]:
    """Return response and strain increment of the step, the iterations it took (0: not found) and the evaluations.

    `leg.value` is what S σ + E ε must be at its end. A correction that the material refuses is halved.
    """
    n = len(strain)
    increment, iterations, work = np.zeros((n, 6)), np.zeros(n, np.int64), np.zeros(n, np.int64)
    correction = _solve(leg, tangent, leg.value - _apply(leg.on_stress, old.stress) - _apply(leg.on_strain, strain))
    for iteration in range(1, controls.max_iterations + 1):
        trial = increment + correction
        response = update(material, directions, trial, old)
        work += response.work
        good = response.status == OK
        increment[good] = trial[good]
        missing = leg.value - _apply(leg.on_stress, response.stress) - _apply(leg.on_strain, strain + trial)
        met = good & np.all(abs(missing) <= controls.tolerance * _scale(leg, response, old, trial), axis=1)
        iterations[met & (iterations == 0)] = iteration
        iterations[~met] = 0
        if met.all():
            break
        newer = _solve(leg, response.tangent, missing)
        correction = np.where(good[:, None], newer, 0.5 * correction)
        correction[met] = 0.0
    return response, increment, iterations, work


def _scale(leg: Leg, response: Response, old: Any, increment: Array) -> Array:
    """Return the size (n, 6) of each condition's terms in the step."""
    stress = norm(response.stress) + norm(old.stress)
    return norm(leg.on_stress) * stress[:, None] + norm(leg.on_strain) * norm(increment)[:, None]


def _solve(leg: Leg, tangent: Array, missing: Array) -> Array:
    """Return the least strain (n, 6) that makes up for what is missing, along the tangent.

    At a corner of a perfectly plastic yield surface the conditions leave a part of the strain open; it stays zero.
    """
    matrix = leg.on_stress @ tangent + leg.on_strain
    size = norm(leg.on_stress) * np.linalg.norm(tangent, axis=(1, 2))[:, None] + norm(leg.on_strain)
    scale = 1.0 / np.maximum(size, np.finfo(float).tiny)
    good = np.isfinite(np.linalg.norm(matrix, axis=(1, 2)))
    matrix = np.where(good[:, None, None], matrix * scale[..., None], 0.0)
    inverse = np.asarray(np.linalg.pinv(matrix, rcond=UNDETERMINED), dtype=float)
    return _apply(inverse, missing * scale)


# --- presets --------------------------------------------------------------------------------------------------------


def strained(strain: ArrayLike) -> Leg:
    """Return the leg of a given strain (6,) or (n, 6) [-]."""
    return Leg(np.zeros((6, 6)), np.eye(6), np.asarray(strain, float))


def stressed(change: ArrayLike) -> Leg:
    """Return the leg of a given change of stress (6,) or (n, 6); it ends where the material can carry no more."""
    return Leg(np.eye(6), np.zeros((6, 6)), np.asarray(change, float))


def isotropic(change: float) -> Leg:
    """Return isotropic compression: the change of the mean pressure (p), Δσ = Δp I."""
    return stressed(change * IDENTITY)


def triaxial(strain: float, vertical: Axis = "z") -> Leg:
    """Return drained triaxial compression to an axial strain [-], extension if negative: Δσ3 = 0, no shear stress."""
    axis = AXES.index(vertical)
    on_stress, on_strain = np.eye(6), np.zeros((6, 6))
    on_stress[axis], on_strain[axis, axis] = 0.0, 1.0
    return Leg(on_stress, on_strain, strain * on_strain[axis])


def undrained(strain: float, alpha: float = 0.0, b: float = 0.0, vertical: Axis = "z", horizontal: Axis = "x") -> Leg:
    """Return shear at constant volume to ε1 − ε3 [-] along principal stress axes held at α [deg], with b held.

    The total mean stress is not asked for: constant volume decides the effective one. α = 0, b = 0 is triaxial
    compression, α = 90°, b = 1 extension. The stress at the start must have these axes and b, or be isotropic.
    """
    return _fixed_axes(strain, alpha, b, vertical, horizontal, drained=False)


def constant_p(strain: float, alpha: float = 0.0, b: float = 0.0, vertical: Axis = "z", horizontal: Axis = "x") -> Leg:
    """Return drained shear at constant mean pressure to ε1 − ε3 [-], axes and b held as in `undrained`."""
    return _fixed_axes(strain, alpha, b, vertical, horizontal, drained=True)


def principal_dyads(alpha: float, vertical: Axis = "z", horizontal: Axis = "x") -> Array:
    """Return the dyads (3, 6) of the axes of σ1, σ2, σ3; that of σ1 turns by α [deg] from vertical to horizontal."""
    if vertical == horizontal:
        raise ValueError(f"vertical and horizontal are both {vertical}")
    up, across = np.eye(3)[AXES.index(vertical)], np.eye(3)[AXES.index(horizontal)]
    c, s = np.cos(np.radians(alpha)), np.sin(np.radians(alpha))
    axes = np.array([c * up + s * across, np.cross(up, across), c * across - s * up])
    return from_tensor(axes[:, :, None] * axes[:, None, :])


def stress_direction(alpha: float, b: float, vertical: Axis = "z", horizontal: Axis = "x") -> Array:
    """Return the unit deviator (6,) of stresses σ1 : σ2 : σ3 with b = (σ2 − σ3)/(σ1 − σ3) and axes at α [deg]."""
    first, second, _ = principal_dyads(alpha, vertical, horizontal)
    direction = deviator(first + b * second)
    return direction / norm(direction)


def _fixed_axes(strain: float, alpha: float, b: float, vertical: Axis, horizontal: Axis, drained: bool) -> Leg:
    """Return four conditions that keep the stress in span{I, n(α, b)}, one on p or on the volume, one that drives."""
    kept = np.array([IDENTITY / np.sqrt(3.0), stress_direction(alpha, b, vertical, horizontal)])
    first, _, third = principal_dyads(alpha, vertical, horizontal)
    on_stress, on_strain = np.zeros((6, 6)), np.zeros((6, 6))
    on_stress[:4] = np.linalg.svd(kept)[2][2:]
    (on_stress if drained else on_strain)[4] = IDENTITY
    on_strain[5] = first - third
    return Leg(on_stress, on_strain, np.array([0.0, 0.0, 0.0, 0.0, 0.0, strain]))
