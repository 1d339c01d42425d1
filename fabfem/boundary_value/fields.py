"""Named fields at the points, gathered only when somebody asks for them.

Every material has the fields made of its stress; the others are what the material says about its state. Where a
zone's material does not have a field, the field is NaN.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

import umat
from fabfem.fem.model import States, Zone
from fabfem.fem.space import Space
from umat import mandel
from umat.mandel import Array

QUANTITIES = {"displacement": "length", "stress": "stress", "p": "stress", "q": "stress"}
"""Quantity of each field, which decides its unit; those not listed are plain numbers."""

OF_STRESS: dict[str, Callable[[Array], Array]] = {
    "stress": np.asarray,
    "p": mandel.p,
    "q": mandel.q,
    "eta": mandel.eta,
}
"""Fields made of the stress alone."""

OF_MOTION = ("displacement", "strain")
"""Fields made of the displacement, which is counted from where a stage last set it to zero."""


def known_fields(zones: Mapping[str, Zone]) -> tuple[str, ...]:
    """Return the names of the fields that the zones of a problem have."""
    own = {field: None for zone in zones.values() for field in umat.state_fields(zone.material, _first(zone.state))}
    return (*OF_MOTION, *OF_STRESS, *own)


def point_fields(
    space: Space, zones: Mapping[str, Zone], displacement: Array, states: States, asked: Sequence[str]
) -> dict[str, Array]:
    """Return the asked fields at the points of the whole mesh, tensors as Mandel vectors.

    Parameters
    ----------
    space : Space
        Space that the displacement lives in.
    zones : dict of str to Zone
        Materials and the points they occupy.
    displacement : (ndof,) array
        Displacement of the nodes.
    states : dict of str to state
        State of each zone.
    asked : sequence of str
        Names of fields; the displacement, which has no value at points, is passed over.
    """
    gathered: dict[str, Array] = {}
    if "strain" in asked:
        gathered["strain"] = space.strain(displacement)
    for name, zone in zones.items():
        for field, values in _of_zone(zone.material, states[name], asked).items():
            whole = gathered.setdefault(field, np.full((space.npoints, *values.shape[1:]), np.nan))
            whole[zone.points] = values
    return {field: gathered[field] for field in asked if field in gathered}


def _of_zone(material: Any, state: Any, asked: Sequence[str]) -> dict[str, Array]:
    found = {field: OF_STRESS[field](state.stress) for field in asked if field in OF_STRESS}
    rest = [field for field in asked if field not in (*OF_STRESS, *OF_MOTION)]
    own = umat.state_fields(material, state) if rest else {}
    return found | {field: own[field] for field in rest if field in own}


def _first(state: Any) -> Any:
    """Return the state of the first point alone."""
    return type(state)(*(values[:1] for values in state))
