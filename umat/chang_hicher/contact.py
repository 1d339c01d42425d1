"""One contact plane, and the sum over all of them.

Everything here is dimensionless: stress over p_ref, force over p_ref r², displacement over 2r (r the grain
radius), which leaves one elastic constant, compliance = √(f_ref p_ref) / k_n0. With f_n, f_t the
normal force and the tangential force vector, R = |f_t| / f_n, and `o` the start of the step [ZK Table 3]:

* elastic displacement, exact on a straight force path:
  δᵉ = C (Δf_n n + Δf_t / k_tR),  C = compliance / (√f_n + √f_no) · [1 + g (f_n + √(f_n f_no) + f_no) / (f_n f_no)^{3/2}]
  with g = f_gap²: below the force f_gap a contact softens smoothly and opens, it never pulls;
* sliding done when the force is reached:  λ = max(λ_o, λ_req),
  λ_req = compliance / (2 k_pR) √f_n · tanφ_p R / (tanφ_p − R);
* its displacement, direction and dilatancy taken at the middle force f_m = (f + f_o)/2 (second order):
  δᵖ = (λ − λ_o) [t_m + (tanφ_d − R_m) n].
"""

import numpy as np

from ..lanes import at, kernel, lanes, select
from .programs import BUFFER_ROWS

# rows of the lanes' workspace that a contact plane reads (and the margin, which it lowers)
FORCE, FORCE_OLD, FRICTION, DILATANCY, FABRIC, MARGIN, BASE, PLANE_ROWS = 0, 9, 18, 19, 20, 26, 27, 30
TINY = 1e-200


@kernel
def contact_plane(work, sliding, sliding_new, out, n, weight, elastic):
    """Fill one direction's buffer `out` with displacements and their derivatives, times the direction's weight.

    work: the lanes' rows `FORCE`…`BASE`, flat; sliding, sliding_new: this direction's row; out: `BUFFER_ROWS` rows, flat;
    elastic: (compliance, 1/k_tR, 1/(2 k_pR), f_gap²).
    """
    compliance, ease_t, ease_p, gap = elastic
    nx, ny, nz = n
    for l in lanes():
        # forces
        bx, by, bz = work[at(27, l)], work[at(28, l)], work[at(29, l)]
        fx = bx + work[at(0, l)] * nx + work[at(1, l)] * ny + work[at(2, l)] * nz
        fy = by + work[at(3, l)] * nx + work[at(4, l)] * ny + work[at(5, l)] * nz
        fz = bz + work[at(6, l)] * nx + work[at(7, l)] * ny + work[at(8, l)] * nz
        gx = bx + work[at(9, l)] * nx + work[at(10, l)] * ny + work[at(11, l)] * nz
        gy = by + work[at(12, l)] * nx + work[at(13, l)] * ny + work[at(14, l)] * nz
        gz = bz + work[at(15, l)] * nx + work[at(16, l)] * ny + work[at(17, l)] * nz
        fn = fx * nx + fy * ny + fz * nz
        gn = np.maximum(gx * nx + gy * ny + gz * nz, 1e-30)
        tx, ty, tz = fx - fn * nx, fy - fn * ny, fz - fn * nz
        hx, hy, hz = gx - gn * nx, gy - gn * ny, gz - gn * nz
        ft = np.sqrt(tx * tx + ty * ty + tz * tz + TINY)
        ux, uy, uz = 0.5 * (tx + hx), 0.5 * (ty + hy), 0.5 * (tz + hz)
        um = np.sqrt(ux * ux + uy * uy + uz * uz + TINY)
        tan_p, tan_d = work[at(18, l)], work[at(19, l)]
        room = tan_p * fn - ft
        density = 1.0 + (
            work[at(20, l)] * nx * nx
            + work[at(21, l)] * ny * ny
            + work[at(22, l)] * nz * nz
            + 2.0 * (work[at(23, l)] * ny * nz + work[at(24, l)] * nx * nz + work[at(25, l)] * nx * ny)
        )
        # inside only if force and density are positive; the arithmetic below stays finite in any case
        work[at(26, l)] = np.minimum(work[at(26, l)], np.minimum(room / gn, density))
        fn = np.maximum(fn, 1e-30)
        room = np.maximum(room, 1e-12 * fn)
        w = weight * density
        # elastic
        s, so = np.sqrt(fn), np.sqrt(gn)
        mid = 0.5 * (fn + gn)
        i_ft, i_um, i_fn, i_mid, i_room = 1.0 / ft, 1.0 / um, 1.0 / fn, 1.0 / mid, 1.0 / room
        i_s = s * i_fn
        i_sum = 1.0 / (s + so)
        i_so = 1.0 / so
        opening = gap * i_s * i_s * i_s * i_so * i_so * i_so
        shape = fn + s * so + gn
        easy = compliance * i_sum
        c = easy * (1.0 + opening * shape)
        dc = 0.5 * i_s * (-c * i_sum + easy * opening * (2.0 * s + so - 3.0 * shape * i_s))
        dn = fn - gn
        ex = dn * nx + ease_t * (tx - hx)
        ey = dn * ny + ease_t * (ty - hy)
        ez = dn * nz + ease_t * (tz - hz)
        # sliding
        ratio = ft * i_fn
        need = ease_p * compliance * tan_p
        required = need * s * ft * i_room
        before = sliding[l]
        slip = np.maximum(required - before, 0.0)
        on = select(required > before, 1.0, 0.0)
        sliding_new[l] = before + slip
        ax, ay, az = tx * i_ft, ty * i_ft, tz * i_ft
        by_ratio = need * s * tan_p * fn * fn * i_room * i_room
        along_n = required * 0.5 * i_fn - by_ratio * ratio * i_fn
        along_t = by_ratio * i_fn
        qx, qy, qz = on * (along_n * nx + along_t * ax), on * (along_n * ny + along_t * ay), on * (along_n * nz + along_t * az)
        by_tan = -on * ease_p * compliance * s * ft * ft * i_room * i_room
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
        out[at(0, l)], out[at(1, l)], out[at(2, l)] = w * sx, w * sy, w * sz
        out[at(3, l)], out[at(4, l)], out[at(5, l)] = w * px, w * py, w * pz
        lag = w * slip
        out[at(6, l)] = lag * (ax - ux + late * nx)
        out[at(7, l)] = lag * (ay - uy + late * ny)
        out[at(8, l)] = lag * (az - uz + late * nz)
        out[at(9, l)], out[at(10, l)], out[at(11, l)] = w * by_tan * mx, w * by_tan * my, w * by_tan * mz
        out[at(12, l)] = lag
        cn, ct = w * c * (1.0 - ease_t), w * c * ease_t
        wd = w * dc
        out[at(13, l)] = ct + cn * nx * nx + wd * ex * nx + w * pxx
        out[at(14, l)] = cn * nx * ny + wd * ex * ny + w * pxy
        out[at(15, l)] = cn * nx * nz + wd * ex * nz + w * pxz
        out[at(16, l)] = cn * nx * ny + wd * ey * nx + w * pyx
        out[at(17, l)] = ct + cn * ny * ny + wd * ey * ny + w * pyy
        out[at(18, l)] = cn * ny * nz + wd * ey * nz + w * pyz
        out[at(19, l)] = cn * nx * nz + wd * ez * nx + w * pzx
        out[at(20, l)] = cn * ny * nz + wd * ez * ny + w * pzy
        out[at(21, l)] = ct + cn * nz * nz + wd * ez * nz + w * pzz
        out[at(22, l)], out[at(23, l)], out[at(24, l)] = w * pxx, w * pxy, w * pxz
        out[at(25, l)], out[at(26, l)], out[at(27, l)] = w * pyx, w * pyy, w * pyz
        out[at(28, l)], out[at(29, l)], out[at(30, l)] = w * pzx, w * pzy, w * pzz
        out[at(31, l)], out[at(32, l)], out[at(33, l)] = weight * sx, weight * sy, weight * sz
        out[at(34, l)], out[at(35, l)], out[at(36, l)] = weight * px, weight * py, weight * pz


GROUP = 4  #: directions whose contributions are added in one pass over the sums
GROUP_ROWS = GROUP * BUFFER_ROWS


@kernel
def add_moments(sums, buffer, table, first, terms):
    """Add four directions' buffered rows, times their moments of n, to the sums."""
    for t in range(terms.shape[0]):
        row, column = terms[t, 1], terms[t, 2]
        c0, c1, c2, c3 = table[first, column], table[first + 1, column], table[first + 2, column], table[first + 3, column]
        total = sums[terms[t, 0]]
        b0, b1, b2, b3 = buffer[0, row], buffer[1, row], buffer[2, row], buffer[3, row]
        for l in lanes():
            total[l] += b0[l] * c0 + b1[l] * c1 + b2[l] * c2 + b3[l] * c3
