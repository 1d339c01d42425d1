"""Residual of one step in every lane, its Jacobian, and the vectors that go with it.

Unknowns: stress and fabric at the end of the step, (σ, F). Equations: ε(σ, F) − Δε = 0 and F − F_o − ΔF = 0, where the
law's ΔF reads F, σ and ψ at the middle of the step and the step's increments of s/p, of strain and of plastic strain.
"""

import numpy as np

from ..fabric.law import active_inputs, dot, increments, scaled, slope_of
from ..lanes import LANES, inlined, kernel, put, row, six, store
from .rows import (
    BY_VOID_STRAIN,
    COLUMNS,
    ERRORS,
    FABRIC,
    FABRIC_ERROR,
    FABRIC_SLOPE,
    FIRST,
    GAIN,
    GAIN_END,
    GEO,
    INPUTS,
    LAW_INPUTS,
    LAW_SLOPE,
    LENGTH,
    MATRIX,
    NEWTON,
    NORM,
    OLD,
    PART,
    PLASTIC,
    PLASTIC_SLOPE,
    PORTION,
    PSI,
    PSI_P,
    RATIO_SLOPE,
    SHARE,
    SLOPE,
    STRAIN,
    STRESS_ERROR,
    STRESS_NORM,
    TANGENT,
    VOID,
    Y,
)  # fmt: skip

FABRIC_WEIGHT = 0.1  #: of the fabric residual beside the strain residual


@kernel
def law_inputs(rows, weight):
    """Fill what a fabric law reads, at old + weight (new − old): weight ½ the middle, 1 the end of the step."""
    for i in range(6):
        stress, fabric = row(rows, OLD + i), row(rows, OLD + FABRIC + i)
        put(rows, INPUTS + i, fabric + weight * (row(rows, Y + FABRIC + i) - fabric))
        put(rows, INPUTS + 6 + i, stress + weight * (row(rows, Y + i) - stress))
        put(rows, INPUTS + 19 + i, row(rows, PART + i))
        put(rows, INPUTS + 25 + i, row(rows, PLASTIC + i))
    put(rows, INPUTS + 12, row(rows, PSI))
    i_p = 3.0 / np.maximum(row(rows, Y) + row(rows, Y + 1) + row(rows, Y + 2), 1e-12)
    i_old = 3.0 / np.maximum(row(rows, OLD) + row(rows, OLD + 1) + row(rows, OLD + 2), 1e-12)
    for i in range(6):
        # the identity part of s/p is the same at both ends
        put(rows, INPUTS + 13 + i, row(rows, Y + i) * i_p - row(rows, OLD + i) * i_old)


@kernel
def by_ratio(rows, state, out):
    """Fill 6 × 6 rows with the law's derivative through s/p at the stress of `state`."""
    y = six(rows, state)
    i_p = 3.0 / np.maximum(y[0] + y[1] + y[2], 1e-12)
    for i in range(6):
        d = six(rows, LAW_SLOPE + LAW_INPUTS * i + 13)
        # d(s/p) = dσ/p − σ tr dσ / (3 p²)
        pull = dot(d, y) * i_p / 3.0
        straight = (d[0] - pull, d[1] - pull, d[2] - pull, d[3], d[4], d[5])
        store(rows, out + 6 * i, scaled(i_p, straight))


@kernel
def fabric_rows(law, rows):
    """Fill the law's increment and the total derivative of F − F_o − ΔF by (σ, F, e), 6 × 13 rows."""
    inputs, slope = rows[INPUTS * LANES : (INPUTS + LAW_INPUTS) * LANES], rows[LAW_SLOPE * LANES :]
    increments(law, inputs, rows[GAIN * LANES : (GAIN + 6) * LANES])
    slope_of(law, inputs, slope)
    ratio = 13 in active_inputs(law)
    if ratio:
        by_ratio(rows, Y, RATIO_SLOPE)
    for i in range(6):
        own, out = LAW_SLOPE + LAW_INPUTS * i, FABRIC_SLOPE + COLUMNS * i
        by_psi = row(rows, PSI_P) * row(rows, own + 12)
        for k in range(6):
            third, one = 1.0 / 3.0 if k < 3 else 0.0, 1.0 if i == k else 0.0
            put(rows, out + k, -0.5 * (row(rows, own + 6 + k) - third * by_psi))
            put(rows, out + FABRIC + k, one - 0.5 * row(rows, own + k))
            if ratio:
                put(rows, out + k, row(rows, out + k) - row(rows, RATIO_SLOPE + 6 * i + k))
        put(rows, out + VOID, -0.5 * row(rows, own + 12))
        by_plastic(rows, out, own + 25)


@inlined
def by_plastic(rows, out, law):
    """Subtract the product of a row of the law's derivative with the plastic strain's."""
    d = six(rows, law)
    for c in range(COLUMNS):
        plastic = PLASTIC_SLOPE + c
        change = (
            d[0] * row(rows, plastic)
            + d[1] * row(rows, plastic + COLUMNS)
            + d[2] * row(rows, plastic + 2 * COLUMNS)
            + d[3] * row(rows, plastic + 3 * COLUMNS)
            + d[4] * row(rows, plastic + 4 * COLUMNS)
            + d[5] * row(rows, plastic + 5 * COLUMNS)
        )
        put(rows, out + c, row(rows, out + c) - change)


@inlined
def copy(rows, target, source):
    """Copy a row."""
    put(rows, target, row(rows, source))


@kernel
def gather(rows, components, evolving):
    """Fill the square system of the components that do not vanish, and minus its residual."""
    nc = components.shape[0]
    n = 2 * nc if evolving else nc
    for i in range(nc):
        a = components[i]
        put(rows, NEWTON + i, row(rows, PART + a) - row(rows, STRAIN + a))
        for j in range(nc):
            b = components[j]
            copy(rows, MATRIX + i * n + j, SLOPE + COLUMNS * a + b)
            if evolving:
                copy(rows, MATRIX + i * n + nc + j, SLOPE + COLUMNS * a + FABRIC + b)
                copy(rows, MATRIX + (nc + i) * n + j, FABRIC_SLOPE + COLUMNS * a + b)
                copy(rows, MATRIX + (nc + i) * n + nc + j, FABRIC_SLOPE + COLUMNS * a + FABRIC + b)
        if evolving:
            gain = row(rows, Y + FABRIC + a) - row(rows, OLD + FABRIC + a)
            put(rows, NEWTON + nc + i, row(rows, GAIN + a) - gain)


@kernel
def norms(rows, components, evolving):
    """Fill the norm of the residual as a strain, and of the sub-step's strain."""
    nc = components.shape[0]
    part = six(rows, PART)
    total = 0.0 * part[0]
    for i in range(nc):
        total = total + row(rows, NEWTON + i) * row(rows, NEWTON + i)
        if evolving:
            fabric = FABRIC_WEIGHT * row(rows, NEWTON + nc + i)
            total = total + fabric * fabric
    put(rows, NORM, np.sqrt(total))
    put(rows, LENGTH, np.sqrt(dot(part, part)))


@kernel
def right_hand_sides(rows, components, evolving):
    """Fill the tangent's columns (as if nothing depended on the start) and the error's column."""
    nc = components.shape[0]
    portion, by_volume = row(rows, PORTION), row(rows, BY_VOID_STRAIN)
    for place in range(nc):
        i = components[place]
        for col in range(nc):
            c = components[col]
            volume, own = 1.0 if c < 3 else 0.0, 1.0 if c == i else 0.0
            void = volume * by_volume
            put(rows, TANGENT + 6 * place + c, own * portion - void * row(rows, SLOPE + COLUMNS * i + VOID))
            if evolving:
                given = portion * row(rows, LAW_SLOPE + LAW_INPUTS * i + 19 + c)
                by_void = void * row(rows, FABRIC_SLOPE + COLUMNS * i + VOID)
                put(rows, TANGENT + 6 * (nc + place) + c, given - by_void)
        # what a relaxed sub-step left undone is an error too
        error = row(rows, FIRST + i) + row(rows, PLASTIC + i) * (1.0 / row(rows, SHARE) - 1.0)
        if evolving:
            for k in range(6):
                gain = row(rows, Y + FABRIC + k) - row(rows, OLD + FABRIC + k)
                error = error + row(rows, GEO + 6 * i + k) * gain
            put(rows, ERRORS + nc + place, row(rows, GAIN + i) - row(rows, GAIN_END + i))
        put(rows, ERRORS + place, error)


@kernel
def error_norms(rows, components, evolving):
    """Fill the norms of the stress, of its error and of the fabric's error (squared)."""
    nc = components.shape[0]
    zero = 0.0 * row(rows, ERRORS)
    length, stress, fabric = zero, zero, zero
    for place in range(nc):
        own, error = row(rows, Y + components[place]), row(rows, ERRORS + place)
        length, stress = length + own * own, stress + error * error
        if evolving:
            fabric = fabric + row(rows, ERRORS + nc + place) * row(rows, ERRORS + nc + place)
    put(rows, STRESS_NORM, length)
    put(rows, STRESS_ERROR, stress)
    put(rows, FABRIC_ERROR, fabric)
