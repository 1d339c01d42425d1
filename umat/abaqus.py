"""The Abaqus UMAT argument list (small strain), and its conventions against those of this package.

A UMAT takes tension positive, ours compression; it orders components 11, 22, 33, 12, 13, 23, ours (Mandel) are
xx, yy, zz, √2 yz, √2 xz, √2 xy; its shear strains are engineering ones, γ = 2 ε. With f the factors of `mandel`,
1 or √2, and k the Mandel component that stands at the place of a UMAT component:

    STRESS = −σ_k / f_k,   STRAN = −f_k ε_k,   DDSDDE = D_kl / (f_k f_l)

Arrays are Fortran's: DDSDDE(i, j) = ∂Δσ_i/∂Δε_j lies column after column. NTENS is 6 (solids; NDI = 3, NSHR = 3),
4 (plane strain and axisymmetry; 3, 1) or 3 (plane stress; 2, 1).
"""

import numpy as np
from numpy.typing import ArrayLike

from umat.mandel import FACTOR, Array

#: Mandel component at the place of each UMAT component 11, 22, 33, 12, 13, 23
ORDER = np.array([0, 1, 2, 5, 4, 3])
#: factors (f) in UMAT order
SCALE = np.ascontiguousarray(FACTOR[ORDER])
#: (NDI, NSHR) of the values of NTENS that a caller may use
SHAPES = {6: (3, 3), 4: (3, 1), 3: (2, 1)}
#: places of the components that there are, among 11, 22, 33, 12, 13, 23
PRESENT = {6: np.arange(6), 4: np.arange(4), 3: np.array([0, 1, 3])}

#: names of the arguments, in order; a Fortran compiler appends the length of CMNAME
ARGUMENTS = (
    "STRESS", "STATEV", "DDSDDE", "SSE", "SPD", "SCD", "RPL", "DDSDDT", "DRPLDE", "DRPLDT", "STRAN", "DSTRAN", "TIME",
    "DTIME", "TEMP", "DTEMP", "PREDEF", "DPRED", "CMNAME", "NDI", "NSHR", "NTENS", "NSTATV", "PROPS", "NPROPS",
    "COORDS", "DROT", "PNEWDT", "CELENT", "DFGRD0", "DFGRD1", "NOEL", "NPT", "LAYER", "KSPT", "KSTEP", "KINC",
)  # fmt: skip


def stress_out(stress: ArrayLike, components: int = 6) -> Array:
    """Return the (n, NTENS) STRESS of (n, 6) Mandel stresses."""
    return np.ascontiguousarray((-np.asarray(stress, float)[..., ORDER] / SCALE)[..., PRESENT[components]])


def stress_in(stress: ArrayLike, components: int = 6) -> Array:
    """Return the (n, 6) Mandel stress of (n, NTENS) STRESS; components that are not there are zero."""
    return _embedded(-np.asarray(stress, float) * SCALE[PRESENT[components]], components)


def strain_out(strain: ArrayLike, components: int = 6) -> Array:
    """Return the (n, NTENS) STRAN or DSTRAN of (n, 6) Mandel strains."""
    return np.ascontiguousarray((-np.asarray(strain, float)[..., ORDER] * SCALE)[..., PRESENT[components]])


def strain_in(strain: ArrayLike, components: int = 6) -> Array:
    """Return the (n, 6) Mandel strain of (n, NTENS) STRAN or DSTRAN."""
    return _embedded(-np.asarray(strain, float) / SCALE[PRESENT[components]], components)


def tangent_in(tangent: ArrayLike, components: int = 6) -> Array:
    """Return the (n, 6, 6) Mandel tangent of DDSDDE stored Fortran's way, [n, j, i] = DDSDDE(i, j).

    Shears that a routine of four components does not know get the stiffness of the one it knows.
    """
    given = np.swapaxes(np.asarray(tangent, float), -1, -2)
    scale, places = SCALE[PRESENT[components]], ORDER[PRESENT[components]]
    whole = np.zeros((*given.shape[:-2], 6, 6))
    whole[..., places[:, None], places] = given * scale[:, None] * scale
    for absent in np.setdiff1d(np.arange(6), ORDER[PRESENT[components]]):
        whole[..., absent, absent] = whole[..., ORDER[3], ORDER[3]]
    return whole


def _embedded(vectors: Array, components: int) -> Array:
    whole = np.zeros((*vectors.shape[:-1], 6))
    whole[..., ORDER[PRESENT[components]]] = vectors
    return whole
