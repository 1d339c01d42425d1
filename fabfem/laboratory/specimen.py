"""From an element case to a specimen: the material under its initial stress, and what is recorded of it.

What is wrong in a case and can only be seen here raises `CaseError` with one sentence naming the place in the file.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.case import CaseError, ElementCase, suggest
from fabfem.case.materials import ChangHicher
from fabfem.case.paths import Path
from fabfem.laboratory.columns import MEASURES, Column, Zeta, columns
from fabfem.laboratory.plans import basis, plan
from fabfem.substance import MisfitError, Substance, Surroundings, substance
from umat import contacts
from umat.mandel import FACTOR, IDENTITY, Array

VERTICAL = 2
ATMOSPHERE = 101.3e3
"""Atmospheric pressure, to which liquefaction is referred [Pa]."""
INTEGRATION = 0.2
"""Share of the accuracy that the integration of the material may take up in a sub-step."""


class Specimen(NamedTuple):
    """A case, ready to be tested."""

    case: ElementCase
    """What was asked."""
    material: Any
    """Record of `umat`."""
    directions: Any
    """Contact directions, or ``None``."""
    state: Any
    """State at the start."""
    columns: tuple[Column, ...]
    """Measured columns of the history."""
    zeta: Zeta | None
    """What the dilatancy state parameter refers to."""
    omitted: tuple[str, ...]
    """Sentences on what the scene leaves out."""

    @property
    def atmosphere(self) -> float:
        """Atmospheric pressure [stress]."""
        return ATMOSPHERE / self.case.unit_system.pascals


def build(case: ElementCase) -> Specimen:
    """Return the specimen that a case states.

    Raises
    ------
    CaseError
        If the case names something that is not there, or cannot be run.
    """
    ((name, table),) = case.material.items()
    with _blamed(case, f"material.{name}"):
        filling = substance(table, Surroundings(case.unit_system, VERTICAL, False, case.path.parent))
        material = _refined(filling.material, table, case.accuracy.curve)
        state = umat.initial_state(material, filling.directions, initial_stress(case)[None], **filling.needs)
    fields = umat.state_fields(material, state)
    _check_measures(case, fields)
    if case.output.roses and not contacts.known(state):
        raise CaseError(f"{case.path.name}: output.roses: the material {name} has no contacts")
    for stage in case.stage:
        if isinstance(stage, Path):
            with _blamed(case, f"stage[{stage.name}]"):
                plan(stage, state.stress[0])
        else:
            with _blamed(case, f"stage[{stage.name}]"):
                basis(stage.plane)
    found = columns(case.output.measures, case.unit_system)
    return Specimen(case, material, filling.directions, state, found, _zeta(case, material), _left_out(case, filling))


def initial_stress(case: ElementCase) -> Array:
    """Return the (6,) stress at the start."""
    if case.initial.p is not None:
        return case.initial.p * IDENTITY
    return np.array(case.initial.stress) * FACTOR


def _refined(material: Any, table: Any, curve: float) -> Any:
    """Return the material with a tolerance of its integration that suits the accuracy, unless the case sets one."""
    if not isinstance(table, ChangHicher) or "tolerance" in table.parameters:
        return material
    return material._replace(tolerance=INTEGRATION * curve)


def _zeta(case: ElementCase, material: Any) -> Zeta | None:
    if case.output.e_A is None or not hasattr(material, "e_ref"):
        return None
    own = float(getattr(material.law, "critical_fabric", 1.0))
    critical = own if case.output.A_c is None else case.output.A_c
    return Zeta(material.e_ref, case.output.e_A, critical, getattr(material.law, "extension", 1.0))


def _check_measures(case: ElementCase, fields: dict[str, Array]) -> None:
    """Refuse measures that do not exist, that the material lacks, or that need a parameter."""
    (name,) = case.material
    for asked in case.output.measures:
        place = f"{case.path.name}: output.measures: "
        if asked not in MEASURES:
            raise CaseError(f"{place}there is no measure '{asked}'{suggest(asked, MEASURES)}")
        if MEASURES[asked].needs and MEASURES[asked].needs not in fields:
            raise CaseError(f"{place}'{asked}' needs a {MEASURES[asked].needs}, which the material {name} has not")
    if "zeta" in case.output.measures and case.output.e_A is None:
        raise CaseError(f"{case.path.name}: output.e_A: is missing; the measure 'zeta' needs it")


def _left_out(case: ElementCase, filling: Substance) -> tuple[str, ...]:
    idle = sorted(set(MEASURES) - set(case.output.measures))
    return (
        "no mesh and no equations of equilibrium: one point, whose stress and strain are uniform",
        "no pore pressure: undrained is constant volume, and all stresses are effective",
        *filling.omitted,
        f"not measured, because not asked for: {', '.join(idle)}",
    )


@contextmanager
def _blamed(case: ElementCase, place: str) -> Iterator[None]:
    """Turn what the parts say about their arguments into a sentence that names the place in the case."""
    try:
        yield
    except MisfitError as error:
        raise CaseError(f"{case.path.name}: {place}.{error.key}: {error}") from error
    except ValueError as error:
        raise CaseError(f"{case.path.name}: {place}: {error}") from error
