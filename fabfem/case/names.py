"""Where a case names boundaries of the mesh."""

from collections.abc import Iterator

from fabfem.case.boundary_value import BoundaryValueCase
from fabfem.case.stages import Displacement, Load, Pressure, Traction


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
    yield from ((f"probe[{probe.name}].boundary", probe.boundary or ()) for probe in case.probe)
    yield from ((f"reaction[{entry.name}].boundary", entry.boundary) for entry in case.reaction)
