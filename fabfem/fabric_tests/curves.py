"""From the laws that a case names to records that can be integrated, and the fabric that they start from."""

from typing import Any, NamedTuple

import numpy as np

from fabfem.case import CaseError, FabricCase, suggest
from fabfem.case import fabric as said
from fabfem.case.materials import Fabric
from fabfem.fabric_tests.drives import blamed
from fabfem.substance import changed, deposit
from umat.fabric import LAWS, PLANAR_LAWS
from umat.fabric.probe_2d import IDENTITY, PLANE, REDUCTIONS, Probe2D, Sample, sample, unit_deviator
from umat.fabric.yuan import Yuan, older
from umat.fabric_history import Explicit, Implicit
from umat.mandel import FACTOR, Array

FORMS: dict[type, dict[str, Any]] = {Yuan: {"older": older}, Probe2D: dict(REDUCTIONS)}
"""Reduced forms of the laws that have some."""
VERTICAL = 2
"""The deposition axis is z."""


class Curve(NamedTuple):
    """A law of the case, ready to be run."""

    name: str
    """Its key in the case."""
    law: Any
    """Record of `umat.fabric`."""
    update: Explicit | Implicit
    """How it is integrated."""
    planar: bool
    """Whether its fabric is the whole F_ij in the plane."""
    sample: Sample | None
    """The packing that its parameters and its start come from."""


def curves(case: FabricCase) -> tuple[Curve, ...]:
    """Return the laws of a case; `CaseError` if one is not there or has no such form, sample or parameter."""
    return tuple(_curve(case, name, table) for name, table in case.law.items())


def _curve(case: FabricCase, name: str, table: said.Law) -> Curve:
    place, file = f"law.{name}", case.path.name
    known = LAWS | PLANAR_LAWS
    if table.law not in known:
        raise CaseError(f"{file}: {place}.law: there is no fabric law '{table.law}'{suggest(table.law, known)}")
    record, packing = known[table.law](), None
    if table.sample is not None:
        if not isinstance(record, Probe2D):
            raise CaseError(f"{file}: {place}.sample: the law '{table.law}' has no samples; 'probe_2d' has")
        with blamed(case, f"{place}.sample"):
            packing = sample(table.sample)
        record = packing.law
    with blamed(case, place):
        record = changed(record, table.parameters, "parameters")
    forms = FORMS.get(type(record), {})
    if table.form != "full":
        if table.form not in forms:
            raise CaseError(f"{file}: {place}.form: the law '{table.law}' has no form '{table.form}'{_forms(forms)}")
        record = forms[table.form](record)
    update = Implicit() if table.update == "implicit" else Explicit(table.tolerance)
    return Curve(name, record, update, table.law in PLANAR_LAWS, packing)


def _forms(forms: dict[str, Any]) -> str:
    return f"; it has {', '.join(['full', *forms])}"


def start(case: FabricCase, curve: Curve, stress: Array, own: Array | None = None) -> Array:
    """Return the fabric (n, 6) at the start of a law under stresses (n, 6); `own` is that of the path's material."""
    said_start = case.start
    if said_start is not None and said_start.components is not None:
        return np.tile(np.array(said_start.components) * FACTOR, (len(stress), 1))
    if curve.planar:
        return _packing(case, curve, stress)
    if said_start is not None:
        one = deposit(Fabric(norm=said_start.norm, bedding_angle=said_start.bedding_angle), VERTICAL)
        return np.tile(one, (len(stress), 1))
    return np.zeros((len(stress), 6)) if own is None else own.copy()


def _packing(case: FabricCase, curve: Curve, stress: Array) -> Array:
    """Return F = Z I/2 + A τ̂/√2 of the law's sample."""
    if curve.sample is None:
        raise CaseError(
            f"{case.path.name}: start.components: is missing; the law '{curve.name}' is of the plane and needs "
            "the whole F_ij, or a sample"
        )
    fabric = np.zeros((len(stress), 6))
    tau = unit_deviator(stress)
    fabric[:, PLANE] = 0.5 * curve.sample.coordination * IDENTITY + curve.sample.anisotropy / 2.0**0.5 * tau
    return fabric
