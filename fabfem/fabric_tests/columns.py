"""The columns of a history, of a fabric and of the stress and strain it stands under, and the lines of a file of them.

A value that has no meaning is left empty: F_b and the angle of an isotropic fabric, the angle to a stress without a
major axis.
"""

import csv
from collections.abc import Iterator
from typing import Any

import numpy as np

from fabfem.case import FabricCase
from fabfem.fabric_tests.drives import Value
from fabfem.units import Units
from umat.fabric.probe_2d import anisotropy
from umat.fabric_history import Given
from umat.mandel import FACTOR, Array, deviator, dot, norm, principal, to_tensor, trace
from umat.mandel import p as mean
from umat.mandel import q as deviatoric

AXES = ("xx", "yy", "zz", "yz", "xz", "xy")
NONE = 1e-9
"""Size below which a tensor has no direction."""


DRIVE = {
    "strain_q": "none", "strain_v": "none", "strain_xx": "none", "strain_yy": "none", "strain_zz": "none",
    "p": "stress", "q": "stress", "eta": "none", "state_parameter": "none",
}  # fmt: skip
"""Columns of what drives, and what they are."""

FABRIC = (*(f"F_{axes}" for axes in AXES), "F_norm", "F_q", "F_b", "F_n", "angle", "Z", "A")
"""Columns of the fabric."""


def read_lines(case: FabricCase, name: str) -> list[list[str]]:
    """Return the header and the rows of a file of columns, without comments; ValueError if it cannot be read."""
    try:
        with case.locate(name).open(encoding="utf-8", newline="") as file:
            return [line for line in csv.reader(line for line in file if not line.startswith("#")) if line]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{name} cannot be read ({getattr(error, 'strerror', None) or error})") from None


def headers(units: Units) -> tuple[str, ...]:
    """Return name and unit of all columns, those of the drive first."""
    drive = tuple(f"{name} [{units.label(quantity)}]" for name, quantity in DRIVE.items())
    return (*drive, *(f"{name} [{'degree' if name == 'angle' else '-'}]" for name in FABRIC))


def drive_columns(given: Given) -> list[Array]:
    """Return the columns (m + 1, n) of what drives: √(2/3) ‖e‖, tr ε, normal strains, p, q, q/p, ψ."""
    strain, p, q = given.strain, mean(given.stress), deviatoric(given.stress)
    shear = np.sqrt(2.0 / 3.0) * norm(deviator(strain))
    with np.errstate(all="ignore"):
        ratio = q / p
    return [shear, trace(strain), *np.moveaxis(strain[..., :3], -1, 0), p, q, ratio, given.state_parameter]


def fabric_columns(fabric: Array, stress: Array, planar: bool) -> list[Array]:
    """Return the columns of a fabric (..., 6) under a stress; NaN where one has no meaning.

    Components of the tensor; ‖F‖; F_q = √(3/2) ‖F‖ [Y 2.2], F_b = (F_2 − F_3)/(F_1 − F_3), F_n = F:s/‖s‖; the angle
    between the major axes of F and of the stress; of a law in the plane, instead of F_q, F_b and F_n, Z = tr F and
    A = F_1 − F_2 [P 5].
    """
    f, s = deviator(fabric), deviator(stress)
    empty = np.full(fabric.shape[:-1], np.nan)
    with np.errstate(all="ignore"):
        along = np.where(norm(s) > NONE * np.abs(trace(stress)), dot(f, s) / norm(s), np.nan)
        major, middle, minor = np.moveaxis(principal(f), -1, 0)
        b = np.where(norm(f) > NONE, (middle - minor) / (major - minor), np.nan)
    components = [*np.moveaxis(fabric / FACTOR, -1, 0), norm(fabric)]
    if planar:
        return [*components, empty, empty, empty, angle(f, s), trace(fabric), anisotropy(fabric)]
    return [*components, np.sqrt(1.5) * norm(f), b, along, angle(f, s), empty, empty]


def angle(first: Array, second: Array) -> Array:
    """Return the angle (...) between the major axes of two tensors (..., 6) [deg], NaN where one has none."""
    axes, clear = [], np.ones(first.shape[:-1], bool)
    for tensor in (first, second):
        values, vectors = np.linalg.eigh(to_tensor(np.nan_to_num(tensor)))
        axes.append(vectors[..., -1])
        clear &= values[..., 2] - values[..., 1] > 1e-6 * norm(tensor) + NONE * np.abs(values[..., 2]) + 1e-300
    cosine = np.clip(np.abs(np.sum(axes[0] * axes[1], axis=-1)), 0.0, 1.0)
    return np.where(clear, np.degrees(np.arccos(cosine)), np.nan)


def rows(labels: tuple[Value, ...], columns: list[Any]) -> Iterator[tuple[Value, ...]]:
    """Yield a row for each record: labels, number of the record, values; empty text for NaN."""
    for number, values in enumerate(zip(*columns, strict=True)):
        yield (*labels, number, *(_value(value) for value in values))


def _value(value: Any) -> Value:
    return float(value) if np.isfinite(value) else ""
