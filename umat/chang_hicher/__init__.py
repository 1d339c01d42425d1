"""The fabric-enhanced Chang–Hicher micromechanical model, one stress point and many.

`material` parameters and state, `contact` one contact plane, `balance` the averages over planes, `residual` the
equations of a step, `elimination` their linear systems, `history` the chain of sub-steps, `iteration` Newton's steps
of a sub-step, `substeps` their error and size, `points` the way in and out, `integrate` the loop over all, `rows` and
`pool` storage, `planes` directions and what is summed over them. The derivation is in `docs/theory.md`.
"""

import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import status
from ..directions import Directions
from ..interface import (
    Response,
    checked_vectors,
    elastic_tangent,
    initial_state,
    state_fields,
    symmetric_tangent,
    update,
)
from ..lanes import LANES
from ..mandel import Array, norm
from ..threads import get_threads, map_slices
from .integrate import integrate
from .material import ChangHicher, ChangHicherState, constants_of, elastic, fields, rule_of, start
from .planes import terms
from .pool import make_pool

__all__ = ["ChangHicher", "ChangHicherState"]

_local = threading.local()


def _pool(n_directions: int, symmetry: str, total: bool, law: type) -> Any:
    """Return this thread's storage: what one set of equations does not write must stay as it was made."""
    key = (n_directions, symmetry, total, law)
    if getattr(_local, "key", None) != key:
        _local.key, _local.pool = key, make_pool(n_directions, total)
    return _local.pool


@update.register
def _(material: ChangHicher, directions: Directions, strain_increment: ArrayLike, old: ChangHicherState) -> Response:
    strain = checked_vectors("strain_increment", strain_increment, len(old.stress))
    n = len(strain)
    constants, rule = constants_of(material), rule_of(directions)
    products = terms(directions.symmetry == "quarter")
    data = (old.stress / material.reference_pressure, old.fabric, old.void_ratio, old.slip, old.force, old.gap, strain)
    stress, fabric, void_ratio, slip, force, gap = (np.array(a) for a in data[:6])
    tangent = np.zeros((n, 6, 6))
    codes, errors = np.zeros(n, np.int8), np.zeros(n)
    work, substeps = np.zeros(n, np.int32), np.zeros(n, np.int32)
    out = (stress, fabric, void_ratio, slip, force, gap, tangent, codes, errors, work, substeps)

    # large increments take longest: they start first, and each thread has its part of them. No lane reads another, so
    # which points lie side by side does not matter to any.
    order = np.argsort(-norm(strain), kind="stable")
    parts = max(min(get_threads(), n // LANES), 1)

    def kernel(begin: int, end: int) -> None:
        pool = _pool(len(rule.weights), directions.symmetry, constants.total, type(material.law))
        with np.errstate(all="ignore"):  # lanes outside the domain are computed too, and left alone
            for part in range(begin, end):
                mine = np.ascontiguousarray(order[part::parts])
                integrate(material.law, constants, rule, products, pool, data, out, mine)

    map_slices(kernel, parts, 1)
    stress *= material.reference_pressure
    tangent *= material.reference_pressure
    refused = codes != status.OK
    stress[refused] = old.stress[refused]
    state = ChangHicherState(stress, fabric, void_ratio, slip, force, gap)
    return Response(stress, tangent, state, codes, errors, work)


@initial_state.register
def _(material: ChangHicher, directions: Directions, stress: ArrayLike, **needs: Any) -> ChangHicherState:
    return start(material, directions, stress, **needs)


@symmetric_tangent.register
def _(material: ChangHicher) -> bool:
    return False


@state_fields.register
def _(material: ChangHicher, state: ChangHicherState) -> dict[str, Array]:
    return fields(material, state)


@elastic_tangent.register
def _(material: ChangHicher, state: ChangHicherState) -> Array:
    return elastic(material, state)
