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

With n ⊗ n and the rest of the elastic part kept apart, its stiffness is C_t (1 − n ⊗ n) + (C_n n + C' e) ⊗ n, e what C
multiplies: `BY_TANGENT` and `BY_NORMAL`, which need fewer sums over the directions than nine entries would.

With room = tanφ_p f_n − f_t, λ_req = push tanφ_p / room. Its slope is taken as (d(push tanφ_p) − λ̂ d room) / room, the
exact one for λ̂ = λ_req; λ̂ is the sliding that the last linear step foresaw, where that was another (`docs/theory.md`).
"""

import numpy as np

from ..lanes import inlined, kernel, nine, put, row, select, six, store
from .rows import (
    BARE,
    BARE_SLIPPED,
    BUFFER,
    BY_DILATANCY,
    BY_FRICTION,
    BY_NORMAL,
    BY_TANGENT,
    DILATANCY,
    DISPLACEMENT,
    FABRIC_MIDDLE,
    FACTOR,
    FINAL,
    FORCE,
    FORCE_OLD,
    FRESH,
    FRICTION,
    LATE,
    MARGIN,
    PART,
    SHARE,
    SLIPPED,
    STIFFNESS_SLIPPED,
    SUMS,
    TAKEN,
)  # fmt: skip

TINY = 1e-200
HALF_SQRT2 = 0.5 * 2.0**0.5
VERGE = 0.01  #: relative distance from sliding below which the first look at a sub-step asks where the contact goes
GROUP = 4  #: directions whose contributions are added in one pass over the sums


@inlined
def force(rows, first, base, a, n, total):
    """Return the force on plane a, from the nine rows of Z and, in the rate form, from what it was at the start."""
    nx, ny, nz = n
    z = nine(rows, first)
    x, y, z = z[0] * nx + z[1] * ny + z[2] * nz, z[3] * nx + z[4] * ny + z[5] * nz, z[6] * nx + z[7] * ny + z[8] * nz
    if not total:
        x, y, z = x + row(base, 3 * a), y + row(base, 3 * a + 1), z + row(base, 3 * a + 2)
    return x, y, z


@inlined
def quadratic(a, n):
    """Return n·a·n of six plain components."""
    nx, ny, nz = n
    return (
        a[0] * (nx * nx)
        + a[1] * (ny * ny)
        + a[2] * (nz * nz)
        + a[3] * (2.0 * ny * nz)
        + a[4] * (2.0 * nx * nz)
        + a[5] * (2.0 * nx * ny)
    )


@inlined
def estimate(rows, guess, a, per_factor, room, required, done):
    """Return the sliding that the last linear step foresaw; remember for the next one where this step began.

    A direction has 1/room (the room itself where that is not positive), the sliding required and that estimated, of the
    accepted iterate in rows 0 to 2 and of the last trial in rows 3 to 5.
    """
    taken = row(rows, TAKEN) > 0.5
    per_room = select(taken, row(guess, 6 * a + 3), row(guess, 6 * a))
    k_required = select(taken, row(guess, 6 * a + 4), row(guess, 6 * a + 1))
    k_slid = select(taken, row(guess, 6 * a + 5), row(guess, 6 * a + 2))
    store(guess, 6 * a, (per_room, k_required, k_slid))
    relative = room * per_room
    change = (required - k_required) * relative + (k_required - k_slid) * (relative - 1.0)
    slid = k_required + change * per_factor
    near = np.abs(slid - required) < 0.1 * required
    trusted = (k_required > done) & (slid > done) & (row(rows, FRESH) < 0.5)
    return select(trusted, select(near, required, slid), required)


@inlined
def loading(rows, n, t):
    """Return the normal component of the strain of a plane, and that along t."""
    nx, ny, nz = n
    e = six(rows, PART)
    x = e[0] * nx + e[5] * (HALF_SQRT2 * ny) + e[4] * (HALF_SQRT2 * nz)
    y = e[1] * ny + e[5] * (HALF_SQRT2 * nx) + e[3] * (HALF_SQRT2 * nz)
    z = e[2] * nz + e[4] * (HALF_SQRT2 * nx) + e[3] * (HALF_SQRT2 * ny)
    return x * nx + y * ny + z * nz, x * t[0] + y * t[1] + z * t[2]


@inlined
def contact_plane(rows, slide, guess, start, base, buffer, out, rule, a, elastic, total, per_factor, fresh):
    """Write one direction's displacement and its derivatives, times the direction's weight, from row `out` on.

    slide: sliding done before and after the step; guess: what `estimate` needs, `GUESS` rows a direction; elastic:
    (compliance, 1/k_tR, 1/(2 k_pR)).
    """
    compliance, ease_t, ease_p = elastic
    weight, count = rule.weights[a], rule.weights.shape[0]
    nx, ny, nz = n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
    # forces
    fx, fy, fz = force(rows, FORCE, base, a, n, total)
    fn = fx * nx + fy * ny + fz * nz
    tx, ty, tz = fx - fn * nx, fy - fn * ny, fz - fn * nz
    if fresh:
        gx, gy, gz = force(rows, FORCE_OLD, base, a, n, total)
        gn = np.maximum(gx * nx + gy * ny + gz * nz, 1e-30)
        store(start, 5 * a, (gn, np.sqrt(gn), gx - gn * nx, gy - gn * ny, gz - gn * nz))
    gn, so, hx, hy, hz = (
        row(start, 5 * a),
        row(start, 5 * a + 1),
        row(start, 5 * a + 2),
        row(start, 5 * a + 3),
        row(start, 5 * a + 4),
    )
    ft = np.sqrt(tx * tx + ty * ty + tz * tz + TINY)
    ux, uy, uz = tx + hx, ty + hy, tz + hz
    um = np.sqrt(ux * ux + uy * uy + uz * uz + TINY)
    tan_p = row(rows, FRICTION)
    space = tan_p * fn - ft
    density = 1.0 + quadratic(six(rows, FABRIC_MIDDLE), n)
    # inside only if force and density are positive; the arithmetic below stays finite in any case
    put(rows, MARGIN, np.minimum(row(rows, MARGIN), np.minimum(space, density)))
    fn = np.maximum(fn, 1e-30)
    room = np.maximum(space, 1e-12 * fn)
    w = weight * density
    # elastic
    s = np.sqrt(fn)
    middle = fn + gn
    inverse = 1.0 / (ft * um)
    i_ft, i_um = inverse * um, inverse * ft
    inverse = 1.0 / (fn * room)
    i_fn, i_room = inverse * room, inverse * fn
    inverse = 1.0 / (middle * (s + so))
    i_middle, c = inverse * (s + so), compliance * inverse * middle
    dn = fn - gn
    ex, ey, ez = dn * nx + ease_t * (tx - hx), dn * ny + ease_t * (ty - hy), dn * nz + ease_t * (tz - hz)
    # sliding
    stiff = (ease_p * compliance) * s
    push = stiff * ft
    required = push * tan_p * i_room
    done, share = row(slide, a), row(rows, SHARE)
    slip = share * np.maximum(required - done, 0.0)
    put(slide, count + a, done + slip)
    slid = estimate(rows, guess, a, per_factor, room, required, done)
    store(guess, 6 * a + 3, (select(space > 0.0, i_room, space), required, slid))
    ax, ay, az = tx * i_ft, ty * i_ft, tz * i_ft
    along_n = (0.5 * push * i_fn - slid) * tan_p * i_room
    along_t = (stiff * tan_p + slid) * i_room
    # which contacts slide: at first those on the verge of it that a uniform strain would load
    on = select(required > done, share, 0.0)
    if fresh:
        strain_n, strain_t = loading(rows, n, (ax, ay, az))
        verge = VERGE * row(rows, FRESH) * (1.0 - row(rows, FINAL)) * done
        trend = ease_t * along_n * strain_n + along_t * strain_t
        on = select(required > done - select(trend > 0.0, verge, -verge), share, 0.0)
    along_n, along_t = on * along_n, on * along_t
    qx, qy, qz = along_n * nx + along_t * ax, along_n * ny + along_t * ay, along_n * nz + along_t * az
    # direction of sliding at the middle and at the end
    ux, uy, uz = ux * i_um, uy * i_um, uz * i_um
    ratio = um * i_middle
    dilate = row(rows, DILATANCY) - ratio
    mx, my, mz = ux + dilate * nx, uy + dilate * ny, uz + dilate * nz
    # stiffness of the plastic part: m ⊗ dλ + slip dm/df
    lag = w * slip
    turn, fall = lag * i_um, lag * i_middle
    vx, vy, vz = ux - ratio * nx, uy - ratio * ny, uz - ratio * nz
    wx, wy, wz = w * mx, w * my, w * mz
    fx, fy, fz = fall * nx, fall * ny, fall * nz
    xy, xz, yz = turn * (nx * ny + ux * uy), turn * (nx * nz + ux * uz), turn * (ny * nz + uy * uz)
    put(buffer, out + STIFFNESS_SLIPPED, wx * qx + turn * ((1.0 - nx * nx) - ux * ux) - fx * vx)
    put(buffer, out + STIFFNESS_SLIPPED + 1, wx * qy - xy - fx * vy)
    put(buffer, out + STIFFNESS_SLIPPED + 2, wx * qz - xz - fx * vz)
    put(buffer, out + STIFFNESS_SLIPPED + 3, wy * qx - xy - fy * vx)
    put(buffer, out + STIFFNESS_SLIPPED + 4, wy * qy + turn * ((1.0 - ny * ny) - uy * uy) - fy * vy)
    put(buffer, out + STIFFNESS_SLIPPED + 5, wy * qz - yz - fy * vz)
    put(buffer, out + STIFFNESS_SLIPPED + 6, wz * qx - xz - fz * vx)
    put(buffer, out + STIFFNESS_SLIPPED + 7, wz * qy - yz - fz * vy)
    put(buffer, out + STIFFNESS_SLIPPED + 8, wz * qz + turn * ((1.0 - nz * nz) - uz * uz) - fz * vz)
    # the elastic part
    put(buffer, out + BY_TANGENT, (w * c) * ease_t)
    cn = (w * c) * (1.0 - ease_t)
    wd = (-0.5 / compliance) * (w * c) * (s * i_fn * c)
    put(buffer, out + BY_NORMAL, cn * nx + wd * ex)
    put(buffer, out + BY_NORMAL + 1, cn * ny + wd * ey)
    put(buffer, out + BY_NORMAL + 2, cn * nz + wd * ez)
    # displacements, times their weight, and as if the fabric were isotropic
    px, py, pz = slip * mx, slip * my, slip * mz
    sx, sy, sz = c * ex + px, c * ey + py, c * ez + pz
    by_tan = w * on * (push - slid * fn) * i_room
    late = ratio - ft * i_fn
    store(buffer, out + DISPLACEMENT, (w * sx, w * sy, w * sz))
    store(buffer, out + SLIPPED, (w * px, w * py, w * pz))
    store(buffer, out + LATE, (lag * (ax - ux + late * nx), lag * (ay - uy + late * ny), lag * (az - uz + late * nz)))
    store(buffer, out + BY_FRICTION, (by_tan * mx, by_tan * my, by_tan * mz))
    put(buffer, out + BY_DILATANCY, lag)
    store(buffer, out + BARE, (weight * sx, weight * sy, weight * sz))
    store(buffer, out + BARE_SLIPPED, (weight * px, weight * py, weight * pz))


@kernel
def add_moments(rows, buffer, table, first, terms):
    """Add the buffered rows of `GROUP` directions, times their moments of n, to the sums, three sums at a time.

    terms: (buffer row, three out rows, three columns of the moments); table: the moments of every direction.
    """
    for t in range(terms.shape[0]):
        at_a, at_b, at_c = terms[t, 1], terms[t, 2], terms[t, 3]
        a, b, c = row(rows, at_a), row(rows, at_b), row(rows, at_c)
        for k in range(GROUP):
            x = row(buffer, terms[t, 0] + k * BUFFER)
            a = a + x * table[first + k, terms[t, 4]]
            b = b + x * table[first + k, terms[t, 5]]
            c = c + x * table[first + k, terms[t, 6]]
        put(rows, at_a, a)
        put(rows, at_b, b)
        put(rows, at_c, c)


@kernel
def sum_planes(rows, slide, guess, start, base, buffer, rule, terms, elastic, total, evolving, full, fresh):
    """Sum displacement, its moments and derivatives over all contact planes, into the rows from `SUMS` on.

    full: whether the sums that only error and tangent need are wanted; fresh: whether some lane begins a sub-step.
    """
    count, per_factor = rule.weights.shape[0], 1.0 / row(rows, FACTOR)
    for i in range(192):
        put(rows, SUMS + i, 0.0)
    for first in range(0, count, GROUP):
        # what is missing in the last group has no weight in the table; the buffer keeps older numbers there
        for k in range(min(GROUP, rule.used - first)):
            contact_plane(
                rows, slide, guess, start, base, buffer, k * BUFFER, rule, first + k, elastic, total, per_factor, fresh
            )
        add_moments(rows, buffer, rule.table, first, terms.always)
        if full:
            add_moments(rows, buffer, rule.table, first, terms.final)
            if evolving:
                add_moments(rows, buffer, rule.table, first, terms.density)


@kernel
def end_of_step(rows, slide, base, rule, elastic, total):
    """Write the sliding done at the end of a step whose forces have been corrected."""
    compliance, _, ease_p = elastic
    count = rule.weights.shape[0]
    for a in range(count):
        nx, ny, nz = n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
        fx, fy, fz = force(rows, FORCE, base, a, n, total)
        fn = fx * nx + fy * ny + fz * nz
        tx, ty, tz = fx - fn * nx, fy - fn * ny, fz - fn * nz
        ft = np.sqrt(tx * tx + ty * ty + tz * tz + TINY)
        tan_p = row(rows, FRICTION)
        room = tan_p * fn - ft
        required = (ease_p * compliance) * np.sqrt(fn) * ft * tan_p / room
        done = row(slide, a)
        new = done + row(rows, SHARE) * np.maximum(required - done, 0.0)
        put(slide, count + a, select(room > 0.0, new, row(slide, count + a)))
