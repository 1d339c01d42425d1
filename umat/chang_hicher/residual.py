"""Residual of one step in every lane, its Jacobian, and the vectors that go with it.

Unknowns: stress and fabric at the end of the step, (σ, F). Equations: ε(σ, F) − Δε = 0 and F − F_o − ΔF = 0, where the
law's ΔF reads F, σ and ψ at the middle of the step and the step's increments of s/p, of strain and of plastic strain.
"""

import numpy as np

from ..fabric.law import active_inputs, increments, six, slope_of
from ..lanes import LANES, at, kernel, lanes
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
def law_inputs(rows, weight, width):
    """Fill what a fabric law reads, at old + weight (new − old): weight ½ the middle, 1 the end of the step."""
    for i in range(6):
        for l in lanes(width):
            stress, fabric = rows[at(OLD + i, l)], rows[at(OLD + FABRIC + i, l)]
            rows[at(INPUTS + i, l)] = fabric + weight * (rows[at(Y + FABRIC + i, l)] - fabric)
            rows[at(INPUTS + 6 + i, l)] = stress + weight * (rows[at(Y + i, l)] - stress)
            rows[at(INPUTS + 19 + i, l)] = rows[at(PART + i, l)]
            rows[at(INPUTS + 25 + i, l)] = rows[at(PLASTIC + i, l)]
    for l in lanes(width):
        rows[at(INPUTS + 12, l)] = rows[at(PSI, l)]
        i_p = 3.0 / np.maximum(rows[at(Y, l)] + rows[at(Y + 1, l)] + rows[at(Y + 2, l)], 1e-12)
        i_old = 3.0 / np.maximum(rows[at(OLD, l)] + rows[at(OLD + 1, l)] + rows[at(OLD + 2, l)], 1e-12)
        # the identity part of s/p is the same at both ends
        for i in range(6):
            rows[at(INPUTS + 13 + i, l)] = rows[at(Y + i, l)] * i_p - rows[at(OLD + i, l)] * i_old


@kernel
def by_ratio(rows, state, out, width):
    """Fill 6 × 6 rows with the law's derivative through s/p at the stress of `state`."""
    for i in range(6):
        row = LAW_SLOPE + LAW_INPUTS * i + 13
        for l in lanes(width):
            d, y = six(rows, row, l), six(rows, state, l)
            i_p = 3.0 / np.maximum(y[0] + y[1] + y[2], 1e-12)
            # d(s/p) = dσ/p − σ tr dσ / (3 p²)
            pull = (d[0] * y[0] + d[1] * y[1] + d[2] * y[2] + d[3] * y[3] + d[4] * y[4] + d[5] * y[5]) * i_p / 3.0
            for k in range(6):
                volumetric = pull if k < 3 else 0.0
                rows[at(out + 6 * i + k, l)] = (rows[at(row + k, l)] - volumetric) * i_p


@kernel
def fabric_rows(law, rows, width):
    """Fill the law's increment and the total derivative of F − F_o − ΔF by (σ, F, e), 6 × 13 rows."""
    inputs, slope = rows[INPUTS * LANES : (INPUTS + LAW_INPUTS) * LANES], rows[LAW_SLOPE * LANES :]
    increments(law, inputs, rows[GAIN * LANES : (GAIN + 6) * LANES], width)
    slope_of(law, inputs, slope, width)
    ratio = 13 in active_inputs(law)
    if ratio:
        by_ratio(rows, Y, RATIO_SLOPE, width)
    for i in range(6):
        own, out = LAW_SLOPE + LAW_INPUTS * i, FABRIC_SLOPE + COLUMNS * i
        for k in range(6):
            third, one = 1.0 / 3.0 if k < 3 else 0.0, 1.0 if i == k else 0.0
            for l in lanes(width):
                by_psi = third * rows[at(PSI_P, l)] * rows[at(own + 12, l)]
                rows[at(out + k, l)] = -0.5 * (rows[at(own + 6 + k, l)] - by_psi)
                rows[at(out + FABRIC + k, l)] = one - 0.5 * rows[at(own + k, l)]
            if ratio:
                for l in lanes(width):
                    rows[at(out + k, l)] -= rows[at(RATIO_SLOPE + 6 * i + k, l)]
        for l in lanes(width):
            rows[at(out + VOID, l)] = -0.5 * rows[at(own + 12, l)]
        for c in range(COLUMNS):
            by_plastic(rows, out + c, own + 25, PLASTIC_SLOPE + c, width)


@kernel
def by_plastic(rows, out, law, plastic, width):
    """Subtract the product of a row of the law's derivative with a column of the plastic strain's."""
    for l in lanes(width):
        d = six(rows, law, l)
        rows[at(out, l)] -= (
            d[0] * rows[at(plastic, l)]
            + d[1] * rows[at(plastic + COLUMNS, l)]
            + d[2] * rows[at(plastic + 2 * COLUMNS, l)]
            + d[3] * rows[at(plastic + 3 * COLUMNS, l)]
            + d[4] * rows[at(plastic + 4 * COLUMNS, l)]
            + d[5] * rows[at(plastic + 5 * COLUMNS, l)]
        )


@kernel
def copy(rows, target, source, width):
    """Copy a row."""
    for l in lanes(width):
        rows[at(target, l)] = rows[at(source, l)]


@kernel
def gather(rows, components, evolving, width):
    """Fill the square system of the components that do not vanish, and minus its residual."""
    nc = components.shape[0]
    n = 2 * nc if evolving else nc
    for i in range(nc):
        a = components[i]
        for l in lanes(width):
            rows[at(NEWTON + i, l)] = rows[at(PART + a, l)] - rows[at(STRAIN + a, l)]
        for j in range(nc):
            b = components[j]
            copy(rows, MATRIX + i * n + j, SLOPE + COLUMNS * a + b, width)
            if evolving:
                copy(rows, MATRIX + i * n + nc + j, SLOPE + COLUMNS * a + FABRIC + b, width)
                copy(rows, MATRIX + (nc + i) * n + j, FABRIC_SLOPE + COLUMNS * a + b, width)
                copy(rows, MATRIX + (nc + i) * n + nc + j, FABRIC_SLOPE + COLUMNS * a + FABRIC + b, width)
        if evolving:
            for l in lanes(width):
                rows[at(NEWTON + nc + i, l)] = (
                    rows[at(GAIN + a, l)] - rows[at(Y + FABRIC + a, l)] + rows[at(OLD + FABRIC + a, l)]
                )


@kernel
def norms(rows, components, evolving, width):
    """Fill the norm of the residual as a strain, and of the sub-step's strain."""
    nc = components.shape[0]
    for l in lanes(width):
        rows[at(NORM, l)], rows[at(LENGTH, l)] = 0.0, 0.0
    for i in range(nc):
        for l in lanes(width):
            rows[at(NORM, l)] += rows[at(NEWTON + i, l)] ** 2
        if evolving:
            for l in lanes(width):
                rows[at(NORM, l)] += (FABRIC_WEIGHT * rows[at(NEWTON + nc + i, l)]) ** 2
    for i in range(6):
        for l in lanes(width):
            rows[at(LENGTH, l)] += rows[at(PART + i, l)] ** 2
    for l in lanes(width):
        rows[at(NORM, l)] = np.sqrt(rows[at(NORM, l)])
        rows[at(LENGTH, l)] = np.sqrt(rows[at(LENGTH, l)])


@kernel
def right_hand_sides(rows, components, evolving, width):
    """Fill the tangent's columns (as if nothing depended on the start) and the error's column."""
    nc = components.shape[0]
    for row in range(nc):
        i = components[row]
        for col in range(nc):
            c = components[col]
            volume, own = 1.0 if c < 3 else 0.0, 1.0 if c == i else 0.0
            out = TANGENT + 6 * row + c
            for l in lanes(width):
                void = volume * rows[at(BY_VOID_STRAIN, l)]
                rows[at(out, l)] = own * rows[at(PORTION, l)] - void * rows[at(SLOPE + COLUMNS * i + VOID, l)]
            if evolving:
                out = TANGENT + 6 * (nc + row) + c
                for l in lanes(width):
                    void = volume * rows[at(BY_VOID_STRAIN, l)]
                    given = rows[at(PORTION, l)] * rows[at(LAW_SLOPE + LAW_INPUTS * i + 19 + c, l)]
                    rows[at(out, l)] = given - void * rows[at(FABRIC_SLOPE + COLUMNS * i + VOID, l)]
        for l in lanes(width):
            # what a relaxed sub-step left undone is an error too
            undone = rows[at(PLASTIC + i, l)] * (1.0 / rows[at(SHARE, l)] - 1.0)
            rows[at(ERRORS + row, l)] = rows[at(FIRST + i, l)] + undone
        if evolving:
            for k in range(6):
                for l in lanes(width):
                    gain = rows[at(Y + FABRIC + k, l)] - rows[at(OLD + FABRIC + k, l)]
                    rows[at(ERRORS + row, l)] += rows[at(GEO + 6 * i + k, l)] * gain
            for l in lanes(width):
                rows[at(ERRORS + nc + row, l)] = rows[at(GAIN + i, l)] - rows[at(GAIN_END + i, l)]


@kernel
def error_norms(rows, components, evolving, width):
    """Fill the norms of the stress, of its error and of the fabric's error (squared)."""
    nc = components.shape[0]
    for l in lanes(width):
        rows[at(STRESS_NORM, l)], rows[at(STRESS_ERROR, l)], rows[at(FABRIC_ERROR, l)] = 0.0, 0.0, 0.0
    for row in range(nc):
        for l in lanes(width):
            rows[at(STRESS_NORM, l)] += rows[at(Y + components[row], l)] ** 2
            rows[at(STRESS_ERROR, l)] += rows[at(ERRORS + row, l)] ** 2
        if evolving:
            for l in lanes(width):
                rows[at(FABRIC_ERROR, l)] += rows[at(ERRORS + nc + row, l)] ** 2
