"""Columns of an element test's history: stress, strain, and the measures that the case asks for.

A measure is a function of a row; it needs no more than what it reads, so a measure nobody asks for costs nothing.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fabfem.units import Units
from umat import mandel, measures
from umat.mandel import FACTOR, Array

COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")


class Zeta(NamedTuple):
    """What the dilatancy state parameter refers to."""

    e_lim: float
    """Critical void ratio at p = 0 [-]."""
    weight: float
    """Weight of the fabric (e_A) [-]."""
    critical: float
    """Anisotropy in the critical state (A_c) [-]."""
    extension: float
    """M_e/M_c (c), of the loading direction [-]."""


class Row(NamedTuple):
    """One row of the history, before it is written."""

    stress: Array
    """(6,) effective stress [stress]."""
    strain: Array
    """(6,) strain of the stage [-]."""
    before: tuple[Array, Array]
    """Stress and strain of the row before; of this one at the start of a stage."""
    fields: dict[str, Array]
    """What the material says of its state, each (1, ...)."""
    zeta: Zeta | None
    """What ζ refers to; ``None`` without."""

    @property
    def fabric(self) -> Array:
        """Fabric anisotropy tensor (F), (6,)."""
        return np.asarray(self.fields["fabric"][0], dtype=float)

    @property
    def void_ratio(self) -> float:
        """Void ratio (e)."""
        return float(self.fields["void_ratio"][0])

    @property
    def psi(self) -> float:
        """State parameter (ψ)."""
        return float(self.fields["state_parameter"][0])


class Measure(NamedTuple):
    """A measure that can be asked for."""

    quantity: str
    """Key of `fabfem.units.DIMENSIONS`."""
    value: Callable[[Row], Any]
    """The entry of a row."""
    needs: str = ""
    """Field of the material it is made from."""


def zeta(row: Row) -> float:
    """Return the dilatancy state parameter of a row (ζ), NaN where nothing says what it refers to."""
    if row.zeta is None:
        return float("nan")
    e_lim, weight, critical, _ = row.zeta
    along = measures.anisotropy(row.fabric, row.stress)
    return float(measures.dilatancy_state(row.void_ratio, row.void_ratio - row.psi, along, e_lim, weight, critical))


def _rate(row: Row) -> tuple[Array, Array]:
    return row.stress - row.before[0], row.strain - row.before[1]


def _dilatancy(row: Row) -> Any:
    _, strain = _rate(row)
    return measures.ratio(mandel.trace(strain), measures.deviatoric_strain(strain))


def _invariant(k: int) -> Callable[[Row], Any]:
    return lambda row: measures.joint_invariants(row.stress, row.fabric)[k]


def _principal(k: int) -> Callable[[Row], Any]:
    return lambda row: mandel.principal(row.stress)[k]


def _shear(row: Row) -> Any:
    major, _, minor = mandel.principal(row.strain)
    return major - minor


def _loading(row: Row) -> Any:
    extension = row.zeta.extension if row.zeta else 1.0
    return measures.dot(row.fabric, measures.loading_direction(row.stress, extension))


def _entry(field: str, k: int) -> Callable[[Row], Any]:
    return lambda row: row.fields[field][0][k] / FACTOR[k]


F = "fabric"
INVARIANTS = ("stress", "stress", "stress2", "stress2")
MEASURES: dict[str, Measure] = {
    "p": Measure("stress", lambda row: mandel.p(row.stress)),
    "q": Measure("stress", lambda row: mandel.q(row.stress)),
    "eta": Measure("none", lambda row: mandel.eta(row.stress)),
    "lode": Measure("angle", lambda row: mandel.lode(row.stress)),
    "b": Measure("none", lambda row: measures.intermediate(row.stress)),
    "alpha": Measure("angle", lambda row: measures.inclination(row.stress)),
    **{f"sigma_{k + 1}": Measure("stress", _principal(k)) for k in range(3)},
    "eps_v": Measure("none", lambda row: mandel.trace(row.strain)),
    "eps_q": Measure("none", lambda row: measures.deviatoric_strain(row.strain)),
    "gamma": Measure("none", _shear),
    "q_axial": Measure("stress", lambda row: row.stress[2] - 0.5 * (row.stress[0] + row.stress[1])),
    "eps_axial": Measure("none", lambda row: row.strain[2]),
    "tau_xz": Measure("stress", lambda row: row.stress[4] / FACTOR[4]),
    "gamma_xz": Measure("none", lambda row: 2.0 * row.strain[4] / FACTOR[4]),
    "dilatancy": Measure("none", _dilatancy),
    "second_order_work": Measure("stress", lambda row: measures.dot(*_rate(row))),
    "e": Measure("none", lambda row: row.void_ratio, "void_ratio"),
    "psi": Measure("none", lambda row: row.psi, "state_parameter"),
    "zeta": Measure("none", zeta, F),
    "A": Measure("none", lambda row: measures.anisotropy(row.fabric, row.stress), F),
    "A_loading": Measure("none", _loading, F),
    "A_prime": Measure("none", lambda row: measures.relative_orientation(row.fabric, row.stress), F),
    "K_F": Measure("stress", lambda row: measures.joint_invariant(row.stress, row.fabric), F),
    "F_norm": Measure("none", lambda row: mandel.norm(row.fabric), F),
    "F_vM": Measure("none", lambda row: measures.von_mises_fabric(row.fabric), F),
    "F_b": Measure("none", lambda row: measures.intermediate(row.fabric), F),
    "F_alpha": Measure("angle", lambda row: measures.inclination(row.fabric), F),
    **{f"F_{name}": Measure("none", _entry("fabric", k), F) for k, name in enumerate(COMPONENTS)},
    **{f"L{k + 1}": Measure(unit, _invariant(k), F) for k, unit in enumerate(INVARIANTS)},
    "mobilised_friction": Measure("angle", lambda row: row.fields["mobilised_friction"][0], "mobilised_friction"),
}
"""Every measure by its name in a case."""


class Column(NamedTuple):
    """A column of the history."""

    name: str
    """Name of the column."""
    unit: str
    """Unit, ``-`` for a plain number."""
    value: Callable[[Row], Any]
    """The entry of a row."""

    @property
    def header(self) -> str:
        """Name and unit as they stand in the first line of the file."""
        return f"{self.name} [{self.unit}]"


def columns(names: tuple[str, ...], units: Units) -> tuple[Column, ...]:
    """Return the columns of stress and strain, tensor components, and of the measures."""
    tensors = [
        Column(f"{what}_{name}", units.label(unit), _component(what, k))
        for what, unit in (("stress", "stress"), ("strain", "none"))
        for k, name in enumerate(COMPONENTS)
    ]
    asked = [Column(name, units.label(MEASURES[name].quantity), MEASURES[name].value) for name in names]
    return (*tensors, *asked)


def _component(what: str, k: int) -> Callable[[Row], Any]:
    return lambda row: getattr(row, what)[k] / FACTOR[k]
