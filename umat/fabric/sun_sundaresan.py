"""Sun & Sundaresan (2011): Ḟ = c1 ε̇_q + c2 ‖ε̇‖ F + c3 (F:ε̇_q) F, driven by total strain [ZK Table 1 (ii)].

The scan shows ε̇ in the first term; its deviator is taken, because F is traceless. Strain is positive in compression, so
c1 > 0 gathers contact normals about the compressed axis, and c2 < 0 makes the fabric fade. ‖ε̇‖ is the norm of the whole
strain rate: compression without shear makes F fade, too, and so does a closed elastic loop.

Critical state, ε̇ = ‖ε̇‖ n of constant volume: F = a n with c1 + c2 a + c3 a² = 0.
"""

from typing import NamedTuple

from .law import deviator, dot, law, length, plus, scaled


class SunSundaresan(NamedTuple):
    """Parameters of the law [-]; the papers at hand give no values.

    The defaults tend to ‖F‖ = 0.48 at the pace 10 of [ZK Table 4].
    """

    rate: float = 4.8  #: (c1) of the strain deviator
    decay: float = -10.0  #: (c2) of F, per length of strain
    joint: float = 0.0  #: (c3) of (F:ε̇_q) F


@law(SunSundaresan, "fabric", "strain")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    e = deviator(strain)
    along = law.decay * length(strain) + law.joint * dot(fabric, e)
    return plus(scaled(law.rate, e), scaled(along, fabric))
