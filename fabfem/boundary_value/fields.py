"""Named fields at the points, gathered only when somebody asks for them.

Every material has the fields made of its stress; the others are what the material says about its state. Where a
zone's material does not have a field, the field is NaN.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

import umat
from fabfem.boundary_value.stability import acoustic_determinant, second_order_work
from fabfem.fem.increment import Increment
from fabfem.fem.model import Zone
from fabfem.fem.space import Space
from umat import mandel
from umat.mandel import Array

QUANTITIES = {
    **{"displacement": "length", "displacement_increment": "length", "stress": "stress", "p": "stress", "q": "stress"},
    **{"second_order_work": "stress", "pore_pressure": "stress"},
}
"""Quantity of each field, which decides its unit; those not listed are plain numbers."""

OF_STRESS: dict[str, Callable[[Array], Array]] = {
    "stress": np.asarray,
    "p": mandel.p,
    "q": mandel.q,
    "eta": mandel.eta,
}
"""Fields made of the stress alone."""

AT_NODES: dict[str, Callable[[Increment], Array]] = {
    "displacement": lambda increment: increment.displacement,
    "displacement_increment": lambda increment: increment.step,
}
"""Fields of nodes: the displacement, counted from where a stage last set it to zero, and that of the increment."""

OF_MOTION: dict[str, Callable[[Space, Increment], Array]] = {
    "strain": lambda space, increment: space.strain(increment.displacement),
    "strain_increment": lambda space, increment: space.strain(increment.step),
    "second_order_work": second_order_work,
    "acoustic_determinant": acoustic_determinant,
}
"""Fields made of what an increment does."""


PORE_PRESSURE = "pore_pressure"


def known_fields(zones: Mapping[str, Zone], wet: bool = False) -> tuple[str, ...]:
    """Return the names of the fields that the zones of a problem have; `wet` where there is water."""
    own = {field: None for zone in zones.values() for field in umat.state_fields(zone.material, _first(zone.state))}
    return (*AT_NODES, *OF_MOTION, *OF_STRESS, *own, *((PORE_PRESSURE,) if wet else ()))


def point_tensors(zones: Mapping[str, Zone]) -> dict[str, bool]:
    """Return whether each field of the points is a tensor, for those fields that a single number or tensor makes."""
    found = {name: name in ("stress", "strain", "strain_increment") for name in (*OF_STRESS, *OF_MOTION)}
    for zone in zones.values():
        own = umat.state_fields(zone.material, _first(zone.state))
        found |= {name: values.shape[1:] == (6,) for name, values in own.items() if values.shape[1:] in ((), (6,))}
    return found


def point_fields(space: Space, increment: Increment, asked: Sequence[str]) -> dict[str, Array]:
    """Return the asked fields at the points of the whole mesh, tensors as Mandel vectors; NaN where there is no zone.

    Parameters
    ----------
    space : Space
        Space that the displacement lives in.
    increment : Increment
        What is shown.
    asked : sequence of str
        Names of fields; those of nodes are passed over.
    """
    gathered: dict[str, Array] = {}
    for name in asked:
        if name in OF_MOTION:
            gathered[name] = _where(space, increment.zones, OF_MOTION[name](space, increment))
    for name, zone in increment.zones.items():
        for field, values in _of_zone(zone.material, increment.states[name], asked).items():
            whole = gathered.setdefault(field, np.full((space.npoints, *values.shape[1:]), np.nan))
            whole[zone.points] = values
    return {field: gathered[field] for field in asked if field in gathered}


def _where(space: Space, zones: Mapping[str, Zone], values: Array) -> Array:
    """Return values with NaN where there is no zone."""
    there = np.zeros(space.npoints, bool)
    for zone in zones.values():
        there[zone.points] = True
    return np.where(there.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)


def _of_zone(material: Any, state: Any, asked: Sequence[str]) -> dict[str, Array]:
    found = {field: OF_STRESS[field](state.stress) for field in asked if field in OF_STRESS}
    rest = [field for field in asked if field not in (*OF_STRESS, *OF_MOTION, *AT_NODES)]
    own = umat.state_fields(material, state) if rest else {}
    return found | {field: own[field] for field in rest if field in own}


def _first(state: Any) -> Any:
    """Return the state of the first point alone."""
    return type(state)(*(values[:1] for values in state))
