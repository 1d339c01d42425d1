"""What the perfectly plastic and hardening reference materials share.

Their state is the stress and an equivalent plastic strain, their update a closed form,
computed by a kernel that fills a slice of points.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umat.interface import Response, checked_vectors
from umat.mandel import Array
from umat.threads import map_slices

SLICE_SIZE = 2048


class PlasticState(NamedTuple):
    """State of `n` elastic-plastic points."""

    stress: Array
    """(n, 6) stress, compression positive."""
    plastic_strain: Array
    """(n,) accumulated √(2/3) ‖deviator of the plastic strain increment‖ [-]."""


class Batch(NamedTuple):
    """Input and output arrays of a kernel; `n` points."""

    strain_increment: Array
    """(n, 6) strain increment [-]."""
    old_stress: Array
    """(n, 6) old stress."""
    old_plastic_strain: Array
    """(n,) old equivalent plastic strain [-]."""
    stress: Array
    """(n, 6) new stress, to be filled."""
    plastic_strain: Array
    """(n,) new equivalent plastic strain [-], to be filled."""
    tangent: Array
    """(n, 6, 6) tangent, to be filled."""
    status: NDArray[np.int8]
    """(n,) status codes, to be filled."""


Kernel = Callable[[int, int, Any, Batch], object]


def unstrained(stress: ArrayLike) -> PlasticState:
    """Return the state of (n, 6) stresses without plastic strain."""
    stress = checked_vectors("stress", stress).copy()
    return PlasticState(stress, np.zeros(len(stress)))


def closed_form(kernel: Kernel, constants: Any, strain_increment: ArrayLike, old: PlasticState) -> Response:
    """Return the response that `kernel(start, stop, constants, batch)` computes."""
    old_stress = checked_vectors("old stress", old.stress)
    n_points = len(old_stress)
    batch = Batch(
        checked_vectors("strain_increment", strain_increment, n_points),
        old_stress,
        np.ascontiguousarray(old.plastic_strain, dtype=np.float64),
        stress=np.empty((n_points, 6)),
        plastic_strain=np.empty(n_points),
        tangent=np.empty((n_points, 6, 6)),
        status=np.empty(n_points, dtype=np.int8),
    )
    map_slices(lambda start, stop: kernel(start, stop, constants, batch), n_points, SLICE_SIZE)
    return Response(
        stress=batch.stress,
        tangent=batch.tangent,
        state=PlasticState(batch.stress, batch.plastic_strain),
        status=batch.status,
        error=np.zeros(n_points),
        work=np.ones(n_points, dtype=np.int32),
    )
