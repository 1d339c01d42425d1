"""What every material answers, as functions chosen by the type of its record.

A material is a frozen record of parameters, a state a `NamedTuple` of arrays whose first
axis is the point and whose first field is `stress`.  The module of a material registers
its own functions here, so a material nobody uses is never imported.  Stress and strain
are Mandel vectors, compression positive; any consistent units.
"""

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umat.mandel import Array


class Response(NamedTuple):
    """Answer of `n` points to a strain increment."""

    stress: Array
    """(n, 6) new stress."""
    tangent: Array
    """(n, 6, 6) derivative of the computed stress with respect to the strain."""
    state: Any
    """New state, of the type of the old one."""
    status: NDArray[np.int8]
    """(n,) codes of `umat.status`; 0 is done, else the point kept its old state."""
    error: Array
    """(n,) estimated relative local error of the integration [-]."""
    work: NDArray[np.int32]
    """(n,) evaluations spent on the point."""


@singledispatch
def update(material: Any, directions: Any, strain_increment: ArrayLike, old: Any) -> Response:
    """Return the `Response` to a (n, 6) strain increment [-]; `old` is left untouched.

    `directions` is a `Directions` record for micromechanical materials, else None.
    """
    raise _unknown(material, "update")


@singledispatch
def initial_state(material: Any, directions: Any, stress: ArrayLike, **needs: Any) -> Any:
    """Return the state under a (n, 6) stress; ValueError names a bad parameter."""
    raise _unknown(material, "initial_state")


@singledispatch
def symmetric_tangent(material: Any) -> bool:
    """Return whether the tangent is symmetric in every state."""
    raise _unknown(material, "symmetric_tangent")


@singledispatch
def state_fields(material: Any, state: Any) -> dict[str, Array]:
    """Return the derived fields of a state for output, by name, first axis the point."""
    raise _unknown(material, "state_fields")


@singledispatch
def elastic_tangent(material: Any, state: Any) -> Array:
    """Return the (n, 6, 6) elastic tangent of a state."""
    raise _unknown(material, "elastic_tangent")


@singledispatch
def weakened(material: Any, factor: float) -> Any:
    """Return the material with its strength divided by a factor.

    A record that does not say otherwise and has a `friction_angle` [degrees] gets tan φ / factor in its place.
    """
    if not hasattr(material, "friction_angle"):
        raise _unknown(material, "weakened")
    return material._replace(friction_angle=reduced_angle(material.friction_angle, factor))


def reduced_angle(angle: float, factor: float) -> float:
    """Return arctan(tan(angle) / factor), angles in degrees."""
    return float(np.degrees(np.arctan(np.tan(np.radians(angle)) / factor)))


def checked_vectors(name: str, vectors: ArrayLike, n_points: int | None = None) -> Array:
    """Return C-contiguous float64 (n, 6) vectors; ValueError if the shape differs."""
    vectors = np.ascontiguousarray(vectors, dtype=np.float64)
    n_points = len(vectors) if n_points is None and vectors.ndim else n_points
    if vectors.shape != (n_points, 6):
        wanted = "n" if n_points is None else n_points
        raise ValueError(f"{name} must have shape ({wanted}, 6), got {vectors.shape}")
    return vectors


def _unknown(material: Any, function: str) -> TypeError:
    name = type(material).__name__
    return TypeError(f"{name} is not a material that umat.{function} knows")
