"""From a case to a problem that can be marched: the only place where the parts are wired together.

What is wrong in a case and can only be seen here (a boundary that the mesh lacks, a preset nobody knows) raises
`CaseError` with one sentence naming the place in the file.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import umat
from fabfem.boundary_value.conditioning import conditioning_columns
from fabfem.boundary_value.discretisation import FIELD, Discretisation
from fabfem.boundary_value.errors import error_columns
from fabfem.boundary_value.fields import known_fields, point_tensors
from fabfem.boundary_value.ground import ground_in_words, ground_stress, zones_of
from fabfem.boundary_value.hollow_cylinder import hollow_cylinder_columns
from fabfem.boundary_value.meshes import hash_of, mesh_of, mesh_place
from fabfem.boundary_value.omitted import left_out
from fabfem.boundary_value.probes import Column, columns
from fabfem.boundary_value.program import Scene, program
from fabfem.boundary_value.water import pore_water
from fabfem.case import BoundaryValueCase, CaseError, boundaries_of, nearest, suggest, zones_named
from fabfem.case.materials import ChangHicher
from fabfem.fem.constraints import constrain
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import loading
from fabfem.fem.mesh import Mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.porous_space import porous
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Stage
from fabfem.fem.systems import absent_dofs
from fabfem.parallel.world import communicator, share_cores, shared
from fabfem.substance import MisfitError, Substance, Surroundings, substance
from umat.mandel import IDENTITY


@dataclass(frozen=True)
class Problem:
    """A case, ready to be marched.

    Attributes
    ----------
    case : Case
        What was asked.
    model : Model
        Space, zones, stages and controls.
    columns : tuple of Column
        Columns of the history.
    mesh_error : Discretisation or None
        Estimate of the mesh's error, where the case asks for it.
    omitted : tuple of str
        Sentences on what the scene leaves out.
    """

    case: BoundaryValueCase
    model: Model
    columns: tuple[Column, ...]
    mesh_error: Discretisation | None
    omitted: tuple[str, ...]


def build(case: BoundaryValueCase) -> Problem:
    """Return the problem that a case states.

    Raises
    ------
    CaseError
        If the case names something that is not there, or cannot be run.
    """
    space = _space(case)
    substances = {name: _substance(case, name, space) for name in case.material}
    zones = {zone: filled for name in case.material for zone, filled in _zones(case, name, space, substances[name])}
    stages = _stages(case, space, substances, zones)
    with _blamed(case, "material"):
        known = known_fields(zones | dict(_spare(substances, zones)), case.water is not None)
    _check_fields(case, known)
    _check_probes(case, zones)
    with _blamed(case, "material"):
        filling = {zone: name for name in case.material for zone in zones_of(case, name, space.mesh)}
        water = pore_water(case, space, zones, filling)
        model = Model(space, zones, stages, _controls(case), case.solver.linear, water)
    with _blamed(case, "probe or reaction"):
        found = columns(case, space, stages)
    with _blamed(case, "hollow_cylinder"):
        found = (*found, *hollow_cylinder_columns(case, space))
    with _blamed(case, "errors"):
        errors, mesh_error = error_columns(case, model, lambda rule: _with_rule(case, space, rule))
    diagnosed = conditioning_columns(model) if case.solver.diagnose else ()
    if case.solver.threads and not shared(case):
        umat.set_threads(case.solver.threads)
    omitted = tuple(left_out(case, space, known, substances))
    return Problem(case, model, (*found, *errors, *diagnosed), mesh_error, omitted)


def _space(case: BoundaryValueCase) -> Space:
    with _blamed(case, mesh_place(case)):
        mesh = _mesh(case)
    _check_names(case, mesh)
    kinematics = KINEMATICS[case.scene.kinematics]
    with _blamed(case, "mesh.points" if case.mesh.points else "scene.kinematics"):
        space = build_space(mesh, replace(kinematics, mean_dilation=_mean_dilation(case, mesh)), case.mesh.points)
    with _blamed(case, "water.excess"):
        return porous(space) if case.water is not None and case.water.excess else space


def _mesh(case: BoundaryValueCase) -> Mesh:
    """Return the mesh of a case, or this process's part of it where several share the run."""
    if not shared(case):
        return mesh_of(case)
    with _blamed(case, "solver.linear"):
        comm = communicator(case)
    from fabfem.parallel.team import mustered

    whole = mustered(lambda: mesh_of(case), lambda mesh: _mean_dilation(case, mesh), comm)
    from fabfem.parallel.partition import divided
    from fabfem.parallel.solver import Settings

    mesh = divided(whole, hash_of, Settings(case.solver.linear == "multigrid", case.solver.petsc))
    share_cores(whole.comm, case.solver.threads)
    return mesh


def _mean_dilation(case: BoundaryValueCase, mesh: Mesh) -> bool:
    """Return whether the volume strain is a mean over patches: what the case says, or for linear elements."""
    said = case.mesh.volume_strain
    return not mesh.element.linear if said is None else said == "mean"


def _substance(case: BoundaryValueCase, name: str, space: Space) -> Substance:
    with _blamed(case, f"material.{name}"):
        return substance(case.material[name], _surroundings(case, space))


def _surroundings(case: BoundaryValueCase, space: Space) -> Surroundings:
    flat = case.scene.kinematics in ("plane_strain", "axisymmetric")
    return Surroundings(case.unit_system, space.mesh.dim - 1, flat, case.path.parent)


def _with_rule(case: BoundaryValueCase, space: Space, rule: str | None) -> dict[str, Substance]:
    """Return the substance of each zone that has contact directions, with another rule of them or its own."""
    found: dict[str, Substance] = {}
    for name, table in case.material.items():
        if isinstance(table, ChangHicher):
            try:
                filling = substance(
                    table.model_copy(update={"directions": rule or table.directions}), _surroundings(case, space)
                )
            except MisfitError as error:
                raise CaseError(f"{case.path.name}: errors.rule: {error}") from error
            found |= dict.fromkeys(zones_of(case, name, space.mesh), filling)
    return found


def _zones(case: BoundaryValueCase, name: str, space: Space, filling: Substance) -> Iterator[tuple[str, Zone]]:
    for zone in zones_of(case, name, space.mesh):
        with _blamed(case, f"stage[{case.stage[0].name}]"):
            stress = ground_stress(case, space, name, zone)
        with _blamed(case, f"material.{name}", partial(ground_in_words, case, stress)):
            state = umat.initial_state(filling.material, filling.directions, stress, **filling.needs)
        yield zone, Zone(filling.material, filling.directions, state, space.points_of(space.mesh.zone(zone)))


def _stages(
    case: BoundaryValueCase, space: Space, substances: Mapping[str, Substance], zones: Mapping[str, Zone]
) -> tuple[Stage, ...]:
    found, course = [], program(Scene(case, space, substances))
    for said in case.stage:
        with _blamed(case, f"stage[{said.name}]"):
            stage = next(course)
            gone = absent_dofs(space, {zone: zones[zone] for zone in stage.absent})
            constrain(space, stage.supports, stage.bodies, gone)
            loading(space, stage.loads)
        found.append(stage)
    return tuple(found)


def _spare(substances: Mapping[str, Substance], zones: Mapping[str, Zone]) -> Iterator[tuple[str, Zone]]:
    """Yield (name, zone of one point) of the materials that no zone has at first, for the fields that they have."""
    used = [zone.material for zone in zones.values()]
    for name, spare in substances.items():
        if spare.material not in used:
            state = umat.initial_state(spare.material, spare.directions, IDENTITY[None], **spare.needs)
            yield f"[{name}]", Zone(spare.material, spare.directions, state, slice(0, 0))


def _controls(case: BoundaryValueCase) -> Controls:
    said = case.solver
    return Controls(said.tolerance, said.iterations, viscosity=said.viscosity, held=said.held)


def _check_names(case: BoundaryValueCase, mesh: Mesh) -> None:
    """Refuse boundaries and zones that the mesh does not have."""
    for where, kind, name in _named(case):
        there = mesh.zones if kind == "zone" else mesh.boundaries
        if name not in there:
            listed = ", ".join(sorted(there)) or "none"
            close = nearest(name, there)
            hint = f"did you mean '{close}'? The mesh has {listed}" if close else f"it has {listed}"
            raise CaseError(f"{case.path.name}: {where}: the mesh has no {kind} '{name}'; {hint}")


def _named(case: BoundaryValueCase) -> Iterator[tuple[str, str, str]]:
    """Yield (place, kind, name) of every zone and boundary that a case names."""
    for place, names in zones_named(case):
        yield from ((place, "zone", name) for name in names)
    for place, names in boundaries_of(case):
        yield from ((place, "boundary", name) for name in names)


def _check_fields(case: BoundaryValueCase, known: Sequence[str]) -> None:
    estimated = (FIELD,) if case.errors and "discretisation" in case.errors.estimate else ()
    known = (*known, *estimated)
    for name in case.output.fields if case.output else ():
        if name not in known:
            raise CaseError(
                f"{case.path.name}: output.fields: no material here has a field '{name}'{suggest(name, known)}"
            )


def _check_probes(case: BoundaryValueCase, zones: Mapping[str, Zone]) -> None:
    """Refuse probes of fields that no point has, or that do not say which entry of a tensor they mean."""
    tensors = point_tensors(zones)
    for probe in case.probe:
        if probe.field is None:
            continue
        where = f"{case.path.name}: probe[{probe.name}]"
        if probe.field not in tensors:
            hint = suggest(probe.field, tensors)
            raise CaseError(f"{where}.field: no material here has a field '{probe.field}' at its points{hint}")
        if tensors[probe.field] != (probe.entry is not None):
            what = "a tensor and needs an entry, such as xx" if tensors[probe.field] else "a number and has no entry"
            raise CaseError(f"{where}.entry: '{probe.field}' is {what}")


@contextmanager
def _blamed(case: BoundaryValueCase, place: str, tail: Callable[[], str] = str) -> Iterator[None]:
    """Turn a refusal of the parts into a sentence that names the place in the case, with a tail that explains it."""
    try:
        yield
    except CaseError:
        raise
    except ValueError as error:
        where = f"{place}.{error.key}" if isinstance(error, MisfitError) else place
        raise CaseError(f"{case.path.name}: {where}: {str(error).rstrip('.')}{tail()}") from error
