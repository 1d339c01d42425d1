"""What ails a stiffness matrix: its condition, the growth of its pivots, and the motion that it does not resist.

The condition is ‖K‖₁ ‖K⁻¹‖₁, the second norm estimated from solves [Higham & Tisseur 2000]; the matrix is scaled to a
unit diagonal first, so that soft zones beside stiff ones, or other units of pressure, do not count.
The growth of the pivots is the largest entry of U over that of K [Golub & Van Loan §3.4].

A singular stiffness has a motion without force. Inverse iteration finds it, and what it is says what is missing: any
stiffness (a zone whose tangent is zero), supports (a motion without strain), or strength (a mechanism).
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import LinearOperator, SuperLU, onenormest, splu

from fabfem.fem.linear import norm
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


class Condition(NamedTuple):
    """The state of a stiffness matrix."""

    number: float
    """Condition number, infinite where the matrix is singular."""
    growth: float
    """Growth of the pivots; infinite where the matrix is singular."""


def condition(matrix: csr_matrix) -> Condition:
    """The condition of a square matrix, scaled to a unit diagonal."""
    scaled, _ = _scaled(matrix)
    try:
        factors = splu(csc_matrix(scaled))
    except RuntimeError:
        return Condition(np.inf, np.inf)
    n = scaled.shape[0]
    inverse = LinearOperator(
        (n, n), matvec=factors.solve, rmatvec=lambda rhs: factors.solve(rhs, trans="T"), dtype=float
    )
    number = abs(scaled).sum(axis=0).max() * (onenormest(inverse) if n > 4 else _exact(factors, n))
    growth = abs(factors.U).max() / abs(scaled).max()
    return Condition(float(number), float(growth)) if np.isfinite(number) else Condition(np.inf, np.inf)


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


def _exact(factors: SuperLU, n: int) -> float:
    """‖K⁻¹‖₁ of a matrix too small for the estimate."""
    return float(np.abs(factors.solve(np.eye(n))).sum(axis=0).max())
