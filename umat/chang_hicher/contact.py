"""One contact plane, and the sum over all of them.

Everything here is dimensionless: stress over p_ref, force over p_ref r², displacement over 2r (r the grain
radius), which leaves one elastic constant, compliance = √(f_ref p_ref) / k_n0. With f_n, f_t the
normal force and the tangential force vector, R = |f_t| / f_n, and `o` the start of the step [ZK Table 3]:

* elastic displacement, exact on a straight force path:
  δᵉ = C (Δf_n n + Δf_t / k_tR),  C = compliance / (√f_n + √f_no);
* sliding done when the force is reached:  λ = max(λ_o, λ_req),
  λ_req = compliance / (2 k_pR) √f_n · tanφ_p R / (tanφ_p − R);
  (in a relaxed sub-step only a share of λ_req − λ_o, see `integrate`)
* its displacement, direction and dilatancy taken at the middle force f_m = (f + f_o)/2 (second order):
  δᵖ = (λ − λ_o) [t_m + (tanφ_d − R_m) n].

With room = tanφ_p f_n − f_t, λ_req = push tanφ_p / room. Its slope is taken as (d(push tanφ_p) − λ̂ d room) / room, the
exact one for λ̂ = λ_req; λ̂ is the sliding that the last linear step foresaw, where that was another (`docs/theory.md`).
"""

import numpy as np

from ..lanes import LANES, at, kernel, lanes, select
from .rows import (
    BARE,
    BARE_SLIPPED,
    BASE,
    BUFFER,
    BY_DILATANCY,
    BY_FRICTION,
    DILATANCY,
    DISPLACEMENT,
    FABRIC_MIDDLE,
    FACTOR,
    FORCE,
    FORCE_OLD,
    FRESH,
    FRICTION,
    LATE,
    MARGIN,
    PART,
    SHARE,
    SLIPPED,
    STIFFNESS,
    STIFFNESS_SLIPPED,
    SUMS,
    TAKEN,
)  # fmt: skip

TINY = 1e-200
HALF_SQRT2 = 0.5 * 2.0**0.5
SIZE = BUFFER * LANES
VERGE = 0.01  #: relative distance from sliding below which the first look at a sub-step asks where the contact goes
GROUP = 4  #: directions whose contributions are added in one pass over the sums


@kernel
def contact_plane(rows, before, after, kept, tried, out, n, weight, elastic, width):
    """Fill one direction's buffer `out` with displacements and their derivatives, times the direction's weight.

    rows: the lanes, flat; before, after: rows of the sliding done before and after the step; kept, tried: what the
    estimate of the sliding needs of the accepted iterate and of the trial, `GUESS` rows; out: `BUFFER` rows, flat
    (arrays of their own, and constant places in them, or the compiler sees too many overlaps to check);
    elastic: (compliance, 1/k_tR, 1/(2 k_pR)).
    """
    compliance, ease_t, ease_p = elastic
    nx, ny, nz = n
    for l in lanes(width):
        # forces
        bx, by, bz = rows[at(BASE, l)], rows[at(BASE + 1, l)], rows[at(BASE + 2, l)]
        fx = bx + rows[at(FORCE, l)] * nx + rows[at(FORCE + 1, l)] * ny + rows[at(FORCE + 2, l)] * nz
        fy = by + rows[at(FORCE + 3, l)] * nx + rows[at(FORCE + 4, l)] * ny + rows[at(FORCE + 5, l)] * nz
        fz = bz + rows[at(FORCE + 6, l)] * nx + rows[at(FORCE + 7, l)] * ny + rows[at(FORCE + 8, l)] * nz
        gx = bx + rows[at(FORCE_OLD, l)] * nx + rows[at(FORCE_OLD + 1, l)] * ny + rows[at(FORCE_OLD + 2, l)] * nz
        gy = by + rows[at(FORCE_OLD + 3, l)] * nx + rows[at(FORCE_OLD + 4, l)] * ny + rows[at(FORCE_OLD + 5, l)] * nz
        gz = bz + rows[at(FORCE_OLD + 6, l)] * nx + rows[at(FORCE_OLD + 7, l)] * ny + rows[at(FORCE_OLD + 8, l)] * nz
        fn = fx * nx + fy * ny + fz * nz
        gn = np.maximum(gx * nx + gy * ny + gz * nz, 1e-30)
        tx, ty, tz = fx - fn * nx, fy - fn * ny, fz - fn * nz
        hx, hy, hz = gx - gn * nx, gy - gn * ny, gz - gn * nz
        ft = np.sqrt(tx * tx + ty * ty + tz * tz + TINY)
        ux, uy, uz = 0.5 * (tx + hx), 0.5 * (ty + hy), 0.5 * (tz + hz)
        um = np.sqrt(ux * ux + uy * uy + uz * uz + TINY)
        tan_p, tan_d = rows[at(FRICTION, l)], rows[at(DILATANCY, l)]
        room = tan_p * fn - ft
        density = 1.0 + (
            rows[at(FABRIC_MIDDLE, l)] * nx * nx
            + rows[at(FABRIC_MIDDLE + 1, l)] * ny * ny
            + rows[at(FABRIC_MIDDLE + 2, l)] * nz * nz
            + 2.0
            * (
                rows[at(FABRIC_MIDDLE + 3, l)] * ny * nz
                + rows[at(FABRIC_MIDDLE + 4, l)] * nx * nz
                + rows[at(FABRIC_MIDDLE + 5, l)] * nx * ny
            )
        )
        # inside only if force and density are positive; the arithmetic below stays finite in any case
        rows[at(MARGIN, l)] = np.minimum(rows[at(MARGIN, l)], np.minimum(room / gn, density))
        fn = np.maximum(fn, 1e-30)
        space = room
        room = np.maximum(room, 1e-12 * fn)
        w = weight * density
        # elastic
        s, so = np.sqrt(fn), np.sqrt(gn)
        mid = 0.5 * (fn + gn)
        i_ft, i_um, i_fn, i_mid, i_room = 1.0 / ft, 1.0 / um, 1.0 / fn, 1.0 / mid, 1.0 / room
        i_s = s * i_fn
        i_sum = 1.0 / (s + so)
        c = compliance * i_sum
        dc = -0.5 * i_s * c * i_sum
        dn = fn - gn
        ex = dn * nx + ease_t * (tx - hx)
        ey = dn * ny + ease_t * (ty - hy)
        ez = dn * nz + ease_t * (tz - hz)
        # sliding
        ratio = ft * i_fn
        push = ease_p * compliance * s * ft
        required = push * tan_p * i_room
        done = before[l]
        share = rows[at(SHARE, l)]
        slip = share * np.maximum(required - done, 0.0)
        after[l] = done + slip
        # the sliding that the last linear step foresaw; `kept` is where it began
        taken = rows[at(TAKEN, l)] > 0.5
        k_room = select(taken, tried[at(0, l)], kept[at(0, l)])
        k_required = select(taken, tried[at(1, l)], kept[at(1, l)])
        k_slid = select(taken, tried[at(2, l)], kept[at(2, l)])
        kept[at(0, l)], kept[at(1, l)], kept[at(2, l)] = k_room, k_required, k_slid
        change = (required - k_required) * room + (k_required - k_slid) * (room - k_room)
        slid = k_required + change / (rows[at(FACTOR, l)] * k_room)
        near = np.abs(slid - required) < 0.1 * required
        trusted = (k_required > done) & (slid > done) & (rows[at(FRESH, l)] < 0.5)
        slid = select(trusted, select(near, required, slid), required)
        tried[at(0, l)], tried[at(1, l)], tried[at(2, l)] = space, required, slid
        ax, ay, az = tx * i_ft, ty * i_ft, tz * i_ft
        along_n = (0.5 * push * tan_p * i_fn - slid * tan_p) * i_room
        along_t = (ease_p * compliance * s * tan_p + slid) * i_room
        # which contacts slide: at first those on the verge of it that a uniform strain would load
        lx = rows[at(PART, l)] * nx + HALF_SQRT2 * (rows[at(PART + 5, l)] * ny + rows[at(PART + 4, l)] * nz)
        ly = rows[at(PART + 1, l)] * ny + HALF_SQRT2 * (rows[at(PART + 5, l)] * nx + rows[at(PART + 3, l)] * nz)
        lz = rows[at(PART + 2, l)] * nz + HALF_SQRT2 * (rows[at(PART + 4, l)] * nx + rows[at(PART + 3, l)] * ny)
        trend = ease_t * along_n * (lx * nx + ly * ny + lz * nz) + along_t * (lx * ax + ly * ay + lz * az)
        verge = VERGE * rows[at(FRESH, l)] * done
        on = select(required > done - select(trend > 0.0, verge, -verge), share, 0.0)
        qx, qy, qz = (
            on * (along_n * nx + along_t * ax),
            on * (along_n * ny + along_t * ay),
            on * (along_n * nz + along_t * az),
        )
        by_tan = on * (push - slid * fn) * i_room
        # direction of sliding at the middle and at the end
        ux, uy, uz = ux * i_um, uy * i_um, uz * i_um
        ratio_m = um * i_mid
        dilate = tan_d - ratio_m
        mx, my, mz = ux + dilate * nx, uy + dilate * ny, uz + dilate * nz
        late = ratio_m - ratio
        # stiffness of the plastic part: m ⊗ dλ + slip dm/df
        turn = 0.5 * slip * i_um
        fall = 0.5 * slip * i_mid
        vx, vy, vz = ux - ratio_m * nx, uy - ratio_m * ny, uz - ratio_m * nz
        pxx = mx * qx + turn * (1.0 - nx * nx - ux * ux) - fall * nx * vx
        pxy = mx * qy - turn * (nx * ny + ux * uy) - fall * nx * vy
        pxz = mx * qz - turn * (nx * nz + ux * uz) - fall * nx * vz
        pyx = my * qx - turn * (nx * ny + ux * uy) - fall * ny * vx
        pyy = my * qy + turn * (1.0 - ny * ny - uy * uy) - fall * ny * vy
        pyz = my * qz - turn * (ny * nz + uy * uz) - fall * ny * vz
        pzx = mz * qx - turn * (nx * nz + ux * uz) - fall * nz * vx
        pzy = mz * qy - turn * (ny * nz + uy * uz) - fall * nz * vy
        pzz = mz * qz + turn * (1.0 - nz * nz - uz * uz) - fall * nz * vz
        px, py, pz = slip * mx, slip * my, slip * mz
        sx, sy, sz = c * ex + px, c * ey + py, c * ez + pz
        # everything out, times its weight
        out[at(DISPLACEMENT, l)], out[at(DISPLACEMENT + 1, l)], out[at(DISPLACEMENT + 2, l)] = w * sx, w * sy, w * sz
        out[at(SLIPPED, l)], out[at(SLIPPED + 1, l)], out[at(SLIPPED + 2, l)] = w * px, w * py, w * pz
        lag = w * slip
        out[at(LATE, l)] = lag * (ax - ux + late * nx)
        out[at(LATE + 1, l)] = lag * (ay - uy + late * ny)
        out[at(LATE + 2, l)] = lag * (az - uz + late * nz)
        out[at(BY_FRICTION, l)], out[at(BY_FRICTION + 1, l)], out[at(BY_FRICTION + 2, l)] = (
            w * by_tan * mx,
            w * by_tan * my,
            w * by_tan * mz,
        )
        out[at(BY_DILATANCY, l)] = lag
        cn, ct = w * c * (1.0 - ease_t), w * c * ease_t
        wd = w * dc
        out[at(STIFFNESS, l)] = ct + cn * nx * nx + wd * ex * nx + w * pxx
        out[at(STIFFNESS + 1, l)] = cn * nx * ny + wd * ex * ny + w * pxy
        out[at(STIFFNESS + 2, l)] = cn * nx * nz + wd * ex * nz + w * pxz
        out[at(STIFFNESS + 3, l)] = cn * nx * ny + wd * ey * nx + w * pyx
        out[at(STIFFNESS + 4, l)] = ct + cn * ny * ny + wd * ey * ny + w * pyy
        out[at(STIFFNESS + 5, l)] = cn * ny * nz + wd * ey * nz + w * pyz
        out[at(STIFFNESS + 6, l)] = cn * nx * nz + wd * ez * nx + w * pzx
        out[at(STIFFNESS + 7, l)] = cn * ny * nz + wd * ez * ny + w * pzy
        out[at(STIFFNESS + 8, l)] = ct + cn * nz * nz + wd * ez * nz + w * pzz
        out[at(STIFFNESS_SLIPPED, l)], out[at(STIFFNESS_SLIPPED + 1, l)], out[at(STIFFNESS_SLIPPED + 2, l)] = (
            w * pxx,
            w * pxy,
            w * pxz,
        )
        out[at(STIFFNESS_SLIPPED + 3, l)], out[at(STIFFNESS_SLIPPED + 4, l)], out[at(STIFFNESS_SLIPPED + 5, l)] = (
            w * pyx,
            w * pyy,
            w * pyz,
        )
        out[at(STIFFNESS_SLIPPED + 6, l)], out[at(STIFFNESS_SLIPPED + 7, l)], out[at(STIFFNESS_SLIPPED + 8, l)] = (
            w * pzx,
            w * pzy,
            w * pzz,
        )
        out[at(BARE, l)], out[at(BARE + 1, l)], out[at(BARE + 2, l)] = weight * sx, weight * sy, weight * sz
        out[at(BARE_SLIPPED, l)], out[at(BARE_SLIPPED + 1, l)], out[at(BARE_SLIPPED + 2, l)] = (
            weight * px,
            weight * py,
            weight * pz,
        )


@kernel
def add_moments(rows, buffer, table, first, terms, width):
    """Add the buffered rows of `GROUP` directions, times their moments of n, to the sums, three sums at a time.

    terms: (buffer row, three out rows, three columns of the moments); table: the moments of every direction.
    """
    for t in range(terms.shape[0]):
        row, t0, t1, t2 = terms[t, 0], terms[t, 1], terms[t, 2], terms[t, 3]
        c0, c1, c2 = terms[t, 4], terms[t, 5], terms[t, 6]
        a0, a1, a2, a3 = table[first, c0], table[first + 1, c0], table[first + 2, c0], table[first + 3, c0]
        b0, b1, b2, b3 = table[first, c1], table[first + 1, c1], table[first + 2, c1], table[first + 3, c1]
        d0, d1, d2, d3 = table[first, c2], table[first + 1, c2], table[first + 2, c2], table[first + 3, c2]
        for l in lanes(width):
            x0, x1 = buffer[at(row, l)], buffer[at(row + BUFFER, l)]
            x2, x3 = buffer[at(row + 2 * BUFFER, l)], buffer[at(row + 3 * BUFFER, l)]
            rows[at(t0, l)] += x0 * a0 + x1 * a1 + x2 * a2 + x3 * a3
            rows[at(t1, l)] += x0 * b0 + x1 * b1 + x2 * b2 + x3 * b3
            rows[at(t2, l)] += x0 * d0 + x1 * d1 + x2 * d2 + x3 * d3


@kernel
def sum_planes(rows, slide, guess, base, buffer, rule, terms, fabric_terms, elastic, total, evolving, width):
    """Sum displacement, its moments and derivatives over all contact planes, into the rows from `SUMS` on."""
    normals, weights, table = rule
    count = weights.shape[0]
    for i in range(SUMS, SUMS + 210):
        for l in lanes(width):
            rows[at(i, l)] = 0.0
    for first in range(0, count, GROUP):
        for k in range(GROUP):
            a = first + k
            if not total:
                for i in range(3):
                    for l in lanes(width):
                        rows[at(BASE + i, l)] = base[at(3 * a + i, l)]
            n = (normals[a, 0], normals[a, 1], normals[a, 2])
            before, after = slide[a * LANES : (a + 1) * LANES], slide[(count + a) * LANES : (count + a + 1) * LANES]
            kept, tried = guess[6 * a * LANES : (6 * a + 3) * LANES], guess[(6 * a + 3) * LANES : (6 * a + 6) * LANES]
            contact_plane(
                rows, before, after, kept, tried, buffer[k * SIZE : (k + 1) * SIZE], n, weights[a], elastic, width
            )
        add_moments(rows, buffer, table, first, terms, width)
        if evolving:
            add_moments(rows, buffer, table, first, fabric_terms, width)
