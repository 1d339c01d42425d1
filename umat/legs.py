"""Legs of element tests: six linear conditions on stress and strain, S Δσ + E Δε = v, and presets of them.

Δσ and Δε are counted from the start of the leg; on the way, at the fraction t, the conditions add up to t v. Every
element test of the laboratory is such a leg: what its apparatus holds or drives is a row. Compression is positive.

Axes: `vertical` and `horizontal` span the plane in which principal axes are turned by α from the vertical; the third
axis is that of the intermediate principal stress, b = (σ2 − σ3)/(σ1 − σ3). A leg with fixed axes holds α and b of the
*change* of stress; they are those of the stress itself where the leg starts from an isotropic stress, or from one with
the same axes and b.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .directions import AXES, Axis
from .mandel import COLUMN, FACTOR, IDENTITY, ROW, Array, deviator, from_tensor, norm

Held = Literal["volume", "p", "minor_stress"]
Driver = Literal["shear_strain", "axial_strain", "deviatoric_strain", "q"]


class Leg(NamedTuple):
    """Six conditions S Δσ + E Δε = v, for all points (6, 6) or for each (n, 6, 6)."""

    on_stress: Array
    """(6, 6) coefficients of the stress (S) [-]."""
    on_strain: Array
    """(6, 6) coefficients of the strain (E); where S is not zero [stress], else [-]."""
    value: Array
    """(6,) what they add up to at the end of the leg (v)."""


def component(name: str) -> Array:
    """Return the (6,) row that picks a tensor component, `xx` … `xy`, from a Mandel vector.

    ValueError if there is no such component.
    """
    pairs = {frozenset((AXES[i], AXES[j])): k for k, (i, j) in enumerate(zip(ROW, COLUMN, strict=True))}
    k = pairs.get(frozenset(name)) if len(name) == 2 else None
    if k is None:
        raise ValueError(f"there is no component {name!r}; there are xx, yy, zz, yz, xz, xy")
    return np.asarray(np.eye(6)[k] / FACTOR[k], dtype=float)


def strained(strain: ArrayLike) -> Leg:
    """Return the leg of a given strain (6,) or (n, 6) [-]."""
    return Leg(np.zeros((6, 6)), np.eye(6), np.asarray(strain, float))


def stressed(change: ArrayLike) -> Leg:
    """Return the leg of a given change of stress (6,) or (n, 6); it ends where the material can carry no more."""
    return Leg(np.eye(6), np.zeros((6, 6)), np.asarray(change, float))


def isotropic(change: float) -> Leg:
    """Return isotropic compression: the change of the mean pressure (p), Δσ = Δp I."""
    return stressed(change * IDENTITY)


def triaxial(strain: float, vertical: Axis = "z") -> Leg:
    """Return drained triaxial compression to an axial strain [-], extension if negative: Δσ3 = 0, no shear stress."""
    axis = AXES.index(vertical)
    on_stress, on_strain = np.eye(6), np.zeros((6, 6))
    on_stress[axis], on_strain[axis, axis] = 0.0, 1.0
    return Leg(on_stress, on_strain, strain * on_strain[axis])


def undrained(strain: float, alpha: float = 0.0, b: float = 0.0, vertical: Axis = "z", horizontal: Axis = "x") -> Leg:
    """Return shear at constant volume to ε1 − ε3 [-] along principal stress axes held at α [deg], with b held.

    The total mean stress is not asked for: constant volume decides the effective one. α = 0, b = 0 is triaxial
    compression, α = 90°, b = 1 extension. The stress at the start must have these axes and b, or be isotropic.
    """
    return fixed_axes(strain, "shear_strain", "volume", alpha, b, vertical, horizontal)


def constant_p(strain: float, alpha: float = 0.0, b: float = 0.0, vertical: Axis = "z", horizontal: Axis = "x") -> Leg:
    """Return drained shear at constant mean pressure to ε1 − ε3 [-], axes and b held as in `undrained`."""
    return fixed_axes(strain, "shear_strain", "p", alpha, b, vertical, horizontal)


def fixed_axes(
    end: float,
    driver: Driver,
    held: Held,
    alpha: float = 0.0,
    b: float = 0.0,
    vertical: Axis = "z",
    horizontal: Axis = "x",
) -> Leg:
    """Return shear along fixed principal axes at constant b: the change of stress stays in span{I, n(α, b)}.

    Parameters
    ----------
    end : float
        Where the driver ends; a negative one shears the opposite way (extension, for α = b = 0).
    driver : str
        What grows: ``shear_strain`` ε1 − ε3 along the axes [-]; ``axial_strain`` ε1 along the first axis [-];
        ``deviatoric_strain`` √(2/3) n:ε [-], whose work with q is that of the deviator; ``q`` √(3/2) n:Δσ [stress].
    held : str
        Fifth condition: ``volume`` (undrained), ``p``, or ``minor_stress``, the stress along the third axis.
    alpha, b : float
        Direction of the major principal stress from the vertical [deg], and (σ2 − σ3)/(σ1 − σ3).
    vertical, horizontal : str
        Axes of the plane in which α turns.
    """
    shear = stress_direction(alpha, b, vertical, horizontal)
    first, _, third = principal_dyads(alpha, vertical, horizontal)
    on_stress, on_strain = np.zeros((6, 6)), np.zeros((6, 6))
    on_stress[:4] = np.linalg.svd(np.array([IDENTITY / np.sqrt(3.0), shear]))[2][2:]
    holds = {"volume": (on_strain, IDENTITY), "p": (on_stress, IDENTITY / 3.0), "minor_stress": (on_stress, third)}
    drives = {
        "shear_strain": (on_strain, first - third),
        "axial_strain": (on_strain, first),
        "deviatoric_strain": (on_strain, np.sqrt(2.0 / 3.0) * shear),
        "q": (on_stress, np.sqrt(1.5) * shear),
    }
    for row, (matrix, condition) in ((4, holds[held]), (5, drives[driver])):
        matrix[row] = condition
    return Leg(on_stress, on_strain, np.array([0.0, 0.0, 0.0, 0.0, 0.0, end]))


def one_dimensional(end: float, stress: bool = False, vertical: Axis = "z") -> Leg:
    """Return compression without lateral strain to an axial strain [-], or to a change of the axial stress."""
    axis = AXES.index(vertical)
    on_stress, on_strain = np.zeros((6, 6)), np.eye(6)
    if stress:
        on_stress[axis], on_strain[axis] = np.eye(6)[axis], 0.0
    return Leg(on_stress, on_strain, end * np.eye(6)[axis])


def biaxial(
    end: float, driver: Literal["axial_strain", "q"], held: Held, vertical: Axis = "z", lateral: Axis = "x"
) -> Leg:
    """Return plane-strain compression: no strain along the third axis, no shear stress on the three planes.

    Parameters
    ----------
    end : float
        Where the driver ends.
    driver : str
        ``axial_strain`` [-] along the vertical, or ``q``, here σ_vertical − σ_lateral [stress].
    held : str
        ``minor_stress`` keeps the lateral stress, ``p`` the mean stress, ``volume`` the volume.
    vertical, lateral : str
        Axes of the plane of the test.
    """
    up, side = AXES.index(vertical), AXES.index(lateral)
    unit, third = np.eye(6), 3 - up - side
    on_stress, on_strain = np.eye(6), np.zeros((6, 6))
    on_stress[[up, side, third]] = 0.0
    on_strain[third] = unit[third]
    holds = {"volume": (on_strain, IDENTITY), "p": (on_stress, IDENTITY / 3.0), "minor_stress": (on_stress, unit[side])}
    drives = {"axial_strain": (on_strain, unit[up]), "q": (on_stress, unit[up] - unit[side])}
    for row, (matrix, condition) in ((side, holds[held]), (up, drives[driver])):
        matrix[row] = condition
    return Leg(on_stress, on_strain, end * unit[up])


def simple_shear(
    end: float, stress: bool = False, constant_volume: bool = False, vertical: Axis = "z", horizontal: Axis = "x"
) -> Leg:
    """Return simple shear: no strain but the shear γ, twice the tensor component, and the vertical one.

    The vertical stress is held, or with `constant_volume` the height. `end` is γ [-], or with `stress` the shear
    stress τ.
    """
    up = AXES.index(vertical)
    shear = component(vertical + horizontal)
    on_stress, on_strain = np.zeros((6, 6)), np.eye(6)
    if not constant_volume:
        on_stress[up], on_strain[up] = np.eye(6)[up], 0.0
    row = int(np.flatnonzero(shear)[0])
    on_strain[row] = 0.0 if stress else 2.0 * shear
    on_stress[row] = shear if stress else 0.0
    return Leg(on_stress, on_strain, end * np.eye(6)[row])


def principal_dyads(alpha: float, vertical: Axis = "z", horizontal: Axis = "x") -> Array:
    """Return the dyads (3, 6) of the axes of σ1, σ2, σ3; that of σ1 turns by α [deg] from vertical to horizontal."""
    if vertical == horizontal:
        raise ValueError(f"vertical and horizontal are both {vertical}")
    up, across = np.eye(3)[AXES.index(vertical)], np.eye(3)[AXES.index(horizontal)]
    c, s = np.cos(np.radians(alpha)), np.sin(np.radians(alpha))
    axes = np.array([c * up + s * across, np.cross(up, across), c * across - s * up])
    return from_tensor(axes[:, :, None] * axes[:, None, :])


def stress_direction(alpha: float, b: float, vertical: Axis = "z", horizontal: Axis = "x") -> Array:
    """Return the unit deviator (6,) of stresses σ1 : σ2 : σ3 with b = (σ2 − σ3)/(σ1 − σ3) and axes at α [deg]."""
    first, second, _ = principal_dyads(alpha, vertical, horizontal)
    direction = deviator(first + b * second)
    return direction / norm(direction)
