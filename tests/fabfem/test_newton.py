"""Newton with the consistent tangent converges quadratically, and refusals are values."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fabfem.fem.box import box_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Pressure
from fabfem.fem.mesh import Mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.points import Refusal, update_points
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat import MohrCoulomb, VonMises, initial_state
from umat.directions import directions
from umat.sands import toyoura

MATERIALS = {
    "von_mises": (VonMises(1e4, 0.3, 30.0, 100.0), None, {}, 0.03),
    "mohr_coulomb": (MohrCoulomb(1e4, 0.3, cohesion=2.0, friction_angle=30.0, dilation_angle=10.0), None, {}, 0.03),
    "chang_hicher": (
        toyoura(),
        directions("bazant_oh_37"),
        {"void_ratio": 0.8, "fabric": [-0.08, 0.16, -0.08, 0.0, 0.0, 0.0]},
        0.004,
    ),
}
"""Material, directions, what its initial state needs besides an isotropic 50 kPa, and settlement of the footing."""

FIXED = (Support("left", "x"), Support("right", "x"), Support("bottom", "x"), Support("bottom", "y"))
PRESSED = (Pressure("surface", 50.0, start=1.0),)


def ground() -> Mesh:
    """A block of soil with a footing on the left quarter of its top."""
    mesh = box_mesh("triangle6", (8, 6), (0.0, -3.0), (4.0, 0.0))
    top, x = mesh.points[:, 1] == 0.0, mesh.points[:, 0]
    parts = {"footing": top & (x <= 1.0), "surface": top & (x >= 1.0)}
    facets = {name: outer_facets(mesh.cells, mesh.cell_type, np.flatnonzero(nodes)) for name, nodes in parts.items()}
    return replace(mesh, boundaries=mesh.boundaries | facets)


def footing(name: str, **controls: float) -> Model:
    """A rigid rough footing pushed into the ground in four increments."""
    material, rule, needs, settlement = MATERIALS[name]
    space = build_space(ground(), KINEMATICS["plane_strain"])
    state = initial_state(material, rule, np.tile([50.0, 50.0, 50.0, 0, 0, 0], (space.npoints, 1)), **needs)
    held = (*FIXED, Support("footing", "x"), Support("footing", "y", -settlement))
    stage = Stage("push", held, PRESSED, first=0.25, largest=0.25)
    return Model(space, {"all": Zone(material, rule, state, slice(None))}, (stage,), Controls(**controls))


def orders(residuals: tuple[float, ...]) -> list[float]:
    """Observed orders of three trials in a row that contract and lie above round-off."""
    useful = [r for r in residuals if r > 1e-13]
    pairs = list(pairwise(useful))
    return [np.log(c / b) / np.log(b / a) for (a, b), (_, c) in pairwise(pairs) if b < 0.1 * a]


@pytest.mark.parametrize("name", MATERIALS)
def test_newton_converges_faster_than_linearly(name: str) -> None:
    steps = list(march(footing(name, tolerance=1e-12, reuse=False)))
    assert all(isinstance(step, Increment) for step in steps)
    assert any(len(step.residuals) > 4 for step in steps), "no plastic increment"
    last = [orders(step.residuals)[-1] for step in steps if orders(step.residuals)]
    assert max(last) >= 1.8
    assert np.median(last) >= 1.5


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("extrapolate", [False, True])
def test_the_first_guess_does_not_change_the_answer(name: str, extrapolate: bool) -> None:
    ends = [list(march(footing(name, tolerance=1e-10, extrapolate=e)))[-1] for e in (extrapolate, False)]
    np.testing.assert_allclose(ends[0].displacement, ends[1].displacement, atol=1e-9)


@pytest.mark.parametrize("name", MATERIALS)
def test_old_factors_save_work_and_do_not_change_the_answer(name: str) -> None:
    runs = [list(march(footing(name, tolerance=1e-5, reuse=reuse))) for reuse in (True, False)]
    solves = [sum(step.iterations for step in steps) for steps in runs]
    assert solves[0] - sum(step.reused for step in runs[0]) < solves[1]
    assert sum(step.reused for step in runs[0]) > 0
    assert sum(step.reused for step in runs[1]) == 0
    assert all(step.residuals[-1] <= 1e-5 for step in runs[0])
    np.testing.assert_allclose(runs[0][-1].displacement, runs[1][-1].displacement, atol=1e-6)


@pytest.mark.parametrize("name", MATERIALS)
def test_shortened_corrections_do_not_change_the_answer(name: str) -> None:
    ends = [list(march(footing(name, tolerance=1e-10, turn=turn)))[-1] for turn in (0.8, 0.1, np.inf)]
    for end in ends[1:]:
        np.testing.assert_allclose(ends[0].displacement, end.displacement, atol=1e-9)


def test_a_refused_point_is_named() -> None:
    model = footing("von_mises")
    strain = np.zeros((model.space.npoints, 6))
    strain[17, 3] = np.nan
    refusal = update_points(model.space, model.zones, strain, model.states)
    assert isinstance(refusal, Refusal)
    assert refusal.point == 17
    assert "zone 'all'" in refusal.reason


@pytest.mark.parametrize("ids", [False, True], ids=["slice", "numbers"])
def test_points_asked_in_parts_answer_the_same(ids: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    model = footing("von_mises")
    zone = model.zones["all"]
    zones = {"all": zone._replace(points=np.arange(model.space.npoints)) if ids else zone}
    strain = 1e-3 * np.random.default_rng(0).normal(size=(model.space.npoints, 6))
    whole = update_points(model.space, zones, strain, model.states)
    monkeypatch.setattr("fabfem.fem.points.MANY", 10)
    monkeypatch.setattr("fabfem.fem.points.AT_ONCE", 7)
    parts = update_points(model.space, zones, strain, model.states)
    assert not isinstance(whole, Refusal)
    assert not isinstance(parts, Refusal)
    for one, other in zip(whole.states["all"], parts.states["all"], strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(whole.tangent, parts.tangent)
    assert np.array_equal(whole.stress, parts.stress)
