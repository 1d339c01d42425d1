"""A fabric law along a given history of stress and strain: how the papers test their laws.

Between two records stress, strain and ψ run straight. `Explicit` integrates dF/dt over each such piece with the
Runge–Kutta pair of Dormand and Prince, in as many sub-steps as the tolerance asks for. `Implicit` takes one backward
Euler step a piece, F_new = F_old + ΔF(F_new, σ_new, ψ_new, Δη, Δε, Δε^p): for `yuan`, which is linear in F, that is
[Y 8.3] to rounding, and first order in the length of the piece like it. F need not be where the law would have it.
"""

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from .fabric.law import INPUTS, SPAN, active_inputs, increments
from .fabric.probe_2d import (
    Probe2D,
    Probe2DByAnisotropy,
    UniformStrain2D,
    anisotropy,
    parameters_at,
    probe_increment,
    uniform_increment,
)
from .lanes import LANES
from .mandel import Array, deviator, p

FABRIC, STRESS, PSI, RATIO, STRAIN, PLASTIC = (slice(*SPAN[name]) for name in SPAN)
NUDGE = 1e-7  #: of F, for the slope of the implicit step


class Given(NamedTuple):
    """What n points went through, at m + 1 records; strains count from any start, compression positive."""

    stress: Array
    """(m + 1, n, 6) stress, any unit."""
    strain: Array
    """(m + 1, n, 6) strain [-]."""
    plastic_strain: Array
    """(m + 1, n, 6) plastic strain [-]."""
    state_parameter: Array
    """(m + 1, n) state parameter (ψ) [-]."""


class Explicit(NamedTuple):
    """Sub-steps with control of the error."""

    tolerance: float = 1e-8  #: of a sub-step: on F, and relative to it [-]


class Implicit(NamedTuple):
    """One backward Euler step from record to record."""

    tolerance: float = 1e-12  #: on the equation of a step [-]
    max_iterations: int = 30  #: of Newton's method


class Evolved(NamedTuple):
    """The fabric at the records; NaN from where it could not go on."""

    fabric: Array
    """(m + 1, n, 6) fabric tensor [-]."""
    reached: int
    """Records that were reached, the start not counted; m is all."""
    reason: str
    """Why it stopped, in a sentence; empty when it did not."""
    work: int
    """Evaluations of the law, each for all points."""


@singledispatch
def increment(law: Any, inputs: Array) -> Array:
    """Return ΔF (n, 6) of any law from inputs (n, 31), laid out as `umat.fabric.law.SPAN` says."""
    out = np.empty((len(inputs), 6))
    for first in range(0, len(inputs), LANES):
        block = inputs[first : first + LANES]
        rows, found = np.zeros((INPUTS, LANES)), np.zeros((6, LANES))
        rows[:, : len(block)] = block.T
        increments(law, rows.reshape(-1), found.reshape(-1))
        out[first : first + LANES] = found[:, : len(block)].T
    return out


@increment.register
def _(law: Probe2D, inputs: Array) -> Array:
    parameters = np.broadcast_to(np.array(law, float), (len(inputs), 5))
    return probe_increment(parameters, inputs[:, STRESS], inputs[:, STRAIN])


@increment.register
def _(law: Probe2DByAnisotropy, inputs: Array) -> Array:
    parameters = parameters_at(anisotropy(inputs[:, FABRIC]))
    return probe_increment(parameters, inputs[:, STRESS], inputs[:, STRAIN])


@increment.register
def _(law: UniformStrain2D, inputs: Array) -> Array:
    return uniform_increment(law.share, inputs[:, FABRIC], inputs[:, STRAIN])


PLANAR = (Probe2D, Probe2DByAnisotropy, UniformStrain2D)
"""Laws of the whole fabric in the plane x, y, with the trace Z."""


def reads(law: Any) -> set[str]:
    """Return which of the inputs in `SPAN` a law reads."""
    if isinstance(law, PLANAR):
        return {"fabric", "stress", "strain"}
    active = set(active_inputs(law))
    return {name for name, (first, _) in SPAN.items() if first in active}


def evolve(law: Any, given: Given, fabric: Array, update: Explicit | Implicit | None = None) -> Evolved:
    """Return the fabric along a history.

    Parameters
    ----------
    law : record
        Any law of `umat.fabric`, one in the plane included.
    given : Given
        What the points go through.
    fabric : (n, 6) or (6,) array
        Fabric at the start (F) [-].
    update : Explicit or Implicit
        How a piece is integrated; explicitly by default.
    """
    update = update or Explicit()
    pieces, n = len(given.stress) - 1, given.stress.shape[1]
    found = np.full((pieces + 1, n, 6), np.nan)
    found[0] = fabric
    work = 0
    for k in range(pieces):
        with np.errstate(all="ignore"):  # a value that is not finite becomes a reason
            new, evaluations = piece(update, law, _Piece.between(given, k), found[k])
        work += evaluations
        if new is None or not np.isfinite(new).all():
            return Evolved(found, k, f"the fabric could not be integrated from record {k} to {k + 1}", work)
        found[k + 1] = new
    return Evolved(found, pieces, "", work)


class _Piece(NamedTuple):
    """A straight piece of the history: its ends, and what drives along it."""

    stress: tuple[Array, Array]
    state_parameter: tuple[Array, Array]
    strain: Array
    plastic: Array

    @classmethod
    def between(cls, given: Given, k: int) -> "_Piece":
        return cls(
            (given.stress[k], given.stress[k + 1]),
            (given.state_parameter[k], given.state_parameter[k + 1]),
            given.strain[k + 1] - given.strain[k],
            given.plastic_strain[k + 1] - given.plastic_strain[k],
        )

    def inputs(self, fabric: Array, at: float, ratio: Array) -> Array:
        """Return the inputs (n, 31) of the law at a fraction of the piece."""
        rows = np.empty((len(fabric), INPUTS))
        rows[:, FABRIC], rows[:, RATIO] = fabric, ratio
        rows[:, STRESS] = (1.0 - at) * self.stress[0] + at * self.stress[1]
        rows[:, PSI.start] = (1.0 - at) * self.state_parameter[0] + at * self.state_parameter[1]
        rows[:, STRAIN], rows[:, PLASTIC] = self.strain, self.plastic
        return rows

    def ratio_rate(self, at: float) -> Array:
        """Return d(s/p)/dt (n, 6) at a fraction of the piece, along which the stress runs straight."""
        stress, change = (1.0 - at) * self.stress[0] + at * self.stress[1], self.stress[1] - self.stress[0]
        return np.asarray((deviator(change) - deviator(stress) * (p(change) / p(stress))[:, None]) / p(stress)[:, None])

    def ratio_change(self) -> Array:
        """Return Δ(s/p) (n, 6) over the piece."""
        old, new = (deviator(stress) / p(stress)[:, None] for stress in self.stress)
        return np.asarray(new - old)


@singledispatch
def piece(update: Any, law: Any, part: _Piece, fabric: Array) -> tuple[Array | None, int]:
    """Return the fabric at the end of a piece (None if it was not found) and the evaluations of the law."""
    raise TypeError(f"{type(update).__name__} is no way to integrate a fabric law")


@piece.register
def _(update: Explicit, law: Any, part: _Piece, fabric: Array) -> tuple[Array | None, int]:
    from scipy.integrate import solve_ivp

    def rate(at: float, flat: Array) -> Array:
        return increment(law, part.inputs(flat.reshape(fabric.shape), at, part.ratio_rate(at))).ravel()

    if not np.isfinite(rate(0.0, fabric.ravel())).all():
        return None, 1
    done = solve_ivp(
        rate, (0.0, 1.0), fabric.ravel(), first_step=1.0, rtol=max(update.tolerance, 1e-12), atol=update.tolerance
    )
    return (done.y[:, -1].reshape(fabric.shape) if done.success else None), int(done.nfev)


@piece.register
def _(update: Implicit, law: Any, part: _Piece, fabric: Array) -> tuple[Array | None, int]:
    """Newton's method; the slope of six components by differences, in one evaluation of all."""
    ratio, new = part.ratio_change(), fabric.copy()

    def missing(trial: Array) -> Array:
        return fabric + increment(law, part.inputs(trial, 1.0, ratio)) - trial

    for iteration in range(1, update.max_iterations + 1):
        gap = missing(new)
        if not np.isfinite(gap).all():
            return None, 7 * iteration
        if np.abs(gap).max() <= update.tolerance * max(1.0, float(np.abs(new).max())):
            return new, 7 * iteration
        slope = np.stack([(missing(new + NUDGE * unit) - gap) / NUDGE for unit in np.eye(6)], axis=-1)
        new = new - np.linalg.solve(slope, gap[..., None])[..., 0]
    return None, 7 * update.max_iterations
