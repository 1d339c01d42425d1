"""What is wrong in a case that no single table can see."""

from collections import Counter
from collections.abc import Iterator

from fabfem.case.boundary_value import BoundaryValueCase, Probe
from fabfem.case.materials import ChangHicher, Umat
from fabfem.case.stages import COMPONENTS, DisplacementControl, Geostatic, Gravity, Load, StrengthReduction, Vector
from fabfem.case.table import suggest


def contradictions(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    """Yield (place, what) for what no single table can see."""
    yield from _unknown_components(case)
    yield from _repeated_names(case)
    yield from _impossible_together(case)
    yield from _half_of_an_inclined_bedding(case)
    yield from _odd_columns(case)
    yield from _odd_zones(case)
    yield from _odd_water(case)
    yield from _unknown_strength(case)


def _odd_columns(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    columns = _recorded(case)
    for derived in case.derived:
        where = f"derived[{derived.name}]"
        if derived.of not in columns:
            yield f"{where}.of", f"there is no probe or reaction '{derived.of}'{suggest(derived.of, columns)}"
        if 0.0 in derived.divide_by:
            yield f"{where}.divide_by", "must not be zero"
    for probe in case.probe:
        yield from ((f"probe[{probe.name}]{key}", what) for key, what in _odd_probe(case, probe))
    if case.hollow_cylinder and case.scene.kinematics != "axisymmetric_torsion":
        yield "hollow_cylinder", "needs the kinematics axisymmetric_torsion"


def _odd_probe(case: BoundaryValueCase, probe: Probe) -> Iterator[tuple[str, str]]:
    """Yield (key, what) for what a probe says too much or too little."""
    of_points = probe.kind in ("mean", "deviation")
    places = [probe.boundary, probe.point].count(None)
    if of_points and places != 2:
        yield "", "is taken over zones, so it has neither a boundary nor a point"
    if not of_points and places != 1:
        yield "", "needs either a boundary or a point"
    if (probe.component is None) != (probe.kind != "displacement"):
        yield ".component", "goes with a displacement, and only with that"
    if (probe.field is None) == of_points:
        yield ".field", "goes with a mean or a deviation, and only with those"
    if not of_points and (probe.entry or probe.zones):
        yield ".kind", "has neither an entry nor zones; only a mean or a deviation has them"
    if probe.kind == "pore_pressure" and case.water is None:
        yield ".kind", "asks for a pore pressure, but the case has no [water]"


def _odd_water(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    """Yield what does not fit the water of the case, or its absence."""
    excess = case.water is not None and case.water.excess
    wet = False
    for stage in case.stage:
        drainage = stage.drainage if isinstance(stage, Load) else "drained"
        if drainage != "drained" and not excess:
            yield f"stage[{stage.name}].drainage", f"'{drainage}' needs [water] with excess = true"
        if wet and drainage == "drained":
            yield f"stage[{stage.name}]", "is drained after excess pressures arose; let them flow off by seepage"
        if isinstance(stage, Load) and stage.control and drainage != "drained":
            yield f"stage[{stage.name}].control", "drives drained stages only"
        if isinstance(stage, Load) and stage.drains and drainage != "seepage":
            yield f"stage[{stage.name}].drains", "lets water off, but the stage has no seepage"
        wet = wet or drainage != "drained"
    if any(isinstance(stage, Load) and stage.drainage == "seepage" for stage in case.stage):
        for name, material in case.material.items():
            if material.conductivity == 0.0:
                yield f"material.{name}.conductivity", "is missing; water is to flow through the pores"
    if case.water is None or case.water.level is None:
        return
    for name, material in case.material.items():
        if material.unit_weight > 0.0 and material.saturated_unit_weight is None:
            yield f"material.{name}.saturated_unit_weight", "is missing; there is a water table"
        if material.saturated_unit_weight is not None and material.saturated_unit_weight < case.water.unit_weight:
            yield f"material.{name}.saturated_unit_weight", "is less than the unit weight of water"


def _impossible_together(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    for stage in case.stage[1:]:
        if isinstance(stage, Geostatic | Gravity):
            yield f"stage[{stage.name}].kind", f"a {stage.kind} stage must be the first"
    for stage in case.stage[:-1]:
        if isinstance(stage, StrengthReduction):
            yield f"stage[{stage.name}].kind", "a search for the factor of safety must be the last stage"
    for name, material in case.material.items():
        if len(case.material) > 1 and material.zones is None:
            yield f"material.{name}.zones", "is missing; with several materials each names its zones"
        fabric = material.fabric if isinstance(material, ChangHicher) else None
        if fabric and fabric.bedding_angle and case.scene.kinematics.startswith("axisymmetric"):
            yield f"material.{name}.fabric.bedding_angle", "must be 0: inclined bedding has no axis of symmetry"


def _half_of_an_inclined_bedding(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    """Yield beddings that a plane of symmetry, known by its name, does not mirror onto themselves."""
    plane = any("symmetry" in support.boundary for support in case.support)
    for name, material in case.material.items():
        fabric = material.fabric if isinstance(material, ChangHicher) else None
        across = fabric and fabric.norm and fabric.bedding_angle % 90 and (fabric.azimuth - 90) % 180
        if plane and fabric and across and case.scene.kinematics == "plane_strain":
            what = (
                f"a bedding at {fabric.bedding_angle:g} degrees is no mirror image of itself, but a [[support]] holds "
                "the boundary 'symmetry': model both halves (the starter's footing_mesh.py draws them with whole = 1)"
            )
            yield f"material.{name}.fabric.bedding_angle", what


def _unknown_strength(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    """Yield external routines whose strength a search for the factor of safety would have to divide."""
    for stage in case.stage:
        kept = set(stage.excluded_zones or ()) if isinstance(stage, StrengthReduction) else None
        for name, material in case.material.items():
            if kept is not None and isinstance(material, Umat) and not kept.issuperset(material.zones or ("",)):
                what = "is an external routine, whose strength cannot be divided; exclude its zones from the search"
                yield f"material.{name}", what


def _odd_zones(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    """Yield zones that are taken away or put in place twice, and changes to materials that are not there."""
    loads = [stage for stage in case.stage if isinstance(stage, Load)]
    there: dict[str, bool] = {}
    for stage in loads:
        for key, names, state in (("add", stage.add, True), ("remove", stage.remove, False)):
            for name in names or ():
                if there.get(name, not state) == state:
                    yield f"stage[{stage.name}].{key}", f"zone '{name}' is {'already' if state else 'no longer'} there"
                there[name] = state
        for number, entry in enumerate(stage.change, 1):
            if entry.material not in case.material:
                hint = suggest(entry.material, case.material)
                yield f"stage[{stage.name}].change[{number}].material", f"there is no material '{entry.material}'{hint}"


def _unknown_components(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    valid = COMPONENTS[case.scene.kinematics]
    for where, component in _components(case):
        if component not in valid:
            yield where, f"'{component}' is no component of {case.scene.kinematics}; it has {', '.join(valid)}"


def _components(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    for number, support in enumerate(case.support, 1):
        yield from ((f"support[{number}].fix", component) for component in support.fix)
    yield from ((f"probe[{probe.name}].component", probe.component) for probe in case.probe if probe.component)
    yield from ((f"reaction[{entry.name}].component", entry.component) for entry in case.reaction)
    for stage in case.stage:
        vectors: dict[str, tuple[Vector, ...]] = {"traction": stage.traction}
        if isinstance(stage, Load):
            vectors["displacement"] = stage.displacement
            if isinstance(stage.control, DisplacementControl):
                place = f"stage[{stage.name}].control.terms"
                yield from (
                    (f"{place}[{n}].component", term.component) for n, term in enumerate(stage.control.terms, 1)
                )
        for kind, entries in vectors.items():
            for number, vector in enumerate(entries, 1):
                yield from ((f"stage[{stage.name}].{kind}[{number}]", name) for name in vector.components())


def _repeated_names(case: BoundaryValueCase) -> Iterator[tuple[str, str]]:
    lists = {
        "stage": [stage.name for stage in case.stage],
        "probe, reaction or derived": [*_recorded(case), *(derived.name for derived in case.derived)],
    }
    for kind, names in lists.items():
        for name, count in Counter(names).items():
            if count > 1:
                yield kind, f"the name '{name}' is given {count} times"


def _recorded(case: BoundaryValueCase) -> list[str]:
    """Return the names of all probes and reactions."""
    return [*(probe.name for probe in case.probe), *(entry.name for entry in case.reaction)]
