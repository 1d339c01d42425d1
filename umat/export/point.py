"""One call of an exported routine: from its arguments to the kernel's arrays and back.

The kernel is `umat.chang_hicher.integrate`, with the same types of arguments as in our own runs, so that the machine
code in the library is made of the same intermediate code. Signs, order and shears are those of `umat.abaqus`.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from umat.abaqus import ORDER, SCALE
from umat.chang_hicher import ChangHicher, constants_of, integrate, make_pool, rule_of, terms
from umat.directions import Directions
from umat.export.layout import BEGUN, FABRIC, GAP, OUT_OF_PLANE, SLIP, VOID, VOID_RATIO, Layout
from umat.export.record import viewer
from umat.export.start import deposit, settle_open, sliding
from umat.lanes import kernel

#: results below the status codes, and what is printed then
COMPONENTS, COUNTS, START = -1, -2, -3
MESSAGES = {
    COMPONENTS: "NTENS must be 6, or 4 in plane strain and axisymmetry; plane stress is not supported",
    COUNTS: "PROPS must begin with the initial void ratio and there must be {count} state variables",
    START: "the initial stress lies outside the domain of the contact law, or void ratio and fabric cannot be: "
    "some contact would pull or slide freely. Give an initial stress with confinement",
}
LOOSEST = 1.64
"""Void ratio at which the number of contacts nearly vanishes, and the highest to start from."""


class EntryPoint(NamedTuple):
    """What a library is made of."""

    function: Callable[..., Any]
    """(memory, STRESS, STATEV, DDSDDE, DSTRAN, NTENS, NSTATV, PROPS, NPROPS) → status code or one of `MESSAGES`."""
    memory: Any
    """Nested tuple of the arrays that the function works on, as they are before the first call."""


def entry_point(material: ChangHicher, directions: Directions, layout: Layout) -> EntryPoint:
    """Return the function of a material, to be compiled without numba's run-time, and its memory."""
    constants, law, unit, needed = (
        constants_of(material),
        material.law,
        float(material.reference_pressure),
        layout.state_variables,
    )
    rule = rule_of(directions)
    forces = (1, layout.directions if layout.forces else 0, 3)
    data = (np.zeros((1, 6)), np.zeros((1, 6)), np.zeros(1), np.zeros((1, layout.directions)), np.zeros(forces),
            np.zeros(1), np.zeros((1, 6)))  # fmt: skip
    out = (*(array.copy() for array in data[:6]), np.zeros((1, 6, 6)), np.zeros(1, np.int8), np.zeros(1),
           np.zeros(1, np.int32), np.zeros(1, np.int32))  # fmt: skip
    pool = make_pool(len(rule.weights), constants.total)
    memory = (rule, terms(False), pool, data, out, np.zeros(1, np.int64))
    view = viewer(memory)

    def function(place, stress, statev, ddsdde, dstran, ntens, nstatv, props, nprops):
        rule, products, pool, data, out, order = view(place)
        components = ntens[0]
        if components != 6 and components != 4:
            return COMPONENTS
        if nprops[0] < 1 or nstatv[0] < needed:
            return COUNTS
        read(data, components, unit, stress, statev, dstran)
        if statev[BEGUN] == 0.0 and not begin(constants, rule, data, components, props, nprops[0]):
            return START
        restore(data, out)
        integrate(law, constants, rule, products, pool, data, out, order)
        if out[7][0] == 0:
            answer(out, components, unit, stress, statev, ddsdde)
        return np.int64(out[7][0])

    return EntryPoint(function, memory)


@kernel
def read(data, components, unit, stress, statev, dstran):
    """Fill the old state and the increment from the routine's arguments."""
    old, fabric, void_ratio, slip, force, gap, strain = data
    for k in range(6):
        given = stress[k] if k < components else statev[OUT_OF_PLANE + k - 4]
        old[0, ORDER[k]] = -given * SCALE[k] / unit
        strain[0, ORDER[k]] = -dstran[k] / SCALE[k] if k < components else 0.0
        fabric[0, ORDER[k]] = statev[FABRIC + k] * SCALE[k]
    void_ratio[0], gap[0] = statev[VOID], statev[GAP]
    directions = slip.shape[1]
    for a in range(directions):
        slip[0, a] = statev[SLIP + a]
    for a in range(force.shape[1]):
        for i in range(3):
            force[0, a, i] = statev[SLIP + directions + 3 * a + i]


@kernel
def begin(constants, rule, data, components, props, count):
    """Fill the state of a first call; what STATEV holds already of void ratio and fabric is kept. True if possible."""
    old, fabric, void_ratio, slip, force = data[:5]
    if void_ratio[0] == 0.0:
        void_ratio[0] = props[VOID_RATIO]
    size = 0.0
    for k in range(6):
        size += abs(fabric[0, k])
    if size == 0.0:
        deposit(props, count, components, fabric[0])
    if not 0.0 < void_ratio[0] < LOOSEST:
        return False
    settle_open(constants, old[0], fabric[0])
    return sliding(constants, rule, old[0], fabric[0], void_ratio[0], slip[0], force[0]) == 0


@kernel
def restore(data, out):
    """Copy the old state to where the new one is to be, and clear the tangent and the counts."""
    for k in range(6):
        out[0][0, k], out[1][0, k] = data[0][0, k], data[1][0, k]
        for m in range(6):
            out[6][0, k, m] = 0.0
    out[2][0], out[5][0] = data[2][0], data[5][0]
    for a in range(data[3].shape[1]):
        out[3][0, a] = data[3][0, a]
    for a in range(data[4].shape[1]):
        for i in range(3):
            out[4][0, a, i] = data[4][0, a, i]
    out[7][0], out[8][0], out[9][0], out[10][0] = 0, 0.0, 0, 0


@kernel
def answer(out, components, unit, stress, statev, ddsdde):
    """Write the new state and the tangent to the routine's arguments."""
    new, fabric, void_ratio, slip, force, gap, tangent = out[:7]
    for k in range(6):
        value = -new[0, ORDER[k]] * unit / SCALE[k]
        if k < components:
            stress[k] = value
        else:
            statev[OUT_OF_PLANE + k - 4] = value
        statev[FABRIC + k] = fabric[0, ORDER[k]] / SCALE[k]
    for k in range(components):
        for m in range(components):
            ddsdde[m * components + k] = tangent[0, ORDER[k], ORDER[m]] * unit / (SCALE[k] * SCALE[m])
    statev[BEGUN], statev[VOID], statev[GAP] = 1.0, void_ratio[0], gap[0]
    directions = slip.shape[1]
    for a in range(directions):
        statev[SLIP + a] = slip[0, a]
    for a in range(force.shape[1]):
        for i in range(3):
            statev[SLIP + directions + 3 * a + i] = force[0, a, i]
