"""The march through stages: known answers, geostatic balance, cut-backs, giving up, and stages that are impossible."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from fabfem.fem.box import box_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Gravity, Load, Pressure, k0_stress
from fabfem.fem.mesh import Mesh
from fabfem.fem.mesh_files import read_mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, Stopped, march, reaction
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat import Elastic, Response, VonMises, elastic_tangent, initial_state, symmetric_tangent, update
from umat.status import NO_CONVERGENCE, OK

ROLLERS = (Support("left", "x"), Support("right", "x"), Support("bottom", "y"))
FIXED = (*ROLLERS, Support("bottom", "x"))
ELASTIC = Elastic(1e4, 0.3)


def filled(space: Space, material: Any, stress: np.ndarray | None = None) -> dict[str, Zone]:
    stress = np.zeros((space.npoints, 6)) if stress is None else stress
    return {"all": Zone(material, None, initial_state(material, None, stress), slice(None))}


def run(model: Model) -> list[Increment]:
    steps = list(march(model))
    assert all(isinstance(step, Increment) for step in steps), steps[-1]
    return steps


def named(mesh: Mesh, **parts: np.ndarray) -> Mesh:
    """The mesh with boundaries at the nodes of masks."""
    facets = {name: outer_facets(mesh.cells, mesh.cell_type, np.flatnonzero(mask)) for name, mask in parts.items()}
    return replace(mesh, boundaries=mesh.boundaries | facets)


def common_footing(size: float, **controls: Any) -> Model:
    """Strip pressure on von Mises ground, a problem that several programs agree on."""
    mesh = box_mesh("triangle6", (round(7.0 / size), round(3.6 / size)), (0.0, -3.6), (7.0, 0.0))
    mesh = named(mesh, strip=(mesh.points[:, 1] == 0.0) & (mesh.points[:, 0] < 1.0 + 1e-9))
    space = build_space(mesh, KINEMATICS["plane_strain"])
    material = VonMises(1e4, 0.3, 10.0 * np.sqrt(3.0), 100.0)
    stage = Stage("pressure", FIXED, (Pressure("strip", 50.0),), first=0.1, largest=0.1)
    return Model(space, filled(space, material), (stage,), Controls(tolerance=1e-8, **controls))


def settlement(model: Model, step: Increment) -> float:
    corner = np.flatnonzero((model.space.mesh.points == 0.0).all(axis=1))[0]
    return -float(step.displacement.reshape(-1, 2)[corner, 1])


def test_von_mises_footing_settles_as_other_programs_say() -> None:
    model = common_footing(0.2, extrapolate=False)
    steps = run(model)
    assert len(steps) == 10
    assert settlement(model, steps[-1]) == pytest.approx(0.0270604, abs=5e-8)
    assert sum(step.iterations for step in steps) <= 37


def test_extrapolation_saves_solves() -> None:
    model = common_footing(0.2)
    steps = run(model)
    assert settlement(model, steps[-1]) == pytest.approx(0.0270604, abs=5e-8)
    assert sum(step.iterations for step in steps) < 34


@pytest.mark.parametrize("solver", ["superlu", "auto"])
@pytest.mark.parametrize(
    ("cell_type", "kinematics"), [("quad9", "axisymmetric"), ("triangle6", "axisymmetric_torsion")]
)
def test_lame_cylinder(cell_type: str, kinematics: str, solver: str) -> None:
    """Radii 1 and 2, pressure 1 inside, E = 1, ν = 0.3, plane strain."""
    mesh = box_mesh(cell_type, (16, 1), (1.0, 0.0), (2.0, 0.2))
    space = build_space(mesh, KINEMATICS[kinematics])
    held = [Support("bottom", "z"), Support("top", "z")]
    held += [Support(side, "theta") for side in ("left",) if "theta" in space.components]
    stage = Stage("inflate", tuple(held), (Pressure("left", 1.0),), first=1.0, largest=1.0)
    step = run(Model(space, filled(space, Elastic(1.0, 0.3)), (stage,), solver=solver))[-1]
    u = step.displacement.reshape(-1, len(space.components))[:, 0]
    inner, outer = (np.isclose(mesh.points[:, 0], r) for r in (1.0, 2.0))
    np.testing.assert_allclose(u[inner], 1.906667, rtol=1e-4)
    np.testing.assert_allclose(u[outer], 1.213333, rtol=1e-4)
    hoop = -space.nodal(step.states["all"].stress)[:, 2]
    np.testing.assert_allclose(hoop[inner], 1.666667, rtol=1e-2)
    np.testing.assert_allclose(hoop[outer], 0.666667, rtol=1e-2)


def geostatic(space: Space, k0: float, level: float = 0.0, surcharge: float = 3.0) -> Model:
    loads: tuple[Load, ...] = (Gravity({"all": 20.0}), Pressure("top", surcharge, start=1.0))
    stage = Stage("geostatic", ROLLERS, loads, first=1.0, largest=1.0, zero_displacement=True)
    stress = k0_stress(space, slice(None), level, unit_weight=20.0, k0=k0, surcharge=surcharge)
    after = replace(stage, name="rest", first=0.5, largest=0.5, zero_displacement=False)
    return Model(space, filled(space, ELASTIC, stress), (stage, after))


@pytest.mark.parametrize("cell_type", ["triangle6", "quad8", "quad9"])
def test_level_ground_is_in_balance_from_the_start(cell_type: str) -> None:
    space = build_space(box_mesh(cell_type, (5, 4), (0.0, -4.0), (5.0, 0.0)), KINEMATICS["plane_strain"])
    steps = run(geostatic(space, 0.5))
    assert [step.stage for step in steps] == ["geostatic", "rest", "rest"]
    assert steps[0].out_of_balance < 1e-12
    assert steps[0].moved < 1e-12
    assert reaction(space, steps[-1], "bottom", "y") == pytest.approx(5.0 * (4.0 * 20.0 + 3.0))
    assert reaction(space, steps[-1], "left", "x") == pytest.approx(0.5 * 4.0 * (40.0 + 3.0))


def test_unbalanced_ground_moves_and_says_so() -> None:
    """Sloping ground is not in balance under the stress of level ground."""
    mesh = box_mesh("triangle6", (6, 4), (0.0, -4.0), (6.0, 0.0))
    x, y = mesh.points.T
    mesh = replace(mesh, points=np.column_stack([x, y + 0.1 * x * (y + 4.0) / 4.0]))
    space = build_space(mesh, KINEMATICS["plane_strain"])
    first, *_, last = run(geostatic(space, 0.5, level=1.0))
    assert first.out_of_balance > 1e-2
    assert first.moved > 1e-4
    assert np.abs(last.displacement).max() < 1e-6 * first.moved


def collapse(pressure: float, **stage: float) -> Model:
    """Perfectly plastic ground of strength 10 that carries no more than about 51.4."""
    mesh = box_mesh("triangle6", (14, 7), (0.0, -3.5), (7.0, 0.0))
    mesh = named(mesh, strip=(mesh.points[:, 1] == 0.0) & (mesh.points[:, 0] < 1.0 + 1e-9))
    space = build_space(mesh, KINEMATICS["plane_strain"])
    pushed = Stage("pressure", FIXED, (Pressure("strip", pressure),), **stage)
    return Model(space, filled(space, VonMises(1e4, 0.3, 10.0 * np.sqrt(3.0))), (pushed,))


def test_a_load_beyond_the_limit_stops_with_a_reason() -> None:
    *steps, end = march(collapse(100.0, first=0.1, largest=0.2, smallest=1e-2))
    assert isinstance(end, Stopped)
    assert end.reason
    assert end.cutbacks
    assert end.stage == "pressure"
    assert 0.5 < end.fraction < 0.65
    assert end.fraction == steps[-1].fraction
    assert [c.size for c in end.cutbacks] == sorted((c.size for c in end.cutbacks), reverse=True)


def test_increments_grow_where_it_is_easy_and_halve_where_not() -> None:
    impatient = Controls(max_iterations=5, easy=4)
    steps = run(replace(collapse(51.0, first=0.05, largest=1.0, smallest=1e-3), controls=impatient))
    sizes = [step.size for step in steps]
    assert sizes[1] == pytest.approx(1.5 * sizes[0])
    assert any(step.cutbacks for step in steps)
    assert steps[-1].fraction == 1.0
    assert sum(sizes) == pytest.approx(1.0)


def test_an_increment_records_time_number_and_balanced_forces() -> None:
    model = common_footing(0.4)
    steps = run(model)
    assert [step.number for step in steps] == list(range(1, 11))
    np.testing.assert_allclose([step.time for step in steps], np.linspace(0.1, 1.0, 10))
    assert set(steps[0].timings) == {"material", "assembly", "linear_solve"}
    total = [reaction(model.space, steps[-1], "bottom", "y"), steps[-1].external_force[1::2].sum()]
    assert total[0] == pytest.approx(-total[1], rel=1e-6)
    strip = model.space.mesh.points[model.space.mesh.boundary("strip"), 0].max()
    assert total[1] == pytest.approx(-50.0 * strip)


def test_viscosity_resists_the_rate() -> None:
    """At a constant rate the drag is η times the elastic force of the whole stage, however fine the increments."""
    space = build_space(box_mesh("quad8", (2, 2), (0, 0), (1, 1)), KINEMATICS["plane_strain"])
    held = (*ROLLERS, Support("top", "y", -0.01))
    for size in (0.25, 0.1):
        stage = Stage("press", held, first=size, largest=size)
        plain, slow = (
            run(Model(space, filled(space, ELASTIC), (stage,), Controls(1e-9, viscosity=eta))) for eta in (0.0, 0.05)
        )
        whole = reaction(space, plain[-1], "top", "y")
        for a, b in zip(plain, slow, strict=True):
            assert reaction(space, b, "top", "y") == pytest.approx(reaction(space, a, "top", "y") + 0.05 * whole)
            assert (a.drag, b.drag) == pytest.approx((0.0, 0.05 / (0.05 + a.fraction)))
            np.testing.assert_allclose(a.states["all"].stress, b.states["all"].stress, atol=1e-6)


class Fussy(NamedTuple):
    """Elastic, but a point that is strained by more than `limit` in an increment is refused."""

    elastic: Elastic
    limit: float


@update.register
def _(material: Fussy, directions: None, strain_increment: np.ndarray, old: Any) -> Response:
    answer = update(material.elastic, directions, strain_increment, old)
    refused = np.abs(strain_increment).max(axis=1) > material.limit
    answer.stress[refused], answer.tangent[refused] = old.stress[refused], 0.0
    state = answer.state._replace(stress=answer.stress)
    return answer._replace(state=state, status=np.where(refused, NO_CONVERGENCE, OK).astype(np.int8))


@initial_state.register
def _(material: Fussy, directions: None, stress: np.ndarray) -> Any:
    return initial_state(material.elastic, directions, stress)


@symmetric_tangent.register
def _(material: Fussy) -> bool:
    return True


@elastic_tangent.register
def _(material: Fussy, state: Any) -> np.ndarray:
    return elastic_tangent(material.elastic, state)


def test_refused_points_may_be_held() -> None:
    """Near the edge of a stamp a few points are strained most; they keep their stress, the others carry the rest."""
    mesh = box_mesh("triangle6", (8, 6), (0.0, -3.0), (4.0, 0.0))
    mesh = named(mesh, stamp=(mesh.points[:, 1] == 0.0) & (mesh.points[:, 0] <= 1.0))
    space = build_space(mesh, KINEMATICS["plane_strain"])
    held = (*FIXED, Support("stamp", "x"), Support("stamp", "y", -0.01))
    stage = Stage("press", held, first=0.5, largest=0.5, smallest=0.4)
    model = Model(space, filled(space, Fussy(ELASTIC, 3e-3)), (stage,), Controls(1e-8))
    stopped = list(march(model))[-1]
    assert isinstance(stopped, Stopped)
    assert "points of zone 'all'" in stopped.reason
    steps = run(replace(model, controls=replace(model.controls, held=0.1)))
    assert 0 < max(step.held for step in steps) <= 0.1 * space.npoints
    elastic = run(replace(model, zones=filled(space, ELASTIC)))
    assert all(step.held == 0 for step in elastic)
    force, most = (reaction(space, steps[-1], "stamp", "y") for steps in (steps, elastic))
    assert 0.5 * abs(most) < abs(force) < abs(most)


def test_a_run_of_rigid_motion_makes_no_stress() -> None:
    space = build_space(box_mesh("quad8", (2, 2), (0, 0), (1, 1)), KINEMATICS["plane_strain"])
    held = tuple(Support(side, c, 0.1) for side in ("left", "right") for c in ("x", "y"))
    step = run(Model(space, filled(space, ELASTIC), (Stage("lift", held),)))[-1]
    np.testing.assert_allclose(step.displacement, 0.1, rtol=1e-12)
    np.testing.assert_allclose(step.states["all"].stress, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("supports", "words"),
    [
        ((), "leave 3 rigid motions"),
        ((Support("bottom", "y"),), "leave one rigid motion"),
        ((Support("bottom", "y"), Support("bottom", "x", 0.1), Support("left", "x")), "already moved"),
        ((Support("bottom", "z"),), "there is no displacement component 'z'; there are x, y"),
        ((Support("base", "x"),), "no boundary 'base'"),
    ],
)
def test_impossible_supports_are_refused(supports: tuple[Support, ...], words: str) -> None:
    space = build_space(box_mesh("quad8", (2, 2), (0, 0), (1, 1)), KINEMATICS["plane_strain"])
    with pytest.raises(ValueError, match=words):
        march(Model(space, filled(space, ELASTIC), (Stage("free", supports),)))


def test_impossible_arguments_are_refused() -> None:
    mesh = box_mesh("quad8", (2, 2), (0, 0), (1, 1))
    space = build_space(mesh, KINEMATICS["plane_strain"])
    state = initial_state(ELASTIC, None, np.zeros((4, 6)))
    with pytest.raises(ValueError, match="element 1 belongs to 0 zones"):
        Model(space, {"all": Zone(ELASTIC, None, state, slice(0, 4))}, ())
    with pytest.raises(ValueError, match="smallest <= first"):
        Stage("push", (), first=0.1, smallest=0.2)
    with pytest.raises(ValueError, match="above the surface"):
        k0_stress(space, slice(None), level=0.5, unit_weight=20.0, k0=0.5)
    with pytest.raises(ValueError, match="mesh of dimension 3"):
        build_space(mesh, KINEMATICS["solid"])
    with pytest.raises(ValueError, match="x is the radius"):
        build_space(box_mesh("quad8", (2, 2), (-1, 0), (1, 1)), KINEMATICS["axisymmetric"])
    with pytest.raises(ValueError, match="no rule of 5 points"):
        build_space(mesh, KINEMATICS["plane_strain"], 5)


def test_shipped_footing_mesh_is_in_balance() -> None:
    mesh = read_mesh(Path(__file__).parents[2] / "meshes" / "strip_half.msh")
    space = build_space(mesh, KINEMATICS["plane_strain"])
    stress = k0_stress(space, slice(None), level=0.0, unit_weight=15.3, k0=0.5)
    held = (Support("symmetry", "x"), Support("side", "x"), Support("bottom", "x"), Support("bottom", "y"))
    stage = Stage("geostatic", held, (Gravity({"soil": 15.3}),), first=1.0, largest=1.0)
    zones = {"soil": filled(space, ELASTIC, stress)["all"]}
    assert run(Model(space, zones, (stage,)))[0].out_of_balance < 1e-12
