"""What ails a stiffness matrix: its condition, the growth of its pivots, and the motion that it does not resist.

The condition is ‖K‖₁ ‖K⁻¹‖₁, the second norm estimated from solves [Hager 1984; Higham 1988]; the matrix is scaled to a
unit diagonal first, so that soft zones beside stiff ones, or other units of pressure, do not count.
The growth of the pivots is the largest entry of U over that of K [Golub & Van Loan §3.4].

A singular stiffness has a motion without force. Inverse iteration finds it, and what it is says what is missing: any
stiffness (a zone whose tangent is zero), supports (a motion without strain), or strength (a mechanism).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import splu

from fabfem.fem.linear import norm
from fabfem.fem.ranks import ALONE, Alone
from fabfem.fem.trial import System

SHIFT = 1e-15
"""What is added to the unit diagonal so that a singular matrix can be factored."""
SINGULAR = 1e-14
"""Resistance of a motion, over that of the diagonal, below which there is none but round-off."""
POOR = 1e-9
"""Resistance below which a solution loses more digits than an equilibrium can spare."""
NOTHING = 1e-14
"""Diagonal entry over the stiffest below which a dof has no stiffness."""
UNSTRAINED = 1e-6
"""Strain times the size of the body over displacement below which a motion is rigid."""
CLIMB = 5
"""Columns of an inverse that are looked at for its norm, at most."""


class Condition(NamedTuple):
    """The state of a stiffness matrix."""

    number: float
    """Condition number, infinite where the matrix is singular."""
    growth: float
    """Growth of the pivots; infinite where the matrix is singular, no number where the solver keeps them to itself."""


def condition(matrix: csr_matrix) -> Condition:
    """The condition of a square matrix, scaled to a unit diagonal."""
    scaled, _ = _scaled(matrix)
    try:
        factors = splu(csc_matrix(scaled))
    except RuntimeError:
        return Condition(np.inf, np.inf)
    inverse = inverse_norm(factors.solve, lambda rhs: factors.solve(rhs, trans="T"), scaled.shape[0])
    number = abs(scaled).sum(axis=0).max() * inverse
    growth = abs(factors.U).max() / abs(scaled).max()
    return Condition(float(number), float(growth)) if np.isfinite(number) else Condition(np.inf, np.inf)


def inverse_norm(
    solve: Callable[[np.ndarray], np.ndarray],
    transposed: Callable[[np.ndarray], np.ndarray],
    n: int,
    ranks: Alone = ALONE,
    first: int = 0,
) -> float:
    """An estimate of ‖A⁻¹‖₁, a lower bound that is nearly always the norm, from solves with A and Aᵀ.

    On many ranks each has `n` rows that follow one another from `first` on, and vectors are of these. The estimate goes
    uphill from one column of A⁻¹ to another; a vector of alternating signs catches what it misses [Higham 1988].
    """
    total, rows = ranks.sum(n), first + np.arange(n)
    trial, signs, found = np.full(n, 1.0 / total), np.zeros(n), 0.0
    for _ in range(CLIMB):
        answer = solve(trial)
        size, new = ranks.sum(float(np.abs(answer).sum())), np.where(answer < 0.0, -1.0, 1.0)
        uphill, turned = size > found, ranks.largest(int((new != signs).any()))
        found, signs = max(found, size), new
        if not (uphill and turned):
            break
        slope = transposed(signs)
        steepest = ranks.largest(float(np.abs(slope).max(initial=0.0)))
        if not steepest > ranks.sum(float(slope @ trial)):
            break
        trial = (rows == ranks.least(int(rows[np.abs(slope) == steepest].min(initial=total)))).astype(float)
    waves = np.where(rows % 2, -1.0, 1.0) * (1.0 + rows / max(total - 1, 1))
    return max(found, 2.0 * ranks.sum(float(np.abs(solve(waves)).sum())) / (3.0 * total))


def singularity(system: System, matrix: csr_matrix) -> str:
    """What ails a reduced stiffness matrix that is singular, or nearly so; empty where it is not, or not finite."""
    if not np.isfinite(matrix.data).all():
        return ""
    idle = _idle(system, matrix)
    if idle:
        return f"the stiffness matrix is singular: {idle}"
    motion, resistance = _weakest(matrix)
    if resistance > POOR:
        return ""
    if resistance > SINGULAR:
        zone = _zone(system, system.constraints.spread(motion))
        return (
            f"the stiffness matrix is ill conditioned: a motion of zone '{zone}' meets {resistance:.0e} of the usual "
            "resistance, from a contrast of stiffness, flat elements, or a volume that can hardly change"
        )
    return f"the stiffness matrix is singular: {_named(system, system.constraints.spread(motion))}"


def _idle(system: System, matrix: csr_matrix) -> str:
    """The zone of dofs that have no stiffness at all."""
    diagonal = np.zeros(system.space.ndof)
    free = system.constraints.free
    diagonal[free] = np.abs(matrix.diagonal()[: len(free)])
    weak = np.zeros(system.space.ndof, bool)
    weak[free] = diagonal[free] <= NOTHING * system.stiffest
    if system.water is not None:
        weak[system.water.nmotion :] = False
    if not weak.any() or diagonal[free].max() == 0.0:
        return "nothing has any stiffness" if weak.any() else ""
    return f"zone '{_zone(system, weak.astype(float))}' has no stiffness"


def _weakest(matrix: csr_matrix) -> tuple[np.ndarray, float]:
    """The motion that a matrix resists least, largest entry one, and its resistance over that of the diagonal."""
    scaled, scale = _scaled(matrix)
    factors = splu(csc_matrix(scaled + SHIFT * identity(len(scale))))
    motion = np.random.default_rng(0).normal(size=len(scale))
    for _ in range(4):
        motion = factors.solve(motion)
        motion /= norm(motion)
    resistance = norm(scaled @ motion)
    motion = motion * scale
    return motion / np.abs(motion).max(), resistance


def _named(system: System, motion: np.ndarray) -> str:
    """What a motion (ndof,) without force is."""
    space = system.space
    if system.water is not None and np.abs(motion[: system.water.nmotion]).max() < 1e-9:
        return "the pore pressure is not determined; nothing holds it and water is incompressible"
    size = float(np.ptp(space.mesh.points, axis=0).max())
    strain = np.abs(space.strain(motion)).max(axis=1)
    if strain.max() * size < UNSTRAINED * np.abs(motion).max():
        return f"zone '{_zone(system, motion)}' can move without strain; hold more components"
    x = ", ".join(f"{value:.4g}" for value in space.points[strain.argmax()])
    return f"a mechanism: zone '{_zone(system, motion)}' can deform without resistance, most at ({x})"


def _zone(system: System, motion: np.ndarray) -> str:
    """The zone that moves most."""
    elements = np.square(motion[system.space.dofs]).sum(axis=1)
    zones = system.space.mesh.zones
    return max(zones, key=lambda name: elements[zones[name]].mean())


def _scaled(matrix: csr_matrix) -> tuple[csr_matrix, np.ndarray]:
    """S K S with a diagonal of ones, and the diagonal of S."""
    size = np.sqrt(np.maximum(np.abs(matrix.diagonal()), np.finfo(float).tiny))
    rows = np.sqrt(abs(matrix).max(axis=1).toarray().ravel())
    scale = 1.0 / np.where(size > 1e-8 * rows, size, np.where(rows > 0.0, rows, 1.0))
    return csr_matrix(diags(scale) @ matrix @ diags(scale)), scale
