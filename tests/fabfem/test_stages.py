"""Stages that change the body, and rigid bodies on it, against exact answers on elastic columns."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fabfem.fem.box import box_mesh
from fabfem.fem.constraints import constrain
from fabfem.fem.facets import outer_facets
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import BodyForce, Gravity, Load, Pressure
from fabfem.fem.mesh import Mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, Stopped, march, reaction
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Change, Stage
from fabfem.fem.supports import RigidBody, Support
from umat import Elastic, VonMises, initial_state

YOUNG, POISSON, WEIGHT = 1e4, 0.25, 20.0
OEDOMETER = YOUNG * (1 - POISSON) / (1 + POISSON) / (1 - 2 * POISSON)
SOIL = Elastic(YOUNG, POISSON)
ROLLERS = (Support("left", "x"), Support("right", "x"), Support("bottom", "y"))
STEP = {"first": 0.5, "largest": 0.5}


def layered(layers: int, kind: str = "quad8") -> Space:
    """A column of unit elements, each a zone: layer_0 at the bottom."""
    mesh = box_mesh(kind, (1, layers), (0.0, 0.0), (1.0, float(layers)))
    return build_space(
        replace(mesh, zones={f"layer_{i}": np.array([i]) for i in range(layers)}), KINEMATICS["plane_strain"]
    )


def filled(space: Space, material: Any = SOIL, stress: np.ndarray | None = None) -> dict[str, Zone]:
    parts = {}
    for name in space.mesh.zones:
        points = space.points_of(space.mesh.zone(name))
        initial = np.zeros((len(space.weights[points]), 6)) if stress is None else stress[points]
        parts[name] = Zone(material, None, initial_state(material, None, initial), points)
    return parts


def run(space: Space, zones: dict[str, Zone], *stages: Stage) -> list[Increment]:
    steps = list(march(Model(space, zones, stages, Controls(tolerance=1e-12))))
    assert all(isinstance(step, Increment) for step in steps), steps[-1]
    return steps


def height_of(space: Space, step: Increment, height: float) -> float:
    """Mean vertical displacement of the nodes at a height."""
    nodes = np.flatnonzero(np.abs(space.mesh.points[:, 1] - height) < 1e-9)
    return float(step.displacement.reshape(-1, 2)[nodes, 1].mean())


def test_embankment_in_lifts_settles_as_the_sum_over_the_lifts() -> None:
    space, lifts = layered(4), 4
    stages = []
    for k in range(lifts):
        absent = tuple(f"layer_{i}" for i in range(k + 1, lifts))
        old = Gravity({f"layer_{i}": WEIGHT for i in range(k)})
        new = Gravity({f"layer_{k}": WEIGHT}, start=0.0)
        stages.append(Stage(f"lift {k}", ROLLERS, (old, new), absent=absent, released=True, **STEP))
    end = run(space, filled(space), *stages)[-1]
    for top in range(1, lifts + 1):  # the height z of the top of each lift, all of thickness one
        own = WEIGHT * (top - 1) / OEDOMETER + 0.5 * WEIGHT / OEDOMETER
        later = (lifts - top) * WEIGHT * top / OEDOMETER
        assert height_of(space, end, float(top)) == pytest.approx(-own - later, rel=1e-10)
    depth = lifts - space.points[:, 1]
    stress = np.concatenate([end.states[f"layer_{i}"].stress for i in range(lifts)])
    np.testing.assert_allclose(stress[:, 1], WEIGHT * depth, rtol=1e-9)


@pytest.mark.parametrize("released", [True, False])
def test_excavation_heaves_by_the_weight_that_is_gone(released: bool) -> None:
    space, layers, dug = layered(4), 4, 2
    depth = layers - space.points[:, 1]
    stress = np.zeros((space.npoints, 6))
    stress[:, 1] = WEIGHT * depth
    stress[:, 0] = stress[:, 2] = POISSON / (1 - POISSON) * WEIGHT * depth
    kept = {f"layer_{i}": WEIGHT for i in range(layers - dug)}
    gone = tuple(f"layer_{i}" for i in range(layers - dug, layers))
    dig = Stage("dig", ROLLERS, (Gravity(kept),), absent=gone, released=released, **STEP)
    steps = run(space, filled(space, stress=stress), dig)
    floor = float(layers - dug)
    heave = WEIGHT * dug * floor / OEDOMETER
    assert height_of(space, steps[-1], floor) == pytest.approx(heave, rel=1e-10)
    assert height_of(space, steps[0], floor) == pytest.approx(heave * (0.5 if released else 1.0), rel=1e-10)
    assert height_of(space, steps[-1], float(layers)) == 0.0
    assert steps[-1].zones.keys() == kept.keys()
    left = np.concatenate([steps[-1].states[name].stress for name in kept])
    np.testing.assert_allclose(left[:, 1], WEIGHT * (floor - space.points[: len(left), 1]), rtol=1e-9, atol=1e-9)
    assert reaction(space, steps[-1], "bottom", "y") == pytest.approx(WEIGHT * floor, rel=1e-10)


def test_a_changed_material_answers_with_its_own_stiffness() -> None:
    space, q = layered(2), 50.0
    stiffer = Elastic(3.0 * YOUNG, POISSON)
    change = Change(stiffer, None, lambda state: initial_state(stiffer, None, state.stress))
    first = Stage("soft", ROLLERS, (Pressure("top", q),), zero_displacement=True, **STEP)
    second = Stage("stiff", ROLLERS, (Pressure("top", q, 1.0, 2.0),), changes={"layer_0": change}, **STEP)
    end = run(space, filled(space), first, second)[-1]
    assert height_of(space, end, 1.0) == pytest.approx(-q / OEDOMETER / 3.0, rel=1e-10)
    assert height_of(space, end, 2.0) == pytest.approx(-q / OEDOMETER * (1.0 + 1.0 / 3.0), rel=1e-10)


def test_a_change_that_the_stress_forbids_stops_the_run_with_a_sentence() -> None:
    def begin(state: Any) -> Any:
        raise ValueError("the stress lies outside")

    space = layered(2)
    stage = Stage("change", ROLLERS, (), changes={"layer_0": Change(SOIL, None, begin)})
    (end,) = march(Model(space, filled(space), (stage,)))
    assert isinstance(end, Stopped)
    assert "the stress lies outside" in end.reason


def test_a_load_follows_its_table_and_increments_end_where_it_bends() -> None:
    space, q = layered(1), 40.0
    table = ((0.0, 0.0), (0.3, q), (0.7, q), (1.0, 0.25 * q))
    steps = run(
        space, filled(space), Stage("ramp", ROLLERS, (Pressure("top", 1.0, table=table),), first=0.2, largest=0.5)
    )
    assert {0.3, 0.7, 1.0} <= {step.fraction for step in steps}
    for step in steps:
        load = float(np.interp(step.fraction, *np.transpose(table)))
        assert height_of(space, step, 1.0) == pytest.approx(-load / OEDOMETER, rel=1e-9, abs=1e-15)


WIDTH, HEIGHT = 2.0, 3.0
BEAM = Elastic(YOUNG, 0.0)
BASE = (Support("bottom", "x"), Support("bottom", "y"))


def beam(kind: str = "quad8") -> Space:
    return build_space(box_mesh(kind, (4, 6), (0.0, 0.0), (WIDTH, HEIGHT)), KINEMATICS["plane_strain"])


@pytest.mark.parametrize("ties", [("x", "y"), ("y",)], ids=["rough", "smooth"])
@pytest.mark.parametrize("eccentric", [0.0, 0.3])
def test_a_platen_bends_a_column_as_a_beam(ties: tuple[str, ...], eccentric: float) -> None:
    """With ν = 0 the column is a beam exactly: θ = M H/EI, u_y = -F H/EA, u_x = κ y²/2."""
    space, force = beam(), 100.0
    body = RigidBody("top", ties, (0.5 * WIDTH + eccentric, HEIGHT))
    stage = Stage("push", BASE, (BodyForce(body, {"y": -force}),), bodies=(body,), **STEP)
    end = run(space, filled(space, BEAM), stage)[-1]
    u = end.displacement.reshape(-1, 2)
    top = space.mesh.points[:, 1] == HEIGHT
    turn = -force * eccentric * HEIGHT / (YOUNG * WIDTH**3 / 12.0)
    down = -force * HEIGHT / (YOUNG * WIDTH)
    x = space.mesh.points[top, 0] - 0.5 * WIDTH
    np.testing.assert_allclose(u[top, 1], down + turn * x, rtol=1e-9)
    np.testing.assert_allclose(u[top, 0], -0.5 * turn * HEIGHT, rtol=1e-9, atol=1e-12)
    assert reaction(space, end, "top", "y") == pytest.approx(-force, rel=1e-10)


def test_a_platen_that_is_moved_is_a_pair_of_supports() -> None:
    space, material = beam(), VonMises(YOUNG, 0.3, 20.0, 100.0)
    supports = (Support("top", "x"), Support("top", "y", -0.05))
    body = RigidBody("top", ("x", "y"), (0.3, 0.2), {"x": 0.0, "y": -0.05, "rotation": 0.0})
    ends = [
        run(space, filled(space, material), Stage("a", (*BASE, *more), bodies=bodies, first=0.1, largest=0.1))[-1]
        for more, bodies in ((supports, ()), ((), (body,)))
    ]
    np.testing.assert_array_equal(ends[0].displacement, ends[1].displacement)


def test_a_guided_platen_and_its_force_are_inverse_to_each_other() -> None:
    """What the free motions are under forces, prescribed, gives the forces back."""
    space = beam("triangle6")
    body = RigidBody("top", ("x", "y"), (0.4, HEIGHT))
    asked = {"x": 3.0, "y": -50.0, "rotation": 8.0}
    pushed = Stage("push", BASE, (BodyForce(body, asked),), bodies=(body,), **STEP)
    material = Elastic(YOUNG, 0.3)
    u = run(space, filled(space, material), pushed)[-1].displacement.reshape(-1, 2)
    corner = [int(np.flatnonzero((space.mesh.points == at).all(axis=1))[0]) for at in ((0.0, HEIGHT), (WIDTH, HEIGHT))]
    turn = (u[corner[1], 1] - u[corner[0], 1]) / WIDTH
    motion = {"x": u[corner[0], 0], "y": u[corner[0], 1] + 0.4 * turn, "rotation": turn}
    moved = Stage("move", BASE, bodies=(replace(body, motion=motion),), **STEP)
    end = run(space, filled(space, material), moved)[-1]
    assert reaction(space, end, "top", "x") == pytest.approx(asked["x"], rel=1e-9)
    assert reaction(space, end, "top", "y") == pytest.approx(asked["y"], rel=1e-9)
    dofs = space.dofs_on("top", "y")
    arm = space.mesh.points[dofs // 2, 0] - 0.4
    assert ((end.internal_force - end.external_force)[dofs] * arm).sum() == pytest.approx(asked["rotation"], rel=1e-9)


def named(mesh: Mesh, **parts: np.ndarray) -> Mesh:
    facets = {name: outer_facets(mesh.cells, mesh.cell_type, np.flatnonzero(mask)) for name, mask in parts.items()}
    return replace(mesh, boundaries=mesh.boundaries | facets)


def test_half_a_body_on_a_plane_of_symmetry_settles_as_the_whole() -> None:
    """The node on the plane is held across it, which the body must respect; its rotation is guided."""
    settled = []
    for left in (-2.0, 0.0):
        mesh = box_mesh("quad8", (round(2 - left) * 4, 8), (left, -2.0), (2.0, 0.0))
        top = (mesh.points[:, 1] == 0.0) & (np.abs(mesh.points[:, 0]) <= 0.5)
        space = build_space(named(mesh, footing=top), KINEMATICS["plane_strain"])
        body = RigidBody("footing", ("x", "y"), (0.0, 0.0), {"rotation": 0.0})
        share = 1.0 if left else 0.5
        stage = Stage(
            "push", (*ROLLERS, Support("bottom", "x")), (BodyForce(body, {"y": -10.0 * share}),), bodies=(body,)
        )
        end = run(space, filled(space), stage)[-1]
        settled.append(end.displacement[space.dofs_on("footing", "y")].mean())
    assert settled[0] == pytest.approx(settled[1], rel=1e-9)


@pytest.mark.parametrize("kinematics", ["axisymmetric", "axisymmetric_torsion", "solid"])
def test_platens_of_every_kinematics(kinematics: str) -> None:
    """A smooth platen compresses a bar, ν = 0, by F H/EA."""
    solid = kinematics == "solid"
    mesh = (
        box_mesh("hexahedron20", (1, 1, 1), (0, 0, 0), (1, 1, 2))
        if solid
        else box_mesh("quad8", (2, 2), (0, 0), (1, 2))
    )
    space = build_space(mesh, KINEMATICS[kinematics])
    up, area = ("z", 1.0) if solid else ("z", np.pi)
    held = [Support("bottom", component) for component in space.components]
    free = {"rotation_x": 0.0, "rotation_y": 0.0} if solid else {}
    body = RigidBody("top", (up,), (0.5, 0.5, 2.0)[: mesh.dim], free)
    stage = Stage("push", tuple(held), (BodyForce(body, {"z": -6.0}),), bodies=(body,))
    end = run(space, filled(space, BEAM), stage)[-1]
    assert end.displacement[space.dofs_on("top", up)] == pytest.approx(-6.0 * 2.0 / (YOUNG * area), rel=1e-9)


BAD: dict[str, tuple[tuple[RigidBody, ...], tuple[Load, ...], str]] = {}
PLATEN = RigidBody("top", ("y",), (1.0, HEIGHT))
BAD["unknown motion"] = ((replace(PLATEN, motion={"z": 1.0}),), (), "no motion 'z'")
BAD["point of another dimension"] = ((replace(PLATEN, point=(1.0, 2.0, 3.0)),), (), "2 coordinates, not 3")
BAD["force that a smooth one slips under"] = ((PLATEN,), (BodyForce(PLATEN, {"x": 1.0}),), "cannot hand on a force")
BAD["shared nodes"] = ((PLATEN, replace(PLATEN, ties=("x", "y"))), (), "share a node")
BAD["against a support"] = ((RigidBody("bottom", ("x", "y"), (1.0, 0.0), {"y": 1.0}),), (), "another support forbids")


@pytest.mark.parametrize("name", BAD)
def test_bodies_that_cannot_be_are_refused(name: str) -> None:
    bodies, loads, words = BAD[name]
    space = beam()
    stage = Stage("bad", BASE, loads, bodies=bodies)
    with pytest.raises(ValueError, match=words):
        list(march(Model(space, filled(space), (stage,))))


def test_a_body_alone_does_not_hold_the_ground() -> None:
    free = RigidBody("top", ("x", "y"), (1.0, HEIGHT))
    with pytest.raises(ValueError, match="3 rigid motions"):
        constrain(beam(), (), (free,))
    guided = replace(free, motion={"x": 0.0, "y": -0.1, "rotation": 0.0})
    assert constrain(beam(), (), (guided,)).ties.shape[1] == 0
