"""Residual of one step in every lane, and its Jacobian.

Unknowns: stress and fabric at the end of the step, (σ, F). Equations: ε(σ, F) − Δε = 0 and F − F_o − ΔF = 0, where the
law's ΔF reads F, σ and ψ at the middle of the step and the step's increments of s/p, of strain and of plastic strain.
"""

import numpy as np

from ..fabric.law import INPUTS, active_inputs, increments, slope_of
from ..lanes import at, kernel, lanes
from .balance import PSI, PSI_P, VOID
from .programs import COLUMNS


@kernel
def law_inputs(inputs, y, old, strain, plastic, place, weight):
    """Fill the rows that a fabric law reads, at old + weight (y − old): weight ½ the middle, 1 the end of the step."""
    for i in range(6):
        fabric, stress, given, slip = inputs[i], inputs[6 + i], inputs[19 + i], inputs[25 + i]
        for l in lanes():
            fabric[l] = old[6 + i][l] + weight * (y[6 + i][l] - old[6 + i][l])
            stress[l] = old[i][l] + weight * (y[i][l] - old[i][l])
            given[l] = strain[i][l]
            slip[l] = plastic[i][l]
    psi = inputs[12]
    for l in lanes():
        psi[l] = place[PSI][l]
    for l in lanes():
        p = (y[0][l] + y[1][l] + y[2][l]) / 3.0
        p_old = (old[0][l] + old[1][l] + old[2][l]) / 3.0
        i_p, i_old = 1.0 / np.maximum(p, 1e-12), 1.0 / np.maximum(p_old, 1e-12)
        for i in range(6):
            one = 1.0 if i < 3 else 0.0
            inputs[13 + i][l] = (y[i][l] - p * one) * i_p - (old[i][l] - p_old * one) * i_old


@kernel
def by_ratio(slope, y, out):
    """Fill 6 × 6 rows with the law's derivative through s/p of the stress y."""
    for l in lanes():
        i_p = 3.0 / np.maximum(y[at(0, l)] + y[at(1, l)] + y[at(2, l)], 1e-12)
        for i in range(6):
            row = 31 * i + 13
            pull = 0.0 * i_p
            for k in range(6):
                pull = pull + slope[at(row + k, l)] * y[at(k, l)]
            for k in range(6):
                # d(s/p) = dσ/p − σ tr dσ / (3 p²): the identity part of s drops out
                volumetric = pull * i_p / 3.0 if k < 3 else 0.0
                out[at(6 * i + k, l)] = (slope[at(row + k, l)] - volumetric) * i_p


@kernel
def fabric_rows(law, inputs, gain, slope, ratio_slope, fabric_slope, y, old, place, plastic_slope):
    """Fill the law's increment and the total derivative of F − F_o − ΔF by (σ, F, e), 6 × 13 rows."""
    increments(law, inputs.reshape(-1), gain.reshape(-1))
    slope_of(law, inputs.reshape(-1), slope.reshape(-1))
    active = active_inputs(law)
    ratio = 13 in active
    if ratio:
        by_ratio(slope.reshape(-1), y.reshape(-1), ratio_slope.reshape(-1))
    for i in range(6):
        for k in range(6):
            target, own = fabric_slope[COLUMNS * i + k], slope[INPUTS * i + 6 + k]
            psi, psi_p = slope[INPUTS * i + 12], place[PSI_P]
            third = 1.0 / 3.0 if k < 3 else 0.0
            for l in lanes():
                target[l] = -0.5 * (own[l] - third * psi_p[l] * psi[l])
            if ratio:
                extra = ratio_slope[6 * i + k]
                for l in lanes():
                    target[l] -= extra[l]
            target, own = fabric_slope[COLUMNS * i + 6 + k], slope[INPUTS * i + k]
            one = 1.0 if i == k else 0.0
            for l in lanes():
                target[l] = one - 0.5 * own[l]
        target, psi = fabric_slope[COLUMNS * i + VOID], slope[INPUTS * i + 12]
        for l in lanes():
            target[l] = -0.5 * psi[l]
        for c in range(COLUMNS):
            target = fabric_slope[COLUMNS * i + c]
            for k in range(6):
                by_plastic, plastic = slope[INPUTS * i + 25 + k], plastic_slope[COLUMNS * k + c]
                for l in lanes():
                    target[l] -= by_plastic[l] * plastic[l]


@kernel
def gather_system(matrix, components, strain_slope, fabric_slope, evolving):
    """Copy the Jacobian of the components that do not vanish into the rows of the square system."""
    nc = components.shape[0]
    n = 2 * nc if evolving else nc
    for i in range(nc):
        for j in range(nc):
            a, b = components[i], components[j]
            matrix[i * n + j] = strain_slope[COLUMNS * a + b]
            if evolving:
                matrix[i * n + nc + j] = strain_slope[COLUMNS * a + 6 + b]
                matrix[(nc + i) * n + j] = fabric_slope[COLUMNS * a + b]
                matrix[(nc + i) * n + nc + j] = fabric_slope[COLUMNS * a + 6 + b]
