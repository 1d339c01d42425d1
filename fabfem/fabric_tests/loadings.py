"""Histories that the Chang–Hicher model computes: one for each pair of b and α, leg after leg."""

from itertools import product
from typing import Any

import numpy as np

import umat
from fabfem.case import FabricCase
from fabfem.case import fabric as said
from fabfem.fabric_tests.curves import VERTICAL
from fabfem.fabric_tests.drives import blamed
from fabfem.fabric_tests.group import Group
from fabfem.substance import Surroundings, substance
from umat import path as paths
from umat.chang_hicher.material import critical_void_ratio
from umat.fabric_history import Given
from umat.mandel import IDENTITY, p
from umat.plastic_strain import plastic_strain


def compute_histories(drive: said.Loading, case: FabricCase) -> tuple[Group, ...]:
    """Return the histories of all pairs of b and α; those that end at the same record together."""
    ((name, table),) = case.material.items()
    with blamed(case, f"material.{name}"):
        sand = substance(table, Surroundings(case.unit_system, VERTICAL, flat=False, folder=case.path.parent))
        variants = list(product(drive.b, drive.alpha))
        stress = np.tile(drive.pressure * IDENTITY, (len(variants), 1))
        state = umat.initial_state(sand.material, sand.directions, stress, **sand.needs)
    seen = _follow(drive, sand, state, variants)
    plastic = plastic_strain(sand.material, sand.directions, seen.stress, seen.strain, seen.fabric, seen.void_ratio)
    psi = seen.void_ratio - critical_void_ratio(sand.material, p(seen.stress))
    labels = [(f"b={b:g} alpha={alpha:g}", b, alpha) for b, alpha in variants]
    records = np.isfinite(seen.stress[..., 0]).sum(axis=0)
    groups = []
    for count in np.unique(records)[::-1]:
        mine = np.flatnonzero(records == count)
        parts = [array[:count, mine] for array in (seen.stress, seen.strain, plastic, psi)]
        why = (
            "" if count == len(psi) else f"the material stopped after {count - 1} of {len(psi) - 1} records of the path"
        )
        groups.append(Group(tuple(labels[i] for i in mine), Given(*parts), seen.fabric[:count, mine], reason=why))
    return tuple(groups)


def _follow(drive: said.Loading, sand: Any, state: Any, variants: list[tuple[float, float]]) -> paths.History:
    """Return one history of all legs; strains add up, and a point that stopped in one leg stays stopped."""
    kept: list[paths.History] = []
    strain, alive = np.zeros((len(variants), 6)), np.ones(len(variants), bool)
    for leg in drive.leg:
        each = [_leg(leg, b, alpha) for b, alpha in variants]
        conditions = paths.Leg(*(np.array(part) for part in zip(*each, strict=True)))
        done = paths.follow(sand.material, sand.directions, state, conditions, records=leg.records)
        first = 1 if kept else 0  # a leg begins where the last one ended
        seen = done._replace(
            stress=done.stress[first:].copy(),
            strain=done.strain[first:] + strain,
            void_ratio=done.void_ratio[first:].copy(),
            fabric=done.fabric[first:].copy(),
        )
        for array in (seen.stress, seen.strain, seen.void_ratio, seen.fabric):
            array[:, ~alive] = np.nan
        kept.append(seen)
        alive &= done.reached >= 1.0
        strain, state = np.nan_to_num(strain + done.strain[-1]), done.state
    return kept[-1]._replace(
        stress=np.concatenate([one.stress for one in kept]),
        strain=np.concatenate([one.strain for one in kept]),
        void_ratio=np.concatenate([one.void_ratio for one in kept]),
        fabric=np.concatenate([one.fabric for one in kept]),
    )


def _leg(leg: said.Leg, b: float, alpha: float) -> paths.Leg:
    """Return the conditions of a leg."""
    if leg.pressure is not None:
        return paths.isotropic(leg.pressure)
    strain = float(leg.strain or 0.0)
    if leg.kind == "triaxial":
        return paths.triaxial(strain)
    return {"constant_p": paths.constant_p, "undrained": paths.undrained}[leg.kind](strain, alpha, b)
