"""From the stages of an element case to six linear conditions and the targets that they are led to.

The vertical is z, principal axes turn towards x. All targets count from the start of the stage, so that a path of many
legs drifts from no condition.
"""

from collections.abc import Sequence
from functools import singledispatch
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from fabfem.case import paths as said
from umat import legs
from umat.mandel import FACTOR, IDENTITY, Array, from_tensor, rotation
from umat.step import Course

Name = TypeVar("Name", bound=str)
HELD: dict[str, legs.Held] = {"drained": "minor_stress", "undrained": "volume", "constant_p": "p"}


class Plan(NamedTuple):
    """What a stage holds and where it goes."""

    on_stress: Array
    """(6, 6) coefficients of the stress."""
    on_strain: Array
    """(6, 6) coefficients of the strain."""
    targets: Array
    """(m, 6) what the conditions add up to at the end of each leg, from the start of the stage."""
    course: Course | None = None
    """The conditions by the fraction of the one leg, where it is not straight."""
    turns: int = 1
    """Targets on the course."""


@singledispatch
def plan(stage: said.Path, stress: Array) -> Plan:
    """Return the plan of a stage that starts from a stress (6,)."""
    raise TypeError(f"{type(stage).__name__} has no plan")


def _led(leg: legs.Leg, stage: said.Path, levels: tuple[float, ...]) -> Plan:
    """Return the plan that leads a leg of unit length to some levels, as often as the stage says."""
    return Plan(leg.on_stress, leg.on_strain, np.outer(levels * stage.cycles, leg.value))


def _driver(stage: said.Path, names: Sequence[Name]) -> tuple[Name, tuple[float, ...]]:
    """Return the name and the levels of the one driver that is given."""
    (name,) = (name for name in names if getattr(stage, name) is not None)
    return name, getattr(stage, name)


@plan.register
def _(stage: said.Isotropic, stress: Array) -> Plan:
    return Plan(np.eye(6), np.zeros((6, 6)), np.outer(stage.to * stage.cycles, IDENTITY) - stress)


@plan.register
def _(stage: said.Stress, stress: Array) -> Plan:
    return Plan(np.eye(6), np.zeros((6, 6)), (np.array(stage.to) * FACTOR - stress)[None])


@plan.register
def _(stage: said.K0, stress: Array) -> Plan:
    if stage.axial_strain is not None:
        return _led(legs.one_dimensional(1.0), stage, stage.axial_strain)
    return _led(legs.one_dimensional(1.0, stress=True), stage, tuple(to - stress[2] for to in stage.to or ()))


def _shear(stage: said.Shear, alpha: float, b: float) -> Plan:
    names: tuple[legs.Driver, ...] = ("axial_strain", "shear_strain", "deviatoric_strain", "q")
    driver, levels = _driver(stage, names)
    return _led(legs.fixed_axes(1.0, driver, HELD[stage.drainage], alpha, b), stage, levels)


@plan.register
def _(stage: said.Triaxial, stress: Array) -> Plan:
    return _shear(stage, 0.0, 0.0)


@plan.register
def _(stage: said.TrueTriaxial, stress: Array) -> Plan:
    return _shear(stage, 0.0, stage.b)


@plan.register
def _(stage: said.HollowCylinder, stress: Array) -> Plan:
    return _shear(stage, stage.alpha, stage.b)


@plan.register
def _(stage: said.PlaneStrain, stress: Array) -> Plan:
    names: tuple[Literal["axial_strain", "q"], ...] = ("axial_strain", "q")
    driver, levels = _driver(stage, names)
    return _led(legs.biaxial(1.0, driver, HELD[stage.drainage]), stage, levels)


@plan.register
def _(stage: said.SimpleShear, stress: Array) -> Plan:
    driver, levels = _driver(stage, ("shear_strain", "tau"))
    return _led(legs.simple_shear(1.0, driver == "tau", stage.drainage == "undrained"), stage, levels)


@plan.register
def _(stage: said.Rotation, stress: Array) -> Plan:
    angles = np.concatenate([[0.0], stage.angle * stage.cycles])
    on_stress, on_strain = np.eye(6), np.zeros((6, 6))
    if stage.drainage == "undrained":
        on_stress[:5] = np.linalg.svd(IDENTITY[None])[2][1:]
        on_stress[5], on_strain[5] = 0.0, IDENTITY

    def course(fraction: Array) -> Array:
        angle = np.interp(fraction, np.linspace(0.0, 1.0, len(angles)), angles)
        return (rotation(_about_y(angle)) @ stress - stress) @ on_stress.T

    return Plan(on_stress, on_strain, course(np.ones(1)), course, len(angles) - 1)


def _about_y(angle: Array) -> Array:
    """Return (n, 3, 3) rotations that turn z towards x by angles (n,) [deg]."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    zero, one = np.zeros_like(c), np.ones_like(c)
    return np.moveaxis(np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]]), -1, 0)


@plan.register
def _(stage: said.Free, stress: Array) -> Plan:
    turn = rotation(euler(stage.axes))
    rows = [(_row(condition.stress), _row(condition.strain), condition.value) for condition in stage.conditions]
    on_stress, on_strain = (np.array([row[k] for row in rows]) @ turn.T for k in (0, 1))
    value = np.array([row[2] for row in rows])
    return Plan(on_stress, on_strain, np.tile(value, (stage.cycles, 1)))


def _row(components: said.Components) -> Array:
    """Return the (6,) row of some coefficients of tensor components."""
    return np.sum([value * legs.component(name) for name, value in components.items()], axis=0) + np.zeros(6)


def euler(angles: tuple[float, ...]) -> Array:
    """Return the (3, 3) rotation about z, then the new y, then the new x, by angles [deg]."""
    found = np.eye(3)
    for axis, angle in zip((2, 1, 0), np.radians(angles), strict=True):
        c, s = np.cos(angle), np.sin(angle)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        found = found @ turn
    return found


#: two orthogonal unit vectors that span each plane of probes
PLANES = {
    "triaxial": from_tensor(np.array([np.diag([0.0, 0.0, 1.0]), np.diag([1.0, 1.0, 0.0]) / 2.0**0.5])),
    "biaxial": from_tensor(np.array([np.diag([0.0, 0.0, 1.0]), np.diag([1.0, 0.0, 0.0])])),
    "deviatoric": from_tensor(np.array([np.diag([-1.0, -1.0, 2.0]) / 6.0**0.5, np.diag([1.0, -1.0, 0.0]) / 2.0**0.5])),
    "torsion": np.array([legs.stress_direction(0.0, 0.5), legs.stress_direction(45.0, 0.5)]),
}


def basis(plane: str | Sequence[Sequence[float]]) -> Array:
    """Return two orthogonal unit vectors (2, 6) of a plane of probes, known by its name or by two tensors in it.

    Raises
    ------
    ValueError
        If the two tensors span no plane.
    """
    if isinstance(plane, str):
        return np.asarray(PLANES[plane])
    found, rest = np.linalg.qr((np.array(plane) * FACTOR).T)
    size = np.abs(np.diag(rest))
    if not size.min() > 1e-6 * np.linalg.norm(rest):
        raise ValueError("plane: its two tensors must differ in direction")
    return np.asarray((found * np.sign(np.diag(rest))).T)


def probes(stage: said.Probe) -> tuple[Array, legs.Leg]:
    """Return angles (n,) [deg] from the first vector of the plane to the second, and the leg of each probe."""
    angles = np.linspace(0.0, 360.0, stage.directions, endpoint=False)
    turn = np.radians(angles)[:, None]
    first, second = basis(stage.plane)
    leg = legs.stressed if stage.of == "stress" else legs.strained
    return angles, leg(stage.size * (np.cos(turn) * first + np.sin(turn) * second))
