"""From a case to a problem that can be marched: the only place where the parts are wired together.

What is wrong in a case and can only be seen here (a boundary that the mesh lacks, a preset nobody knows) raises
`CaseError` with one sentence naming the place in the file.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import umat
from fabfem.case import Case, CaseError, boundaries_of, nearest, suggest
from fabfem.fields import known_fields
from fabfem.kinematics import KINEMATICS
from fabfem.mesh import Mesh, read_mesh
from fabfem.model import Controls, Model, Zone
from fabfem.omitted import left_out
from fabfem.probes import Column, columns
from fabfem.program import ground_stress, program, zones_of
from fabfem.space import Space, build_space
from fabfem.stages import Stage
from fabfem.supports import constrain
from fabfem.zones import MisfitError, Substance, Surroundings, substance


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
    omitted : tuple of str
        Sentences on what the scene leaves out.
    """

    case: Case
    model: Model
    columns: tuple[Column, ...]
    omitted: tuple[str, ...]


def build(case: Case) -> Problem:
    """Return the problem that a case states.

    Raises
    ------
    CaseError
        If the case names something that is not there, or cannot be run.
    """
    space = _space(case)
    substances = {name: _substance(case, name, space) for name in case.material}
    zones = {zone: filled for name in case.material for zone, filled in _zones(case, name, space, substances[name])}
    _check_fields(case, zones)
    with _blamed(case, "material"):
        model = Model(space, zones, _stages(case, space), _controls(case), case.solver.linear)
    with _blamed(case, "probe or reaction"):
        found = columns(case, space)
    if case.solver.threads:
        umat.set_threads(case.solver.threads)
    return Problem(case, model, found, tuple(left_out(case, space, known_fields(zones), substances)))


def _space(case: Case) -> Space:
    with _blamed(case, "mesh.file"):
        mesh = read_mesh(case.locate(case.mesh.file), case.mesh.order)
    _check_names(case, mesh)
    with _blamed(case, "scene.kinematics"):
        return build_space(mesh, KINEMATICS[case.scene.kinematics])


def _substance(case: Case, name: str, space: Space) -> Substance:
    flat = case.scene.kinematics in ("plane_strain", "axisymmetric")
    with _blamed(case, f"material.{name}"):
        return substance(case.material[name], Surroundings(case.unit_system, space.mesh.dim - 1, flat))


def _zones(case: Case, name: str, space: Space, filling: Substance) -> Iterator[tuple[str, Zone]]:
    for zone in zones_of(case, name, space.mesh):
        with _blamed(case, f"stage[{case.stage[0].name}]"):
            stress = ground_stress(case, space, name, zone)
        with _blamed(case, f"material.{name}"):
            state = umat.initial_state(filling.material, filling.directions, stress, **filling.needs)
        yield zone, Zone(filling.material, filling.directions, state, space.points_of(space.mesh.zone(zone)))


def _stages(case: Case, space: Space) -> tuple[Stage, ...]:
    stages = program(case, space)
    for stage in stages:
        with _blamed(case, f"stage[{stage.name}]"):
            constrain(space, stage.supports)
    return stages


def _controls(case: Case) -> Controls:
    said = case.solver
    return Controls(said.tolerance, said.iterations, viscosity=said.viscosity, held=said.held)


def _check_names(case: Case, mesh: Mesh) -> None:
    """Refuse boundaries and zones that the mesh does not have."""
    for where, kind, name in _named(case):
        there = mesh.zones if kind == "zone" else mesh.boundaries
        if name not in there:
            listed = ", ".join(sorted(there)) or "none"
            close = nearest(name, there)
            hint = f"did you mean '{close}'? The mesh has {listed}" if close else f"it has {listed}"
            raise CaseError(f"{case.path.name}: {where}: the mesh has no {kind} '{name}'; {hint}")


def _named(case: Case) -> Iterator[tuple[str, str, str]]:
    """Yield (place, kind, name) of every zone and boundary that a case names."""
    for key, material in case.material.items():
        yield from ((f"material.{key}.zones", "zone", name) for name in material.zones or ())
    for place, names in boundaries_of(case):
        yield from ((place, "boundary", name) for name in names)


def _check_fields(case: Case, zones: Mapping[str, Zone]) -> None:
    known = known_fields(zones)
    for name in case.output.fields if case.output else ():
        if name not in known:
            raise CaseError(
                f"{case.path.name}: output.fields: no material here has a field '{name}'{suggest(name, known)}"
            )


@contextmanager
def _blamed(case: Case, place: str) -> Iterator[None]:
    """Turn a refusal of the parts into a sentence that names the place in the case."""
    try:
        yield
    except CaseError:
        raise
    except ValueError as error:
        where = f"{place}.{error.key}" if isinstance(error, MisfitError) else place
        raise CaseError(f"{case.path.name}: {where}: {str(error).rstrip('.')}") from error
