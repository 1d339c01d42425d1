"""The unknowns of a stage: what supports and rigid bodies leave of the dofs.

The nodal displacements of a stage are u = T v + f g: v the unknowns, g the motion over the whole stage, f the part of
the stage that has passed. A free dof is its own unknown. A held dof has none. The tied dofs of a rigid body follow the
body's rigid motions, u = R q, R from `kinematics.modes` about the body's point; what is prescribed of q, and what other
supports hold of the tied dofs, are linear equations for q, whose solutions q = q0 f + N w leave the unknowns w. So a
node on a plane of symmetry needs no special case. Equilibrium is then Tᵀ (load - force) = 0: of the tied dofs only the
resultants conjugate to the free motions of the body are in balance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import block_diag

from fabfem.fem.ranks import ALONE, Alone
from fabfem.fem.space import Space
from fabfem.fem.supports import MOTIONS, RigidBody, Support, body_modes

EXACT = 1e-9
"""Relative size below which a singular value or the misfit of an equation is round-off."""


@dataclass(frozen=True)
class Constraints:
    """The dofs of a stage, u = T v + f g.

    Attributes
    ----------
    free : (m,) array
        Dofs that are unknowns themselves, ascending.
    motion : (ndof,) array
        What the others move over the whole stage (g).
    tied : (k,) array
        Dofs that follow the free motions of rigid bodies, ascending.
    ties : (k, n) array
        How (the part of T that is not the identity).
    """

    free: np.ndarray
    motion: np.ndarray
    tied: np.ndarray
    ties: np.ndarray
    ranks: Alone = ALONE
    own: np.ndarray | slice = field(default_factory=lambda: slice(None))
    """Which tied dofs this rank counts."""

    @property
    def nunknowns(self) -> int:
        """Unknowns, the motions of rigid bodies included, which are last and on every rank."""
        return len(self.free) + self.ties.shape[1]

    def counted(self, space: Space) -> np.ndarray | slice:
        """Which unknowns this rank counts; the first rank counts the motions of rigid bodies."""
        if isinstance(space.counted, slice):
            return space.counted
        return np.concatenate([space.counted[self.free], np.full(self.ties.shape[1], self.ranks.rank == 0)])

    def spread(self, unknowns: np.ndarray) -> np.ndarray:
        """The (ndof,) displacement T v."""
        whole = np.zeros(len(self.motion))
        whole[self.free] = unknowns[: len(self.free)]
        if len(self.tied):
            whole[self.tied] = self.ties @ unknowns[len(self.free) :]
        return whole

    def collect(self, force: np.ndarray) -> np.ndarray:
        """The force Tᵀ f on the unknowns."""
        if not self.ties.shape[1]:
            return force[self.free]
        resultants = self.ranks.sum(self.ties[self.own].T @ force[self.tied][self.own])
        return np.concatenate([force[self.free], resultants])

    def keep_unknown(self, force: np.ndarray) -> np.ndarray:
        """The (ndof,) force without its part on dofs that are no unknowns."""
        kept = np.zeros(len(force))
        for dofs in (self.free, self.tied):
            kept[dofs] = force[dofs]
        return kept


def constrain(
    space: Space, supports: Sequence[Support], bodies: Sequence[RigidBody] = (), absent: np.ndarray | None = None
) -> Constraints:
    """The constraints that `supports`, `bodies` and the dofs without an element, `absent`, make.

    Raises ValueError where they contradict each other or the whole can still move as a rigid body.
    """
    absent = np.zeros(0, int) if absent is None else absent
    moved = _moved(space, supports)
    motion = np.zeros(space.ndof)
    motion[list(moved)] = list(moved.values())
    motion[absent] = 0.0
    follows = [_follow(space, body, moved, absent, motion) for body in bodies]
    tied, ties = _joined(follows)
    fixed = np.concatenate([np.array(list(moved), dtype=int), absent, tied])
    free = np.setdiff1d(np.arange(space.ndof), fixed)
    own = slice(None) if isinstance(space.counted, slice) else space.counted[tied]
    constraints = Constraints(free, motion, tied, ties, space.mesh.ranks, own)
    _refuse_rigid_motion(space, constraints, absent)
    return constraints


def _moved(space: Space, supports: Sequence[Support]) -> dict[int, float]:
    """The held dofs and what each moves."""
    moved: dict[int, float] = {}
    for support in supports:
        for dof in space.dofs_on(support.boundary, support.component).tolist():
            if moved.setdefault(dof, support.displacement) != support.displacement:
                raise ValueError(
                    f"boundary '{support.boundary}' moves {support.component} by {support.displacement:g}, "
                    f"but a node of it is already moved by {moved[dof]:g} by another support."
                )
    return moved


def _joined(follows: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """The tied dofs of all bodies, ascending, and the blocks of how they follow as one array."""
    tied = np.concatenate([np.zeros(0, int), *(dofs for dofs, _ in follows)])
    if len(np.unique(tied)) < len(tied):
        raise ValueError("two rigid bodies share a node; leave a gap between their boundaries.")
    ties = block_diag([part for _, part in follows]).toarray() if follows else np.zeros((0, 0))
    order = np.argsort(tied)
    return tied[order], ties[order]


def _follow(
    space: Space, body: RigidBody, moved: Mapping[int, float], absent: np.ndarray, motion: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The tied dofs of a body that are not held and how they follow its free motions; the rest goes to `motion`.

    Dofs that the body cannot move at all count as tied, to nothing.
    """
    dofs, modes = body_modes(space, body)
    there = ~np.isin(dofs, absent)
    dofs, modes = dofs[there], modes[there]
    names = MOTIONS[space.components]
    for name in body.motion:
        if name not in names:
            raise ValueError(f"a rigid body has no motion '{name}' here; it has {', '.join(names)}.")
    also_held = np.array([dof in moved for dof in dofs.tolist()], bool)
    asked = np.array([names.index(name) for name in body.motion], dtype=int)
    equations = np.concatenate([modes[also_held], np.eye(len(names))[asked]])
    values = np.array([*(moved[dof] for dof in dofs[also_held].tolist()), *body.motion.values()])
    ranks = space.mesh.ranks
    given, loose = _solutions(ranks.stacked(equations), ranks.stacked(values), body)
    dofs, modes = dofs[~also_held], modes[~also_held]
    motion[dofs] = modes @ given
    ties = modes @ loose
    moving = ranks.largest(np.linalg.norm(ties, axis=0)) > EXACT * max(1.0, _most(ranks, modes))
    return dofs, ties[:, moving]


def _solutions(equations: np.ndarray, values: np.ndarray, body: RigidBody) -> tuple[np.ndarray, np.ndarray]:
    """A solution (n,) of equations (m, n) and a basis (n, k) of what may be added to it."""
    n = equations.shape[1]
    if not len(equations):
        return np.zeros(n), np.eye(n)
    given = np.linalg.lstsq(equations, values, rcond=EXACT)[0]
    if np.abs(equations @ given - values).max() > EXACT * max(np.abs(values).max(), 1e-300):
        raise ValueError(
            f"the rigid body on boundary '{body.boundary}' is to move in a way that another support forbids."
        )
    _, sizes, rows = np.linalg.svd(equations)
    rank = int((sizes > EXACT * sizes[0]).sum()) if sizes[0] > 0.0 else 0
    return given, rows[rank:].T


def _most(ranks: Alone, values: np.ndarray) -> float:
    return ranks.largest(float(np.abs(values).max(initial=0.0)))


def _short(ranks: Alone, rows: np.ndarray) -> np.ndarray:
    """A few rows with the same Gram matrix as the rows of all ranks together: the factor R of their QR."""
    own = np.asarray(np.linalg.qr(rows, mode="r")) if len(rows) else rows
    whole = ranks.stacked(own)
    return np.asarray(np.linalg.qr(whole, mode="r")) if len(whole) else whole


def _untied(constraints: Constraints, motions: np.ndarray) -> np.ndarray:
    """What of motions (k, m) of the tied dofs their bodies cannot follow, as a few rows."""
    n = constraints.ties.shape[1]
    both = _short(constraints.ranks, np.hstack([constraints.ties, motions]))
    ties, motions = both[:, :n], both[:, n:]
    return motions - ties @ np.linalg.lstsq(ties, motions, rcond=EXACT)[0] if n else motions


def _refuse_rigid_motion(space: Space, constraints: Constraints, absent: np.ndarray) -> None:
    """Raise where a rigid motion of all that is there is one that the constraints allow."""
    points, ranks = space.mesh.points, space.mesh.ranks
    low, high = ranks.least(points.min(axis=0)), ranks.largest(points.max(axis=0))
    centred = (points - 0.5 * (low + high) * (not space.kinematics.radial)) / float((high - low).max())
    modes = space.kinematics.modes(centred).reshape(-1, len(points) * len(space.components))
    modes = np.pad(modes, ((0, 0), (0, space.ndof - modes.shape[1])))
    allowed = np.concatenate([constraints.free, absent])
    against = modes.copy()
    against[:, allowed] = 0.0
    against[:, constraints.tied] = 0.0
    rows = np.concatenate([_short(ranks, against.T), _untied(constraints, modes[:, constraints.tied].T)])
    rows[np.abs(rows) < EXACT] = 0.0
    loose = len(modes) - (np.linalg.matrix_rank(rows, tol=EXACT) if rows.any() else 0)
    if loose:
        motions = "one rigid motion" if loose == 1 else f"{loose} rigid motions"
        raise ValueError(f"the supports leave {motions} of the body free; hold more components.")
