"""Uniform strain [P 19], in three dimensions: contact normals that turn with the strain, none made, none lost.

[P 19] is Ḟ = 2 sym(F·ε̇) for the full 2-D tensor with tr F = Z. It does not keep tr F, because the vectors it follows
change their length, and its authors leave open how to project it. Here normals stay unit vectors,
ṅ = ε̇n − (n·ε̇n) n, and the fourth moment that this brings in is that of the model's own density
E(n) = (1 + F:nn)/4π, so

    Ġ = 2 sym(G·ε̇) − 2 ⟨nnnn⟩:ε̇,   F = (15/2) (G − I/3):   Ḟ = w [3 ė + (6/7) dev sym(F·ė)],   ė = dev ε̇,

exact for that density, traceless, blind to volume change and without a parameter (w = 1). The strain is the total one.

Sign: as printed, with [P]'s strain, positive in compression; normals then gather about the compressed axis, as the
samples of [P] do, faster. Material lines turn the other way, as strain = −sym ∇u: w = −1.
There is no critical state and ‖F‖ has no bound of use: a law for small strains and for comparison.
"""

from typing import NamedTuple

from .law import deviator, law, plus, scaled

SQRT2 = 2.0**0.5


class UniformStrain(NamedTuple):
    """Parameter of the law [-]."""

    share: float = 1.0  #: (w) part of the strain that the normals follow; 1 as [P 19] prints it, −1 material lines


@law(UniformStrain, "fabric", "strain")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [P 19]."""
    e = deviator(strain)
    f = fabric
    turned = deviator((
        f[0] * e[0] + 0.5 * (f[5] * e[5] + f[4] * e[4]),
        f[1] * e[1] + 0.5 * (f[5] * e[5] + f[3] * e[3]),
        f[2] * e[2] + 0.5 * (f[4] * e[4] + f[3] * e[3]),
        0.5 * ((f[5] * e[4] + f[4] * e[5]) / SQRT2 + (f[1] + f[2]) * e[3] + (e[1] + e[2]) * f[3]),
        0.5 * ((f[5] * e[3] + f[3] * e[5]) / SQRT2 + (f[0] + f[2]) * e[4] + (e[0] + e[2]) * f[4]),
        0.5 * ((f[4] * e[3] + f[3] * e[4]) / SQRT2 + (f[0] + f[1]) * e[5] + (e[0] + e[1]) * f[5]),
    ))  # fmt: skip
    return scaled(law.share, plus(scaled(3.0, e), scaled(6.0 / 7.0, turned)))
