"""Calibrated sands: parameter sets of the enhanced CH model with the source of every number.

The tables of the sources are in N, mm and MPa; a sand is asked for in the caller's units, given as the size of its unit
of force in newtons and of length in metres: `toyoura(newtons=1e3, metres=1.0)` is kN, m and kPa.
Grain size (d50 0.17 and 0.535 mm) cancels out of the dimensionless equations and is not a parameter.
"""

from collections.abc import Callable

from .chang_hicher import ChangHicher
from .fabric import ZhaoKruyt

#: ‖F‖ of a gravity deposit of Toyoura sand: F = diag(−.0849, −.0849, +.1698), large along the deposition axis [ZK 6]
TOYOURA_FABRIC_NORM = 0.208
#: Atmospheric pressure [Pa]
ATMOSPHERE = 101.3e3


def toyoura(newtons: float = 1e3, metres: float = 1.0) -> ChangHicher:
    """Return Toyoura sand [ZK Table 4] in the units given; defaults kN, m, kPa.

    e_ref, λ_c, ξ, k_n0, φ_μ, k_tR, k_pR, M_c, c, F_c0, h, m: [ZK Table 4]. p_ref = 101.3 kPa (atmospheric). The
    source does not state f_ref: 0.005 N gives the least error in σ1/σ3 against the four loose and medium drained tests
    of Verdugo & Ishihara (1996) in the Sand Triaxial Test Database.
    """
    law = ZhaoKruyt(h=10.0, m=0.4, critical_fabric=0.48, critical_ratio=1.25, extension=0.75)
    sand = ChangHicher(
        e_ref=0.934,
        critical_slope=0.019,
        critical_exponent=0.7,
        normal_stiffness=4.5,
        friction_angle=27.0,
        tangential_ratio=0.5,
        plastic_ratio=0.7,
        reference_force=0.005,
        reference_pressure=ATMOSPHERE,
        law=law,
    )
    return _in_units(sand, newtons, metres)


def dem_yang_wu(newtons: float = 1e3, metres: float = 1.0) -> ChangHicher:
    """Return the discrete-element samples of Yang & Wu [ZK Appendix] in the units given; defaults kN, m, kPa.

    e_ref, λ_c, ξ, k_n0, φ_μ, k_tR, k_pR: [ZK Appendix]. Its Table 2 cannot be read in our copy: F_c0, h, m, M_c and c
    are Toyoura's, and so is f_ref.
    """
    law = ZhaoKruyt(h=10.0, m=0.4, critical_fabric=0.48, critical_ratio=1.25, extension=0.75)
    sand = ChangHicher(
        e_ref=0.862,
        critical_slope=0.021,
        critical_exponent=0.7,
        normal_stiffness=18.0,
        friction_angle=25.0,
        tangential_ratio=0.6,
        plastic_ratio=0.5,
        reference_force=0.005,
        reference_pressure=ATMOSPHERE,
        law=law,
    )
    return _in_units(sand, newtons, metres)


def _in_units(sand: ChangHicher, newtons: float, metres: float) -> ChangHicher:
    """Return a sand, whose contacts are in N/mm and N and whose pressure is in Pa, in other units."""
    return sand._replace(
        normal_stiffness=sand.normal_stiffness * 1e3 * metres / newtons,
        reference_force=sand.reference_force / newtons,
        reference_pressure=sand.reference_pressure * metres**2 / newtons,
    )


#: Void ratio of the densest and the loosest packing of a sand [ZK §5.1]
PACKINGS: dict[str, tuple[float, float]] = {"toyoura": (0.597, 0.977)}

SANDS: dict[str, Callable[..., ChangHicher]] = {"toyoura": toyoura, "dem_yang_wu": dem_yang_wu}
