"""Second-order work and the acoustic tensor, where both are known."""

import numpy as np
import pytest

from fabfem.boundary_value.stability import (
    acoustic_determinant,
    least_ratio,
    localisation,
    normals_of,
    second_order_work,
)
from fabfem.fem.box import box_mesh
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat import VonMises, elastic_tangent, initial_state
from umat.elastic import stiffness

SHEAR, YIELD = 1000.0, 10.0
HELD = (*(Support(side, "y") for side in ("left", "right", "bottom", "top")), Support("bottom", "x"))


def sheared(hardening: float) -> tuple[Space, list[Increment]]:
    """Simple shear of one element by displacement to γ = 0.04, where yield is at 0.01, then a little more.

    In the little more, the consistent tangent is that of the rates.
    """
    space = build_space(box_mesh("quad", (1, 1), (0, 0), (1, 1)), KINEMATICS["plane_strain"])
    material = VonMises(2.5 * SHEAR, 0.25, YIELD * 3**0.5, hardening)
    zone = Zone(material, None, initial_state(material, None, np.zeros((space.npoints, 6))), slice(None))
    stage = Stage("shear", (*HELD, Support("top", "x", 0.04)), first=0.2, largest=0.2)
    more = Stage("more", (*HELD, Support("top", "x", 1e-8)), first=1.0, largest=1.0)
    steps = list(march(Model(space, {"all": zone}, (stage, more), Controls())))
    assert all(isinstance(step, Increment) for step in steps)
    return space, steps


@pytest.mark.parametrize("hardening", [600.0, 0.0, -600.0])
def test_in_simple_shear_the_band_is_the_shear_plane(hardening: float) -> None:
    """A(e_y) is diagonal: G_ep = G H/(3G + H) along the band, G out of the plane, K + 4G/3 across it."""
    space, steps = sheared(hardening)
    first, last = acoustic_determinant(space, steps[0]), acoustic_determinant(space, steps[-1])
    np.testing.assert_allclose(first, 1.0, rtol=1e-12)
    np.testing.assert_allclose(last, hardening / (3.0 * SHEAR + hardening), rtol=1e-4, atol=1e-9)
    assert (localisation(space, steps[-1]) != {}) == (hardening <= 0.0)
    assert localisation(space, steps[0]) == {}


@pytest.mark.parametrize("hardening", [600.0, 0.0, -600.0])
def test_second_order_work_is_stress_change_times_strain_change(hardening: float) -> None:
    space, steps = sheared(hardening)
    elastic, plastic = second_order_work(space, steps[0]), second_order_work(space, steps[-2])
    slope = SHEAR * hardening / (3.0 * SHEAR + hardening)
    np.testing.assert_allclose(elastic, SHEAR * 0.008**2, rtol=1e-9)
    np.testing.assert_allclose(plastic, slope * 0.008**2, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_least_is_found_between_the_first_directions(dim: int) -> None:
    """An elastic tangent softened on one plane whose normal is no lattice direction: det A = 0 there."""
    elastic = stiffness(1000.0, 0.25)
    angle = 0.4321
    normal = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = np.array([-np.sin(angle), np.cos(angle), 0.0])
    dyad = 0.5 * (np.outer(normal, along) + np.outer(along, normal))
    vector = np.array([dyad[0, 0], dyad[1, 1], dyad[2, 2], *(2**0.5 * dyad[i, j] for i, j in ((1, 2), (0, 2), (0, 1)))])
    flow = elastic @ vector
    tangent = elastic - np.outer(flow, flow) / (vector @ flow)
    (least,) = least_ratio(tangent[None], elastic[None], normals_of(dim))
    assert least == pytest.approx(0.0, abs=1e-5)


def test_elastic_materials_are_at_one() -> None:
    material = VonMises(100.0, 0.3, 1.0)
    state = initial_state(material, None, np.zeros((2, 6)))
    tangent = elastic_tangent(material, state)
    for dim in (2, 3):
        np.testing.assert_allclose(least_ratio(tangent, tangent, normals_of(dim)), 1.0)
