"""Time of the kernels of the enhanced CH model one by one, and of the bare contact sum; see `stress_point.py`."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from timing import median_time

import umat
from umat.chang_hicher.balance import add_elastic, friction_columns, geometry, strain_and_slope
from umat.chang_hicher.contact import BUFFER, GROUP, add_moments, contact_plane, end_of_step, force, inlined
from umat.chang_hicher.elimination import factorise, solve
from umat.chang_hicher.material import constants_of, rule_of
from umat.chang_hicher.planes import terms
from umat.chang_hicher.pool import make_pool
from umat.chang_hicher.residual import error_norms, fabric_rows, gather, law_inputs, norms, right_hand_sides
from umat.chang_hicher.rows import (
    D_SLIPPED,
    DILATANCY,
    ERRORS,
    FORCE,
    FORCE_OLD,
    FRICTION,
    GEO,
    H_SLIPPED,
    MATRIX,
    NEWTON,
    PLASTIC,
    PLASTIC_GEO,
    PLASTIC_SLOPE,
    SLOPE,
    STRAIN,
    T_SLIPPED,
    TANGENT,
    D,
    H,
    T,
)
from umat.directions import directions
from umat.lanes import LANES, put, row
from umat.sands import toyoura

REPEATS = 2000


@njit
def planes(n, law, constants, rule, terms, pool):
    """All contact planes."""
    for _ in range(n):
        for a in range(rule.used):
            contact_plane(
                pool.rows, pool.slide, pool.guess, pool.start, pool.base, pool.buffer, (a % GROUP) * BUFFER, rule, a,
                constants.elastic, True, row(pool.rows, FRICTION), False,
            )  # fmt: skip


@njit
def moments(n, law, constants, rule, terms, pool):
    """The sums of every evaluation."""
    for _ in range(n):
        for first in range(0, rule.weights.shape[0], GROUP):
            add_moments(pool.rows, pool.buffer, rule.table, first, terms.always)


@njit
def last_moments(n, law, constants, rule, terms, pool):
    """The sums of the last evaluation."""
    for _ in range(n):
        for first in range(0, rule.weights.shape[0], GROUP):
            add_moments(pool.rows, pool.buffer, rule.table, first, terms.final)
            add_moments(pool.rows, pool.buffer, rule.table, first, terms.density)


@njit
def slopes(n, law, constants, rule, terms, pool):
    """Averages and slopes from the sums."""
    for _ in range(n):
        geometry(pool.rows, constants.line, constants.tan_mu, True)
        add_elastic(pool.rows)
        friction_columns(pool.rows)
        strain_and_slope(pool.rows, D, H, T, STRAIN, SLOPE, GEO, True, True, True)
        strain_and_slope(
            pool.rows, D_SLIPPED, H_SLIPPED, T_SLIPPED, PLASTIC, PLASTIC_SLOPE, PLASTIC_GEO, True, True, True
        )


@njit
def fabric(n, law, constants, rule, terms, pool):
    """The fabric law and its slope."""
    for _ in range(n):
        law_inputs(pool.rows, 0.5)
        fabric_rows(law, pool.rows)


@njit
def linear(n, law, constants, rule, terms, pool):
    """The system of one Newton step."""
    for _ in range(n):
        gather(pool.rows, terms.components, True)
        norms(pool.rows, terms.components, True)
        factorise(pool.rows, MATRIX, 12)
        solve(pool.rows, MATRIX, NEWTON, 12, 1)


@njit
def last_linear(n, law, constants, rule, terms, pool):
    """Tangent, error and the sliding at the end."""
    for _ in range(n):
        right_hand_sides(pool.rows, terms.components, True)
        solve(pool.rows, MATRIX, TANGENT, 12, 6)
        solve(pool.rows, MATRIX, ERRORS, 12, 1)
        error_norms(pool.rows, terms.components, True)


@njit
def last_planes(n, law, constants, rule, terms, pool):
    """The sliding of the corrected state."""
    for _ in range(n):
        end_of_step(pool.rows, pool.slide, pool.base, rule, constants.elastic, True)


@inlined
def bare_plane(rows, slide, base, rule, a, elastic):
    """Return displacement of one plane, nothing else."""
    compliance, ease_t, ease_p = elastic
    nx, ny, nz = n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
    fx, fy, fz = force(rows, FORCE, base, a, n, True)
    gx, gy, gz = force(rows, FORCE_OLD, base, a, n, True)
    fn, gn = fx * nx + fy * ny + fz * nz, gx * nx + gy * ny + gz * nz
    tx, ty, tz = fx - fn * nx, fy - fn * ny, fz - fn * nz
    ft = np.sqrt(tx * tx + ty * ty + tz * tz)
    s = np.sqrt(fn)
    c = compliance / (s + np.sqrt(gn))
    tan_p = row(rows, FRICTION)
    required = (ease_p * compliance) * s * ft * tan_p / (tan_p * fn - ft)
    slip = np.maximum(required - row(slide, a), 0.0)
    along, normal = c * ease_t + slip / ft, c * (fn - gn) + slip * (row(rows, DILATANCY) - ft / fn)
    return along * tx + normal * nx, along * ty + normal * ny, along * tz + normal * nz


@njit
def bare(n, law, constants, rule, terms, pool):
    """Displacement of every contact plane and its sum Σ w δ ⊗ n: no derivative, no fabric."""
    rows = pool.rows
    for _ in range(n):
        for i in range(9):
            put(rows, D + i, 0.0)
        for a in range(rule.used):
            x, y, z = bare_plane(rows, pool.slide, pool.base, rule, a, constants.elastic)
            for k in range(3):
                w = rule.weights[a] * rule.normals[a, k]
                put(rows, D + k, row(rows, D + k) + w * x)
                put(rows, D + 3 + k, row(rows, D + 3 + k) + w * y)
                put(rows, D + 6 + k, row(rows, D + 6 + k) + w * z)


def per_point(kernel: Callable[..., Any]) -> float:
    """Return µs per point of a kernel on lanes at rest."""
    material, rule = toyoura(), rule_of(directions("bazant_oh_37"))
    pool = make_pool(len(rule.weights), True)
    arguments = (material.law, constants_of(material), rule, terms(False), pool)
    kernel(1, *arguments)
    with np.errstate(all="ignore"):
        return median_time(lambda: kernel(REPEATS, *arguments), 7, time.process_time) / REPEATS / LANES * 1e6


def bare_sum() -> float:
    """Return µs per point of one bare contact sum."""
    return per_point(bare)


def parts(evaluations: float) -> dict[str, float]:
    """Return µs per point of each part of an update with so many evaluations, one of them full."""
    umat.set_threads(1)
    return {
        "contacts": evaluations * per_point(planes) + per_point(last_planes),
        "moments of the directions": evaluations * per_point(moments) + per_point(last_moments),
        "averages and slopes": evaluations * per_point(slopes),
        "fabric law": evaluations * per_point(fabric),
        "linear algebra": evaluations * per_point(linear) + per_point(last_linear),
    }
