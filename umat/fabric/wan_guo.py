"""Wan & Guo (2004): the fabric follows the stress ratio tensor, Ḟ = c1 η̇, η = s/p [ZK Table 1 (i)].

Path-independent: F − F_0 = c1 (η − η_0), so nothing changes while the stress ratio is constant, in the critical state
or elsewhere. There is no plastic part, hence no memory of the way.
"""

from typing import NamedTuple

from .law import law, scaled


class WanGuo(NamedTuple):
    """Parameter of the law [-]; the papers at hand give no value.

    The default takes an isotropic sample to ‖F‖ = 0.48 at q/p = 1.25, the critical state of Toyoura sand in triaxial
    compression [ZK Table 4].
    """

    rate: float = 0.47  #: (c1) change of F per change of s/p


@law(WanGuo, "ratio")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    return scaled(law.rate, ratio)
