"""From nodal displacement to strain: tables, not formulas.

The displacement gradient H (3x3, H[i, j] = du_i/dx_j) of every kinematics is a sum of terms: component c of the
displacement times one of the shape terms of a node (derivatives along the mesh axes, and N/r about an axis) feeds the
entry (i, j). The strain is ``-sym(H)``: compression positive, the only minus sign there is. Materials always see all
six Mandel components; `active` names those that are not zero for every displacement.

With `mean_dilation` the volume strain at a point is replaced by its mean over a patch of elements (B̄, Hughes 1980): the
operator then has as many terms again, the patch means of the first, and the table is split by the volumetric projector.
All three normal strains may then differ from zero, though a plane strain's mean out-of-plane strain does not.

Axes: plane strain x, y (up), z out of plane; axisymmetric x = r, y = axial (up), z = θ; solids x, y, z (up).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from umat.mandel import SPHERICAL, from_tensor

RADIAL = -1  # the shape term N/r; derivatives are 0, 1, 2


@dataclass(frozen=True)
class Kinematics:
    """One kind of deformation.

    Attributes
    ----------
    components : tuple of str
        Displacement components of a node.
    dim : int
        Dimension of the mesh.
    terms : tuple
        (component, shape term, i, j, factor): what feeds the displacement gradient.
    modes : callable
        Coordinates (n, dim) -> (nmodes, n, ncomp) motions without strain.
    axes : tuple of int
        Direction in space of each component.
    mean_dilation : bool
        Whether the volume strain is a mean over patches of elements instead of the point's own.
    """

    components: tuple[str, ...]
    dim: int
    terms: tuple[tuple[int, int, int, int, float], ...]
    modes: Callable[[np.ndarray], np.ndarray]
    axes: tuple[int, ...]
    mean_dilation: bool = False

    @property
    def radial(self) -> bool:
        """Whether x is a radius: N/r is needed and volumes are 2πr times areas."""
        return any(term[1] == RADIAL for term in self.terms)

    @cached_property
    def operator(self) -> np.ndarray:
        """(6, ncomp, nterm) Mandel strain made by each component times each shape term of a node, or its patch mean."""
        operator = np.zeros((6, len(self.components), self.dim + self.radial))
        for component, term, i, j, factor in self.terms:
            gradient = np.zeros((3, 3))
            gradient[i, j] = factor
            operator[:, component, term] += from_tensor(-gradient)
        if not self.mean_dilation:
            return operator
        dilation = np.tensordot(SPHERICAL, operator, axes=1)
        return np.concatenate([operator - dilation, dilation], axis=2)

    @cached_property
    def active(self) -> np.ndarray:
        """Mandel components that can be non-zero."""
        return np.flatnonzero(self.operator.any(axis=(1, 2)))

    def between(self, tangent: np.ndarray) -> np.ndarray:
        """(n, k, k) entries between the k active components of tangents (n, 6, 6): all that a stiffness is made of."""
        if len(self.active) == 6:
            return tangent
        entries = (6 * self.active[:, None] + self.active).ravel()
        return tangent.reshape(-1, 36).take(entries, axis=1).reshape(-1, len(self.active), len(self.active))

    @cached_property
    def sparse_operator(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) rows (among `active`), components, shape terms and (n,) values of the operator's entries."""
        compact = self.operator[self.active]
        where = np.argwhere(compact)
        return where, compact[tuple(where.T)]


def _translations(n: int, ncomp: int) -> np.ndarray:
    return np.broadcast_to(np.eye(ncomp)[:, None, :], (ncomp, n, ncomp))


def _rotation(x: np.ndarray, i: int, j: int) -> np.ndarray:
    mode = np.zeros((1, *x.shape))
    mode[0, :, i], mode[0, :, j] = -x[:, j], x[:, i]
    return mode


def _plane_modes(x: np.ndarray) -> np.ndarray:
    return np.concatenate([_translations(len(x), 2), _rotation(x, 0, 1)])


def _axial_mode(x: np.ndarray) -> np.ndarray:
    return _translations(len(x), 2)[1:]


def _torsion_modes(x: np.ndarray) -> np.ndarray:
    spin = np.zeros((1, len(x), 3))
    spin[0, :, 2] = x[:, 0]
    return np.concatenate([_translations(len(x), 3)[1:2], spin])


def _solid_modes(x: np.ndarray) -> np.ndarray:
    turns = [_rotation(x, i, j) for i, j in ((0, 1), (1, 2), (2, 0))]
    return np.concatenate([_translations(len(x), 3), *turns])


_PLANE = tuple((i, j, i, j, 1.0) for i in range(2) for j in range(2))
_HOOP = ((0, RADIAL, 2, 2, 1.0),)
_TWIST = ((2, 0, 2, 0, 1.0), (2, 1, 2, 1, 1.0), (2, RADIAL, 0, 2, -1.0))
_SOLID = tuple((i, j, i, j, 1.0) for i in range(3) for j in range(3))

KINEMATICS = {
    "plane_strain": Kinematics(("x", "y"), 2, _PLANE, _plane_modes, (0, 1)),
    "axisymmetric": Kinematics(("r", "z"), 2, _PLANE + _HOOP, _axial_mode, (0, 1)),
    "axisymmetric_torsion": Kinematics(("r", "z", "theta"), 2, _PLANE + _HOOP + _TWIST, _torsion_modes, (0, 1, 2)),
    "solid": Kinematics(("x", "y", "z"), 3, _SOLID, _solid_modes, (0, 1, 2)),
}
