"""Tian & Yao (2018): Ġ = c1 ε̇_v^p/(M⁴ − η⁴) (I/3 − c2 η − G), η = s/p in bold, q/p in η⁴ [ZK Table 1 (iii)].

Three readings:

* Their fabric tensor is I/3 when isotropic, so it is G of [ZK 4], F = (15/2) (G − I/3):
  Ḟ = c1 Λ̇ (−(15/2) c2 η − F), traceless. c2 is kept as printed; contact normals gather about the major
  compression, which is c2 < 0.
* Λ̇ = ε̇_v^p/(M⁴ − η⁴) is 0/0 in the critical state, and for a flow rule other than its authors' it is negative,
  driving F away from its end, where a sample dilates before η reaches M, as a dense Chang–Hicher sample does. In
  the unified hardening model ε̇_v^p : ε̇_d^p = (M² − η²) : 2η, with ε̇_d^p = √(2/3) ‖ε̇_q^p‖, which makes

      Λ̇ = ε̇_v^p/(M⁴ − η⁴) = √(ε̇_v^p² + M² ε̇_d^p²) / (M² + η²)²

  an identity. The right-hand side is regular and never negative, and is what the law uses. `printed` = 1 uses the
  left-hand side, as Λ̇ = ε̇_v^p (M⁴ − η⁴)/((M⁴ − η⁴)² + (M⁴/10)²) to stay finite.
* M is a constant, that of triaxial compression.

Critical state: F = −(15/2) c2 η, whatever η is (with the printed Λ̇, everywhere at constant plastic volume).
"""

from typing import NamedTuple

import numpy as np

from .law import TINY, deviator, dot, law, plus, scaled, stress_ratio

WIDTH = 0.1  #: of the smoothed singularity of the printed form, over M⁴


class TianYao(NamedTuple):
    """Parameters of the law [-]; the papers at hand give no values.

    The defaults end at ‖F‖ = 0.48 for q/p = 1.25, at the pace 10 per ‖ε_q^p‖ there [ZK Table 4].
    """

    rate: float = 96.0  #: (c1)
    attraction: float = -0.0627  #: (c2) G ends at I/3 − c2 s/p
    critical_ratio: float = 1.25  #: (M) q/p in the critical state in triaxial compression [ZK Table 4]
    printed: float = 0.0  #: 1: drive by ε̇_v^p/(M⁴ − η⁴) itself, 0: by its regular form


@law(TianYao, "fabric", "stress", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    u = deviator(plastic)
    volume = plastic[0] + plastic[1] + plastic[2]
    direction, eta = stress_ratio(stress)
    limit2, eta2 = law.critical_ratio**2, eta * eta
    if law.printed > 0.0:
        gap, width = limit2 * limit2 - eta2 * eta2, WIDTH * limit2 * limit2
        index = volume * gap / (gap * gap + width * width)
    else:
        total = limit2 + eta2
        index = np.sqrt(volume * volume + limit2 * 2.0 / 3.0 * dot(u, u) + TINY) / (total * total)
    end = scaled(-7.5 * law.attraction, direction)
    return scaled(law.rate * index, plus(end, scaled(-1.0, fabric)))
