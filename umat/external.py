"""A material whose stress a compiled routine with the Abaqus UMAT argument list computes (small strain).

The routine sees its own sign, order and shear strains (`umat.abaqus`); its STATEV, the old total strain and the time
are part of the state, so that an update stays a pure function. PNEWDT < 1 refuses the point with `CUT_BACK`, numbers
that are not finite with `OUTSIDE_FAULT`. DDSDDE is passed as zeros: a routine may fill only the entries that are not
zero, and where it fills none the tangent is made of differences of its stress. Points are computed one after another
unless the routine is declared thread safe: Fortran keeps SAVE variables, COMMON blocks and, by default of some
compilers, local arrays in one place for all threads.

TIME has no physical meaning here: an update carries no duration. DTIME is a constant and TIME counts accepted updates.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from umat.abaqus import ORDER, PRESENT, SHAPES, strain_out, stress_in, stress_out, tangent_in
from umat.elastic import check
from umat.interface import (
    Response,
    checked_vectors,
    elastic_tangent,
    initial_state,
    state_fields,
    symmetric_tangent,
    update,
)
from umat.mandel import Array
from umat.routine import Call, load, run, shared_arguments
from umat.status import BAD_INPUT, CUT_BACK, OK, OUTSIDE_FAULT
from umat.threads import map_slices

DIFFERENCE = 1e-7
"""Strain by which a routine without DDSDDE is probed [-]."""


class External(NamedTuple):
    """A compiled routine and what it reads."""

    library: str
    """Path of the shared library."""
    properties: tuple[float, ...] = ()
    """PROPS, in the routine's own units and sign."""
    state_variables: int = 0
    """NSTATV."""
    initial_variables: tuple[float, ...] = ()
    """STATEV before the first increment; zeros where fewer than `state_variables` are given."""
    components: int = 6
    """NTENS: 6, or 4 for a routine that knows plane strain and axisymmetry only."""
    time_step: float = 1.0
    """DTIME of every update."""
    thread_safe: bool = False
    """Whether several threads may be in the routine at once."""
    symmetric: bool = False
    """Whether DDSDDE is symmetric in every state."""


class ExternalState(NamedTuple):
    """State of n points."""

    stress: Array
    """(n, 6) stress, compression positive."""
    variables: Array
    """(n, NSTATV) STATEV, as the routine left them."""
    strain: Array
    """(n, 6) total strain before the next increment, compression positive [-]."""
    time: Array
    """(n,) sum of DTIME over the accepted updates."""


@update.register
def _(material: External, directions: Any, strain_increment: ArrayLike, old: ExternalState) -> Response:
    strain_increment = checked_vectors("strain_increment", strain_increment, len(old.stress))
    call = computed(material, strain_increment, old)
    stress, tangent = stress_in(call.stress, material.components), _tangent(material, strain_increment, old, call)
    variables = call.variables[:, : material.state_variables]
    status = _status(material, strain_increment, old, call, tangent)
    good = status == OK
    new = ExternalState(stress, variables, old.strain + strain_increment, old.time + material.time_step)
    state = ExternalState(*(_where(good, after, before) for after, before in zip(new, old, strict=True)))
    return Response(state.stress, tangent, state, status, np.zeros(len(good)), np.ones(len(good), np.int32))


@initial_state.register
def _(material: External, directions: Any, stress: ArrayLike) -> ExternalState:
    _checked(material)
    stress = checked_vectors("stress", stress).copy()
    n = len(stress)
    variables = np.zeros((n, material.state_variables))
    variables[:, : len(material.initial_variables)] = material.initial_variables
    return ExternalState(stress, variables, np.zeros((n, 6)), np.zeros(n))


@symmetric_tangent.register
def _(material: External) -> bool:
    return material.symmetric


@state_fields.register
def _(material: External, state: ExternalState) -> dict[str, Array]:
    """Return the state variables under sdv1, sdv2 and so on, the names that Abaqus gives them."""
    return {f"sdv{k + 1}": column for k, column in enumerate(state.variables.T)}


@elastic_tangent.register
def _(material: External, state: ExternalState) -> Array:
    """Return the tangent of a zero increment, the best that a routine can say about its elasticity."""
    still = np.zeros_like(state.stress)
    return _tangent(material, still, state, computed(material, still, state))


def computed(material: External, strain_increment: Array, old: ExternalState) -> Call:
    """Return what the routine made of a (n, 6) strain increment, in its own conventions."""
    routine, components, n = load(material.library), material.components, len(old.stress)
    variables = np.zeros((n, max(material.state_variables, 1)))
    variables[:, : material.state_variables] = old.variables
    shared = shared_arguments(components, material.state_variables, material.properties, material.time_step)
    call = Call(
        stress_out(old.stress, components), variables, np.zeros((n, components, components)),
        strain_out(old.strain, components), strain_out(strain_increment, components),
        np.repeat(old.time[:, None], 2, axis=1), np.ones(n), shared,
    )  # fmt: skip
    size = 256 if material.thread_safe else max(n, 1)
    map_slices(lambda start, stop: run(routine, call, start, stop), n, size)
    return call


def _tangent(material: External, strain_increment: Array, old: ExternalState, call: Call) -> Array:
    """Return the (n, 6, 6) tangent, of differences where the routine left none."""
    tangent = tangent_in(call.tangent, material.components)
    bare = np.flatnonzero(~np.any(call.tangent, axis=(1, 2)))
    if len(bare):
        old = ExternalState(*(array[bare] for array in old))
        stress = stress_in(call.stress[bare], material.components)
        for k in range(6):
            moved = strain_increment[bare].copy()
            moved[:, k] += DIFFERENCE
            beside = stress_in(computed(material, moved, old).stress, material.components)
            tangent[bare, :, k] = (beside - stress) / DIFFERENCE
        for absent in np.setdiff1d(np.arange(6), ORDER[PRESENT[material.components]]):
            tangent[bare, absent, absent] = tangent[bare, ORDER[3], ORDER[3]]
    return tangent


def _status(material: External, strain_increment: Array, old: ExternalState, call: Call, tangent: Array) -> np.ndarray:
    """Return the (n,) codes: bad input, then numbers that are not finite, then a wish for a smaller increment."""
    sound = np.isfinite(strain_increment).all(axis=1) & np.isfinite(old.stress).all(axis=1)
    if material.components == 4:  # there is no place for shear out of the plane
        sound &= ~np.any(strain_increment[:, 3:5], axis=1) & ~np.any(old.stress[:, 3:5], axis=1)
    finite = np.isfinite(call.stress).all(axis=1) & np.isfinite(call.variables).all(axis=1)
    finite &= np.isfinite(tangent).all(axis=(1, 2))
    whole = call.step >= 1.0
    return np.select([~sound, ~whole, ~finite], [BAD_INPUT, CUT_BACK, OUTSIDE_FAULT], OK).astype(np.int8)


def _where(good: np.ndarray, after: Array, before: Array) -> Array:
    return np.where(good.reshape(-1, *[1] * (after.ndim - 1)), after, before)


def _checked(material: External) -> None:
    """Raise ValueError for a record that no routine can be called with."""
    load(material.library)
    if material.components not in SHAPES or material.components == 3:
        raise ValueError(f"components must be 6 or 4, got {material.components}: plane stress has no place here")
    check("state_variables", material.state_variables, 0)
    check("time_step", material.time_step, np.finfo(float).tiny)
    if len(material.initial_variables) > material.state_variables:
        raise ValueError(
            f"{len(material.initial_variables)} initial state variables are more than the {material.state_variables} "
            "state variables that there are"
        )
