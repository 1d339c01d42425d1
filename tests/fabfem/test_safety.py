"""The factor of safety of a block under a pressure, against the plane-strain strength of each material."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from fabfem.fem.box import box_mesh
from fabfem.fem.increment import Collapsed
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Pressure
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage, StrengthSearch
from fabfem.fem.supports import Support
from umat import DruckerPrager, Elastic, MohrCoulomb, VonMises, initial_state, weakened
from umat.chang_hicher import ChangHicher
from umat.directions import directions
from umat.drucker_prager import matched_to_mohr_coulomb
from umat.sands import toyoura

HELD = (Support("bottom", "y"), Support("left", "x"))
LOAD = 30.0


def strength(material: Any) -> float:
    """The pressure [stress] that a block carries in plane strain between smooth platens, its sides free."""
    if isinstance(material, VonMises):
        return 2.0 / 3.0**0.5 * material.yield_stress
    if isinstance(material, MohrCoulomb):
        angle = np.radians(45.0 + 0.5 * material.friction_angle)
        return 2.0 * material.cohesion * np.tan(angle)

    def misfit(sine: float) -> float:  # of an associated cone: the friction angle of the same plane-strain strength
        match = matched_to_mohr_coulomb(1.0, 0.0, 1.0, *2 * [np.degrees(np.arcsin(sine))])
        return match.friction_slope - material.friction_slope

    angle = np.degrees(np.arcsin(brentq(misfit, 1e-6, 0.9)))
    unit = matched_to_mohr_coulomb(1.0, 0.0, 1.0, angle, angle)
    return 2.0 * material.strength / unit.strength * np.tan(np.radians(45.0 + 0.5 * angle))


MATERIALS = {
    "Tresca": MohrCoulomb(1e4, 0.3, 25.0, 0.0),
    "Mohr-Coulomb": MohrCoulomb(1e4, 0.3, 20.0, 25.0, 25.0),
    "Mohr-Coulomb, no dilation": MohrCoulomb(1e4, 0.3, 20.0, 25.0),
    "von Mises": VonMises(1e4, 0.3, 60.0),
    "Drucker-Prager": matched_to_mohr_coulomb(1e4, 0.3, 20.0, 25.0, 25.0),
}


def search(material: Any, controls: Controls = Controls(), **goal: Any) -> tuple[list[Increment], Collapsed]:  # noqa: B008
    mesh = box_mesh("quad8", (1, 2), (0.0, 0.0), (1.0, 2.0))
    mesh = replace(mesh, zones={"lower": np.array([0]), "upper": np.array([1])})
    space = build_space(mesh, KINEMATICS["plane_strain"])
    parts = {}
    for name in mesh.zones:
        points = space.points_of(mesh.zone(name))
        state = initial_state(material, None, np.zeros((len(space.weights[points]), 6)))
        parts[name] = Zone(material, None, state, points)
    spared = goal.pop("spared", ())
    stages = (
        Stage("load", HELD, (Pressure("top", LOAD),)),
        Stage("search", HELD, (Pressure("top", LOAD, 1.0, 1.0),), goal=StrengthSearch(**goal), spared=spared),
    )
    *steps, end = march(Model(space, parts, stages, controls))
    assert isinstance(end, Collapsed), end
    return steps, end


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_the_bracket_holds_the_exact_factor(material: Any) -> None:
    exact = brentq(lambda factor: strength(weakened(material, factor)) - LOAD, 1.0, 5.0)
    steps, end = search(material, tolerance=0.002)
    assert end.verdict == "collapse", end.reason
    assert end.last_equilibrium - 1e-6 <= exact <= end.first_failure + 1e-6
    assert end.first_failure - end.last_equilibrium <= 0.0020001
    assert steps[-1].strength == end.last_equilibrium
    assert [factor.verdict for factor in end.tried].count("equilibrium") == sum(s.stage == "search" for s in steps)
    assert end.failing is not None
    assert end.failing.strength == end.first_failure
    assert np.abs(end.failing.step).max() > 0.0


def test_zones_are_spared() -> None:
    """A lower half that keeps its strength holds the upper one together at their joint, a little."""
    material = MATERIALS["Tresca"]
    alone, held = search(material)[1], search(material, spared=("lower",))[1]
    assert alone.last_equilibrium < held.last_equilibrium < 1.1 * alone.last_equilibrium
    _, end = search(material, spared=("lower", "upper"), largest=2.5)
    assert (end.verdict, end.last_equilibrium, end.first_failure) == ("none", 2.5, None)


def test_an_iteration_that_gives_up_is_no_failure() -> None:
    """With three iterations Newton's method refuses increments that the flow then brings to rest."""
    material = MATERIALS["Mohr-Coulomb"]
    _, sure = search(material)
    _, end = search(material, Controls(max_iterations=3))
    assert (end.last_equilibrium, end.first_failure) == pytest.approx(
        (sure.last_equilibrium, sure.first_failure), abs=0.011
    )
    assert end.verdict == "collapse"


@pytest.mark.parametrize("displacement", [0.005, 0.5])
def test_a_displacement_that_is_named_changes_no_bracket(displacement: float) -> None:
    material = MATERIALS["Mohr-Coulomb"]
    exact = brentq(lambda factor: strength(weakened(material, factor)) - LOAD, 1.0, 5.0)
    _, end = search(material, tolerance=0.002, displacement=displacement)
    assert end.verdict == "collapse", end.reason
    assert end.last_equilibrium - 1e-6 <= exact <= end.first_failure + 1e-6
    assert end.failing is not None
    assert f"a displacement of {end.failing.moved:.3g}" not in end.reason  # the last increment is not all of the flow
    assert float(end.reason.split("displacement of ")[1].split()[0]) > displacement


SAND = toyoura()
CELL, AXIAL = 50.0, 130.0
"""Pressure on the side of a block of sand and on its top [kPa]."""


def sand_block(*stages: Stage, controls: Controls) -> list[Any]:
    """March a block of Toyoura sand (e = 0.8, level bedding) in plane strain through stages after 50 kPa all round."""
    space = build_space(box_mesh("quad8", (1, 1), (0.0, 0.0), (1.0, 1.0)), KINEMATICS["plane_strain"])
    stress = np.tile([CELL, CELL, CELL, 0.0, 0.0, 0.0], (space.npoints, 1))
    needs = {"void_ratio": 0.8, "fabric": [-0.0849, 0.1698, -0.0849, 0.0, 0.0, 0.0]}
    rule = directions("bazant_oh_37")
    zone = Zone(SAND, rule, initial_state(SAND, rule, stress, **needs), slice(None))
    return list(march(Model(space, {"all": zone}, stages, controls)))


def peak_pressure(factor: float) -> float:
    """Largest pressure [kPa] on the top of the block of sand under way to 20 % of strain, its strength divided."""
    side = Pressure("right", CELL, 1.0, 1.0)
    pushed = (*HELD, Support("top", "y", -0.2))
    steps = sand_block(
        Stage("compression", pushed, (side,), first=0.01, largest=0.02, strength=factor),
        controls=Controls(tolerance=1e-4),
    )
    assert steps[-1].fraction == 1.0
    return max(float(step.states["all"].stress[:, 1].mean()) for step in steps)


def test_sand_fails_where_its_peak_is_below_the_load() -> None:
    """The peak of sand that is weak from the start differs a little from that of sand which grows weaker under load."""
    side, top = Pressure("right", CELL, 1.0, 1.0), Pressure("top", AXIAL, CELL / AXIAL, 1.0)
    goal = StrengthSearch(step=0.1, tolerance=0.05, displacement=0.05)
    *steps, end = sand_block(
        Stage("load", HELD, (side, top), first=0.1, largest=0.1),
        Stage("search", HELD, (side, replace(top, start=1.0)), goal=goal),
        controls=Controls(tolerance=1e-3, max_iterations=6),
    )
    assert end.verdict == "collapse", end.reason
    assert "the body flows" in end.reason
    assert peak_pressure(end.last_equilibrium) > 0.99 * AXIAL > peak_pressure(end.first_failure)
    assert end.first_failure - end.last_equilibrium <= 0.0500001
    assert all(step.residuals[-1] <= 1e-3 for step in steps)


def test_a_body_that_fails_at_the_first_factor_has_no_equilibrium_to_show() -> None:
    weak = MohrCoulomb(1e4, 0.3, 16.0, 0.0)
    mesh = box_mesh("quad8", (1, 1), (0.0, 0.0), (1.0, 1.0))
    space = build_space(mesh, KINEMATICS["plane_strain"])
    zone = Zone(weak, None, initial_state(weak, None, np.zeros((space.npoints, 6))), slice(None))
    load = (Pressure("top", LOAD, 1.0, 1.0),)
    stage = Stage("search", HELD, load, strength=1.5, goal=StrengthSearch())
    (end,) = march(Model(space, {"all": zone}, (stage,)))
    assert isinstance(end, Collapsed)
    assert (end.last_equilibrium, end.first_failure, end.verdict) == (None, 1.5, "collapse")


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_what_a_material_calls_its_strength_is_divided(factor: float) -> None:
    soil = weakened(MohrCoulomb(1.0, 0.2, 3.0, 30.0, 20.0), factor)
    assert soil.cohesion == 3.0 / factor
    assert np.tan(np.radians(soil.friction_angle)) == pytest.approx(np.tan(np.radians(30.0)) / factor)
    assert soil.dilation_angle == pytest.approx(min(20.0, soil.friction_angle))
    joint = weakened(MohrCoulomb(1.0, 0.2, 3.0, 30.0, 30.0), factor)
    assert joint.dilation_angle == joint.friction_angle
    cone = weakened(DruckerPrager(1.0, 0.2, 1.2, 0.9, 5.0, 7.0), factor)
    assert (cone.friction_slope, cone.strength, cone.hardening_modulus) == pytest.approx(
        (1.2 / factor, 5 / factor, 7 / factor)
    )
    assert cone.dilation_slope == pytest.approx(min(0.9, 1.2 / factor))
    assert weakened(VonMises(1.0, 0.2, 3.0, 4.0, 1.0), factor)[2:] == pytest.approx(
        (3 / factor, 4 / factor, 1 / factor)
    )
    assert weakened(Elastic(1.0, 0.2), factor) == Elastic(1.0, 0.2)
    sand = ChangHicher(0.9, 0.02, 0.7, 1.0, 30.0, 0.5, 0.5, 1.0, 1.0)
    weak = weakened(sand, factor)
    assert np.tan(np.radians(weak.friction_angle)) == pytest.approx(np.tan(np.radians(30.0)) / factor)
    assert weak._replace(friction_angle=30.0) == sand
