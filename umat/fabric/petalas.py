"""Petalas et al. (2019): Ḟ = λ̇ c1 exp(F:n) (n − F) [ZK Table 1 (iv)].

As `li_dafalias` (loading index and unit of F are read as there): with our F the exponent is F:n / F_c0. A fabric that
lies across the loading direction is slow to turn, one that lies along it is e² times as fast as one against it.
Critical state: F = F_c0 n.
"""

from typing import NamedTuple

import numpy as np

from .law import deviator, dot, law, length, plus, scaled


class Petalas(NamedTuple):
    """Parameters of the law [-]."""

    rate: float = 3.68  #: (c1) per plastic deviatoric strain; none is given: h/e, so that c1 e is h of [ZK Table 4]
    critical_fabric: float = 0.48  #: (F_c0) unit in which the law measures F [ZK Table 4]


@law(Petalas, "fabric", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    u = deviator(plastic)
    index = length(u)
    pace = law.rate * np.exp(dot(fabric, u) / (index * law.critical_fabric))
    toward = scaled(law.critical_fabric, u)
    return scaled(pace, plus(toward, scaled(-index, fabric)))
