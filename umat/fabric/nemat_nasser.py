"""Nemat-Nasser (2000): the fabric rate is coaxial with the plastic strain rate, Ḟ = λ ε̇_q^p [ZK Table 1 (iv)].

The scan shows λ and ε̇^p and no more. Read here: the deviator of ε̇^p, because F is traceless; and as the multiplier
the simplest one that rests in a critical state, as [ZK 10] asks,

    Ḟ = c1 (1 − F:n / F_l) ε̇_q^p,   n = ε̇_q^p/‖ε̇_q^p‖,

at rest where F:n = F_l. An infinite limit F_l leaves the bare proportionality Ḟ = c1 ε̇_q^p, which has no critical
state and drives 1 + F:nn below zero in the end. The part of F across n never fades (compare `li_dafalias`, where it
does).
"""

from typing import NamedTuple

from .law import deviator, dot, law, length, scaled


class NematNasser(NamedTuple):
    """Parameters of the law [-]."""

    rate: float = 4.8  #: (c1) change of F per plastic deviatoric strain; none is given, this is h F_c0 of [ZK Table 4]
    limit: float = 0.48  #: (F_l) of F:n, F_c0 of [ZK Table 4]; inf: none


@law(NematNasser, "fabric", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    u = deviator(plastic)
    softness = 1.0 / law.limit
    return scaled(law.rate * (1.0 - softness * dot(fabric, u) / length(u)), u)
