"""Where a case names boundaries and zones of the mesh."""

from collections.abc import Iterator

from fabfem.case.boundary_value import BoundaryValueCase
from fabfem.case.stages import Displacement, DisplacementControl, Load, Pressure, StrengthReduction, Traction


def boundaries_of(case: BoundaryValueCase) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield (place, names) wherever a case names boundaries."""
    yield from ((f"support[{number}].boundary", support.boundary) for number, support in enumerate(case.support, 1))
    for stage in case.stage:
        lists: dict[str, tuple[Pressure | Traction | Displacement, ...]] = {
            "pressure": stage.pressure,
            "traction": stage.traction,
            "displacement": stage.displacement if isinstance(stage, Load) else (),
        }
        for kind, entries in lists.items():
            place = f"stage[{stage.name}].{kind}"
            yield from ((f"{place}[{number}].boundary", entry.boundary) for number, entry in enumerate(entries, 1))
        if isinstance(stage, Load):
            yield from (
                (f"stage[{stage.name}].rigid[{n}].boundary", (e.boundary,)) for n, e in enumerate(stage.rigid, 1)
            )
            if isinstance(stage.control, DisplacementControl):
                place = f"stage[{stage.name}].control.terms"
                yield from ((f"{place}[{n}].boundary", term.boundary) for n, term in enumerate(stage.control.terms, 1))
    yield from ((f"probe[{probe.name}].boundary", probe.boundary or ()) for probe in case.probe)
    yield from ((f"reaction[{entry.name}].boundary", entry.boundary) for entry in case.reaction)
    if case.hollow_cylinder:
        said = case.hollow_cylinder
        for key, names in (("inner", said.inner), ("outer", said.outer), ("platen", said.platen)):
            yield f"hollow_cylinder.{key}", (names,)


def zones_named(case: BoundaryValueCase) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield (place, names) wherever a case names zones."""
    yield from ((f"material.{key}.zones", material.zones or ()) for key, material in case.material.items())
    for stage in case.stage:
        place = f"stage[{stage.name}]"
        if isinstance(stage, Load):
            yield f"{place}.remove", stage.remove or ()
            yield f"{place}.add", stage.add or ()
            yield from (
                (f"{place}.change[{number}].zones", entry.zones) for number, entry in enumerate(stage.change, 1)
            )
        if isinstance(stage, StrengthReduction):
            yield f"{place}.excluded_zones", stage.excluded_zones or ()
    yield from ((f"probe[{probe.name}].zones", probe.zones or ()) for probe in case.probe)
