"""From what a case says about materials to records, contact directions and initial states.

The vertical is the last axis of the mesh. A deposit's fabric is F = ‖F‖/√6 (3 d⊗d − I), large along the deposition
axis d [ZK 6]; with a bedding angle θ the axis is tilted from the vertical by θ towards the azimuth, so that the
bedding planes dip by θ that way.
"""

from collections.abc import Mapping
from functools import singledispatch
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.case import materials as said
from fabfem.case import suggest
from fabfem.units import Units
from umat import fabric as laws
from umat.directions import Directions, directions, mirrored, rotated, rotation
from umat.mandel import Array, from_tensor


class Substance(NamedTuple):
    """A material ready to be put into zones."""

    material: Any
    """Record of `umat`."""
    directions: Any
    """Contact directions, or ``None``."""
    needs: Mapping[str, Any]
    """What its initial state needs besides the stress."""
    omitted: tuple[str, ...] = ()
    """Sentences on what the material leaves out."""


class MisfitError(ValueError):
    """A key of a material's table with a value that does not fit."""

    def __init__(self, key: str, what: str) -> None:
        super().__init__(what)
        self.key = key


class Surroundings(NamedTuple):
    """What a material has to know about the scene."""

    units: Units
    """Units of the case."""
    vertical: int
    """Axis that points up."""
    flat: bool
    """Whether the plane of the mesh is a plane of mirror symmetry."""
    folder: Path = Path()
    """Folder of the case file."""


@singledispatch
def substance(table: said.Material, scene: Surroundings) -> Substance:
    """Return the substance that a material's table describes.

    Raises
    ------
    MisfitError
        If a name is unknown or a value impossible.
    """
    raise TypeError(f"{type(table).__name__} has no substance")


def _own(table: said.Material) -> dict[str, Any]:
    """Return the parameters of a table, without what every material has."""
    return table.model_dump(exclude=set(said.Material.model_fields))


@substance.register
def _(table: said.Elastic, scene: Surroundings) -> Substance:
    return Substance(umat.Elastic(**_own(table)), None, {})


@substance.register
def _(table: said.VonMises, scene: Surroundings) -> Substance:
    return Substance(umat.VonMises(**_own(table)), None, {})


@substance.register
def _(table: said.MohrCoulomb, scene: Surroundings) -> Substance:
    return Substance(umat.MohrCoulomb(**_own(table)), None, {})


@substance.register
def _(table: said.DruckerPrager, scene: Surroundings) -> Substance:
    return Substance(umat.DruckerPrager(**_own(table)), None, {})


@substance.register
def _(table: said.Umat, around: Surroundings) -> Substance:
    if table.components == 4 and not around.flat:
        raise MisfitError("components", "a routine of four components serves plane strain and axisymmetry only")
    if len(table.initial_state) > table.state_variables:
        given = len(table.initial_state)
        raise MisfitError("initial_state", f"has {given} numbers, but state_variables is {table.state_variables}")
    material = umat.External(
        str(around.folder / table.library), table.properties, table.state_variables, table.initial_state,
        table.components, table.time_step, table.thread_safe,
    )  # fmt: skip
    return Substance(material, None, {}, ("physical time in the external routine: TIME counts its calls",))


@substance.register
def _(table: said.ChangHicher, around: Surroundings) -> Substance:
    fabric = deposit(table.fabric, around.vertical)
    rule, saved = rule_for(table.directions, around.flat and _mirrored(fabric), table.turn)
    material = _sand(table, around.units)
    frozen = () if table.fabric and table.fabric.law != "constant" else ("no evolution of the fabric: it is frozen",)
    return Substance(material, rule, {"void_ratio": table.void_ratio, "fabric": fabric}, (*saved, *frozen))


def deposit(fabric: said.Fabric | None, vertical: int) -> Array:
    """Return the (6,) fabric anisotropy tensor (F) of a deposit, zero without a table.

    Parameters
    ----------
    fabric : Fabric or None
        Size and bedding.
    vertical : int
        Axis that points up; the azimuth turns from x to the other horizontal axis.
    """
    if fabric is None:
        return np.zeros(6)
    tilt, azimuth = np.radians(fabric.bedding_angle), np.radians(fabric.azimuth)
    axis = np.zeros(3)
    axis[vertical] = np.cos(tilt)
    axis[0], axis[3 - vertical] = np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth)
    return fabric.norm / np.sqrt(6.0) * from_tensor(3.0 * np.outer(axis, axis) - np.eye(3))


def _mirrored(fabric: Array) -> bool:
    """Return whether a fabric is symmetric about the plane z = 0."""
    return bool(np.abs(fabric[[3, 4]]).max() <= 1e-12)


def rule_for(name: str, flat: bool, turn: said.Turn | None = None) -> tuple[Directions, tuple[str, ...]]:
    """Return the contact directions, those equal by mirror symmetry stored once, and a sentence that says so."""
    try:
        whole = directions(name)
    except ValueError as error:
        raise MisfitError("directions", str(error)) from error
    if turn is not None:
        whole = rotated(whole, rotation(turn.axis, turn.angle))
    if not flat:
        return whole, ()
    try:
        half = mirrored(whole, "z")
    except ValueError:
        return whole, ()
    return half, (
        f"{len(whole) - len(half)} of {len(whole)} contact directions: mirror symmetry makes them equal to others",
    )


def _sand(table: said.ChangHicher, units: Units) -> Any:
    """Return the record of a preset sand, with what the table says otherwise."""
    from umat.sands import SANDS

    if table.preset not in SANDS:
        raise MisfitError("preset", f"there is no sand '{table.preset}'{suggest(table.preset, SANDS)}")
    sand = SANDS[table.preset](newtons=units.newtons, metres=units.metres)
    sand_as_said = changed(sand, table.parameters, "parameters")
    return sand_as_said._replace(law=_law(table.fabric, sand.law), localisation=table.localisation)


def _law(fabric: said.Fabric | None, preset: Any) -> Any:
    """Return the record of a fabric law, with the preset's parameters where it is the preset's law."""
    if fabric is None:
        return laws.Constant()
    if fabric.law not in laws.LAWS:
        raise MisfitError("fabric.law", f"there is no fabric law '{fabric.law}'{suggest(fabric.law, laws.LAWS)}")
    record = laws.LAWS[fabric.law]
    return changed(preset if isinstance(preset, record) else record(), fabric.parameters, "fabric.parameters")


def changed(record: Any, parameters: Mapping[str, float], place: str) -> Any:
    """Return a record with some parameters replaced; `MisfitError` with the place of one that it does not have."""
    numbers = [name for name, value in record._asdict().items() if isinstance(value, int | float)]
    for name in parameters:
        if name not in numbers:
            raise MisfitError(f"{place}.{name}", f"is not a known parameter{suggest(name, numbers)}")
    return record._replace(**parameters)
