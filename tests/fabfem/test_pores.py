"""Pore water beside displacement: consolidation and undrained loading against exact answers."""

from dataclasses import replace

import numpy as np
import pytest

import umat
from fabfem.fem.box import box_mesh
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import BodyForce, Load, Pressure
from fabfem.fem.mesh import Mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.pores import PoreWater
from fabfem.fem.porous_space import PORE_PRESSURE, PorousSpace, porous
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import RigidBody, Support

E, MOBILITY = 1e4, 1e-4
TERZAGHI = {0.05: 0.252313, 0.1: 0.356823, 0.2: 0.504088, 0.5: 0.763950, 1.0: 0.931260}
MANDEL = {0.01: 1.04376, 0.05: 1.09888, 0.1: 1.09541, 0.2: 0.96811, 0.5: 0.59279}
CRYER = {0.0: (1.57543, 0.0627), 0.25: (1.30754, 0.0494)}


def oedometric(nu: float) -> float:
    return E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))


def run(space: PorousSpace, nu: float, stages: tuple[Stage, ...], storage: float = 0.0, solver: str = "auto"):
    material = umat.Elastic(E, nu)
    state = umat.initial_state(material, None, np.zeros((space.npoints, 6)))
    water = PoreWater(np.full(space.npoints, storage), np.full(space.npoints, MOBILITY))
    zones = {"all": Zone(material, None, state, slice(0, space.npoints))}
    steps = list(march(Model(space, zones, stages, Controls(tolerance=1e-9), solver, water)))
    assert all(isinstance(step, Increment) for step in steps), steps[-1]
    return steps


def consolidation(
    supports: tuple[Support, ...], drains: tuple[str, ...], load: Load, time: float, **more
) -> tuple[Stage, ...]:
    """An undrained step of the whole load, then flow towards the drains."""
    loading = Stage("load", supports, (load,), first=1.0, largest=1.0, drainage="undrained", **more)
    open_ = (*supports, *(Support(drain, PORE_PRESSURE) for drain in drains))
    flow = Stage(
        *("flow", open_, (replace(load, start=1.0),)),
        **{"first": 1e-4, "largest": 0.1, "smallest": 1e-8, "drainage": "seepage", "duration": time},
        **{"time_tolerance": 3e-4, **more},
    )
    return loading, flow


def column(rows: int) -> PorousSpace:
    return porous(build_space(box_mesh("quad8", (1, rows), (0, 0), (0.1, 1.0)), KINEMATICS["plane_strain"]))


ROLLERS = (Support("left", "x"), Support("right", "x"), Support("bottom", "y"))


@pytest.mark.parametrize("solver", ["superlu", "auto"])
def test_a_layer_consolidates_as_terzaghi_says(solver: str) -> None:
    """Degree of consolidation of a layer with one drained side."""
    space, stiff = column(20), oedometric(0.2)
    rate = MOBILITY * stiff
    steps = run(space, 0.2, consolidation(ROLLERS, ("top",), Pressure("top", 100.0), 1.0 / rate), solver=solver)
    top = space.dofs_on("top", "y")
    times = [(step.time - 1.0) * rate for step in steps]
    degrees = [-step.displacement[top].mean() * stiff / 100.0 for step in steps]
    np.testing.assert_allclose(np.interp(list(TERZAGHI), times, degrees), list(TERZAGHI.values()), rtol=0.01)
    np.testing.assert_allclose(steps[0].displacement[space.nmotion :], 100.0, rtol=1e-9)


def test_a_slab_shows_the_pressure_of_mandel() -> None:
    """The pressure at the centre of a slab between rigid plates rises before it falls."""
    space = porous(build_space(box_mesh("quad8", (24, 1), (0, 0), (1.0, 0.1)), KINEMATICS["plane_strain"]))
    plate = RigidBody("top", ("y",), (0.0, 0.1), {"x": 0.0, "rotation": 0.0})
    supports = (Support("left", "x"), Support("bottom", "y"))
    load = BodyForce(plate, {"y": -100.0})
    rate = MOBILITY * oedometric(0.2)
    steps = run(space, 0.2, consolidation(supports, ("right",), load, 0.6 / rate, bodies=(plate,)))
    centre = [step.displacement[space.dofs_on("left", PORE_PRESSURE)].mean() for step in steps]
    assert centre[0] == pytest.approx(50.0, rel=1e-6)
    times = [(step.time - 1.0) * rate for step in steps]
    np.testing.assert_allclose(np.interp(list(MANDEL), times, centre) / 50.0, list(MANDEL.values()), rtol=0.01)


def quarter_disc(n: int) -> Mesh:
    """A square drawn onto a quarter of a disc of radius 1."""
    mesh = box_mesh("quad8", (n, n), (0, 0), (1, 1))
    x, y = mesh.points.T
    points = np.column_stack([x * np.sqrt(1.0 - 0.5 * y**2), y * np.sqrt(1.0 - 0.5 * x**2)])
    return replace(mesh, points=points)


@pytest.mark.parametrize("nu", CRYER)
def test_a_sphere_shows_the_pressure_of_cryer(nu: float) -> None:
    """The pressure at the centre of a sphere under pressure rises above it (Mandel-Cryer effect)."""
    mesh = quarter_disc(10)
    skin = np.concatenate([mesh.boundary("top"), mesh.boundary("right")])
    mesh = replace(mesh, boundaries={**mesh.boundaries, "skin": skin})
    space = porous(build_space(mesh, KINEMATICS["axisymmetric"]))
    supports = (Support("left", "r"), Support("bottom", "z"))
    rate = MOBILITY * oedometric(nu)
    steps = run(space, nu, consolidation(supports, ("skin",), Pressure("skin", 100.0), 0.2 / rate))
    centre = int(np.argmin(np.linalg.norm(mesh.points[space.pressure_nodes], axis=1)))
    pressure = np.array([step.displacement[space.nmotion + centre] for step in steps]) / 100.0
    times = np.array([(step.time - 1.0) * rate for step in steps])
    peak, when = CRYER[nu]
    assert pressure.max() == pytest.approx(peak, rel=0.01)
    assert times[pressure.argmax()] == pytest.approx(when, rel=0.15)  # the peak is flat


@pytest.mark.parametrize("ratio", [1e2, 1e4, np.inf])
def test_an_undrained_tube_is_elastic_with_the_undrained_modulus(ratio: float) -> None:
    """A thick tube, undrained: Lamé's answer with the undrained modulus; no locking, no checkerboard."""
    a, b, inside, nu = 0.1, 0.2, 60.0, 0.2
    space = porous(build_space(box_mesh("quad8", (8, 4), (a, 0), (b, 0.1)), KINEMATICS["axisymmetric"]))
    supports = (Support("bottom", "z"), Support("top", "z"))
    stage = Stage("load", supports, (Pressure("left", inside),), first=1.0, largest=1.0, drainage="undrained")
    (step,) = run(space, nu, (stage,), storage=3.0 * (1.0 - 2.0 * nu) / E / ratio)
    shear, bulk = E / (2.0 * (1.0 + nu)), E / (3.0 * (1.0 - 2.0 * nu)) * (1.0 + ratio)
    poisson = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear) if np.isfinite(ratio) else 0.5
    k = inside * a**2 / (b**2 - a**2)
    radius = space.mesh.points[:, 0]
    exact = k / (2.0 * shear) * ((1.0 - 2.0 * poisson) * radius + b**2 / radius)
    np.testing.assert_allclose(step.displacement[: space.nmotion : 2], exact, rtol=1e-3)
    total = step.states["all"].stress[:, 0] + space.point_pressure(step.displacement)
    np.testing.assert_allclose(total, -k * (1.0 - b**2 / space.points[:, 0] ** 2), atol=0.01 * inside)
    pressure = step.displacement[space.nmotion :]
    assert np.ptp(pressure) < 0.02 * inside  # the mean total stress of a tube is constant, so the pressure is


def test_small_time_steps_oscillate_no_more_than_their_resolution() -> None:
    """A step far below h²/(6 c_v) cannot be resolved; the pressures stay within a few per cent of the load."""
    space, stiff = column(10), oedometric(0.2)
    h, rate = 0.1, MOBILITY * stiff
    critical = h**2 / (6.0 * rate)
    loading, flow = consolidation(ROLLERS, ("top",), Pressure("top", 100.0), 1.0)
    for part, most in ((1.0, 100.5), (1e-3, 130.0)):
        time = part * critical
        once = replace(flow, duration=time, first=1.0, largest=1.0, time_tolerance=0.0)
        pressure = run(space, 0.2, (loading, once))[-1].displacement[space.nmotion :]
        assert pressure.min() > -1.0
        assert pressure.max() < most


def test_pore_pressure_needs_a_quadratic_displacement() -> None:
    with pytest.raises(ValueError, match="quadratic"):
        porous(build_space(box_mesh("quad", (1, 1), (0, 0), (1, 1)), KINEMATICS["plane_strain"]))
