"""From the stages of a case to those of the finite-element side, which hold only what each names.

In a case, gravity, pressures and tractions stay until a later stage changes them; here every stage says them all.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

import umat
from fabfem.boundary_value.ground import absent_at_first, zones_of
from fabfem.boundary_value.water import weight_at_points
from fabfem.case import BoundaryValueCase, stages
from fabfem.case.stages import AnyStage, Geostatic, Load, StrengthReduction
from fabfem.case.stages import Gravity as Weight
from fabfem.fem.loads import BodyForce, Gravity, Pressure, Traction
from fabfem.fem.loads import Load as Acting
from fabfem.fem.porous_space import PORE_PRESSURE
from fabfem.fem.space import Space
from fabfem.fem.stages import ArcLength, Change, DisplacementControl, Goal, Stage, StrengthSearch
from fabfem.fem.supports import RigidBody, Support
from fabfem.substance import Substance

Table = tuple[tuple[float, float], ...]


class Course(NamedTuple):
    """How a load goes through a stage."""

    start: float
    end: float
    table: Table = ()


class Scene(NamedTuple):
    """What the stages of a case refer to."""

    case: BoundaryValueCase
    space: Space
    substances: Mapping[str, Substance]


class Standing(NamedTuple):
    """What one stage leaves to the next."""

    factors: Mapping[tuple[str, ...], float]
    """Size of each load, by what it is and where it acts."""
    gravity: float
    strength: float
    absent: frozenset[str]


def program(scene: Scene) -> Iterator[Stage]:
    """Yield the stages of a case; ValueError where one is impossible."""
    now = Standing({}, 0.0, 1.0, absent_at_first(scene.case))
    for said in scene.case.stage:
        stage, now = _stage(scene, said, now)
        yield stage


def _stage(scene: Scene, said: AnyStage, before: Standing) -> tuple[Stage, Standing]:
    case, steps = scene.case, said.increments
    added, removed = (set(getattr(said, key, None) or ()) for key in ("add", "remove"))
    absent = (before.absent - added) | removed
    gravity = _gravity(said, before)
    strength = said.strength_factor if isinstance(said, Weight) else before.strength
    courses = _courses(scene, said, before, gravity, absent)
    bodies = tuple(_body(scene.space, rigid) for rigid in said.rigid) if isinstance(said, Load) else ()
    loads = tuple(_acting(scene, key, course, bodies) for key, course in courses.items() if _acts(key, bodies))
    stage = Stage(
        name=said.name,
        supports=(*_fixed(case), *_moved(said), *_drains(said)),
        loads=loads,
        first=steps.initial,
        largest=steps.maximum,
        smallest=steps.minimum,
        zero_displacement=isinstance(said, Geostatic | Weight) or (isinstance(said, Load) and said.zero_displacement),
        duration=said.duration if isinstance(said, Load) else 1.0,
        bodies=bodies,
        absent=tuple(sorted(absent)),
        changes=dict(_changes(scene, said)),
        released=bool(added or removed),
        strength=strength,
        spared=(said.excluded_zones or ()) if isinstance(said, StrengthReduction) else (),
        goal=_goal(said),
        drainage=said.drainage if isinstance(said, Load) else "drained",
        time_tolerance=said.time_tolerance if isinstance(said, Load) else 0.0,
    )
    ends = {key: course.table[-1][1] if course.table else course.end for key, course in courses.items()}
    return stage, Standing(ends, gravity, strength, frozenset(absent))


def _gravity(said: AnyStage, before: Standing) -> float:
    """Return the factor of gravity at the end of a stage."""
    named = 1.0 if isinstance(said, Geostatic) else getattr(said, "gravity", None)
    return before.gravity if named is None else float(named)


def _courses(
    scene: Scene, said: AnyStage, before: Standing, gravity: float, absent: set[str] | frozenset[str]
) -> dict[tuple[str, ...], Course]:
    """Return how each load goes through a stage; in the first one those of level ground act from the start."""
    named = dict(_named(scene, said))
    still = {key: Course(size, size) for key, size in before.factors.items()}
    found = still | {
        key: course._replace(start=_start(said, key, course, before.factors)) for key, course in named.items()
    }
    for zone in [zone for name in scene.case.material for zone in _filled(scene, name)]:
        key = ("gravity", zone)
        found.pop(key, None)
        if zone not in absent:
            start = gravity if isinstance(said, Geostatic) else before.factors.get(key, 0.0)
            found[key] = Course(start, gravity)
    return found


def _filled(scene: Scene, material: str) -> tuple[str, ...]:
    return zones_of(scene.case, material, scene.space.mesh)


def _start(said: AnyStage, key: tuple[str, ...], course: Course, factors: Mapping[tuple[str, ...], float]) -> float:
    at_once = isinstance(said, Geostatic) or (isinstance(said, Weight) and key[0] == "pressure" and said.initial_stress)
    return course.end if at_once else factors.get(key, 0.0)


def _named(scene: Scene, said: AnyStage) -> Iterator[tuple[tuple[str, ...], Course]]:
    """Yield the loads that a stage names, with what they are at its end."""
    duration = said.duration if isinstance(said, Load) else 1.0
    for pressure in said.pressure:
        for boundary in pressure.boundary:
            yield ("pressure", boundary), Course(0.0, pressure.value, _table(pressure, pressure.value, duration))
    for traction in said.traction:
        for component, value in traction.components().items():
            for boundary in traction.boundary:
                yield ("traction", boundary, component), Course(0.0, value, _table(traction, value, duration))
    for rigid in said.rigid if isinstance(said, Load) else ():
        for motion, value in rigid.force.items():
            yield ("rigid", rigid.boundary, motion), Course(0.0, value)


def _table(said: stages.Ramped, value: float, duration: float) -> Table:
    """Return the table of a load by fraction of the stage, complete to its end."""
    if said.ramp is None:
        return ()
    times, factors = np.transpose(said.ramp)
    known = {*(times / duration), 0.0, 1.0}
    return tuple(
        (float(at), float(value * np.interp(at * duration, times, factors))) for at in sorted(known) if at <= 1
    )


def _acts(key: tuple[str, ...], bodies: Sequence[RigidBody]) -> bool:
    return key[0] != "rigid" or key[1] in [body.boundary for body in bodies]


def _acting(scene: Scene, key: tuple[str, ...], course: Course, bodies: Sequence[RigidBody]) -> Acting:
    start, end, table = course
    if key[0] == "gravity":
        material = {zone: name for name in scene.case.material for zone in _filled(scene, name)}[key[1]]
        weight = weight_at_points(scene.case, scene.space, material, key[1])
        return Gravity({key[1]: weight}, start=start, end=end)
    if key[0] == "pressure":
        return Pressure(key[1], 1.0, start, end, table)
    if key[0] == "rigid":
        (body,) = (body for body in bodies if body.boundary == key[1])
        return BodyForce(body, {key[2]: 1.0}, start, end, table)
    unit = tuple(float(component == key[2]) for component in scene.space.components)
    return Traction(key[1], unit, start, end, table)


def _body(space: Space, said: stages.Rigid) -> RigidBody:
    """Return the rigid body on a boundary; ValueError for a bent one that is not rough, or ribs without torsion."""
    points, ranks = space.mesh.points[space.mesh.nodes_on(said.boundary)], space.mesh.ranks
    low = ranks.least(points.min(axis=0, initial=np.inf))
    high = ranks.largest(points.max(axis=0, initial=-np.inf))
    across = int(np.argmin(high - low))
    if said.contact != "rough" and high[across] - low[across] > 1e-9 * (high - low).max():
        raise ValueError(f"a {said.contact} rigid body needs a boundary along an axis, which '{said.boundary}' is not")
    if said.contact == "ribbed" and "theta" not in space.components:
        raise ValueError("a ribbed rigid body needs the kinematics axisymmetric_torsion")
    ties = {
        "rough": space.components,
        "smooth": (space.components[across],),
        "ribbed": (space.components[across], "theta"),
    }[said.contact]
    point = tuple(0.5 * (low + high)) if said.point is None else said.point
    return RigidBody(said.boundary, ties, point, {str(name): value for name, value in said.motion.items()})


def _changes(scene: Scene, said: AnyStage) -> Iterator[tuple[str, Change]]:
    for entry in said.change if isinstance(said, Load) else ():
        for zone in entry.zones:
            yield zone, _change(scene.substances[entry.material])


def _change(new: Substance) -> Change:
    return Change(
        *(new.material, new.directions),
        begin=lambda state: umat.initial_state(new.material, new.directions, state.stress, **new.needs),
    )


def _goal(said: AnyStage) -> Goal | None:
    if isinstance(said, StrengthReduction):
        return StrengthSearch(said.step, said.largest, said.tolerance, said.growth, said.failure_displacement)
    control = said.control if isinstance(said, Load) else None
    if isinstance(control, stages.DisplacementControl):
        terms = [
            (name, term.component, term.factor / len(term.boundary)) for term in control.terms for name in term.boundary
        ]
        return DisplacementControl(tuple(terms), control.change)
    return None if control is None else ArcLength(control.length)


def _fixed(case: BoundaryValueCase) -> Iterable[Support]:
    return (
        Support(boundary, part) for support in case.support for boundary in support.boundary for part in support.fix
    )


def _drains(said: AnyStage) -> Iterable[Support]:
    names = (said.drains or ()) if isinstance(said, Load) else ()
    return (Support(boundary, PORE_PRESSURE) for boundary in names)


def _moved(said: AnyStage) -> Sequence[Support]:
    if not isinstance(said, Load):
        return ()
    return [
        Support(boundary, component, value)
        for motion in said.displacement
        for boundary in motion.boundary
        for component, value in motion.components().items()
    ]
