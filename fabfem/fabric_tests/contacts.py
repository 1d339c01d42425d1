"""Statistics of contact normals, from a file or drawn from a density, over the first 10, 20, 50, … of them."""

from collections.abc import Iterator

import numpy as np

from fabfem.case import FabricCase
from fabfem.case import fabric as said
from fabfem.case.materials import Fabric
from fabfem.fabric_tests.columns import AXES, read_lines
from fabfem.fabric_tests.curves import VERTICAL
from fabfem.fabric_tests.drives import Block, Measured, Value, blamed
from fabfem.substance import deposit
from umat.contact_statistics import (
    anisotropic_state,
    draw_2d,
    draw_3d,
    fabric_2d,
    fabric_3d,
    joint_invariants,
)
from umat.mandel import FACTOR, Array, norm, to_tensor

PLANE = ("contacts", "F_11 [-]", "F_22 [-]", "F_12 [-]", "Delta [-]", "Delta_error [-]", "phi [degree]", "A [-]")
SPACE = ("contacts", *(f"F_{axes} [-]" for axes in AXES), *(f"error_{axes} [-]" for axes in AXES), "F_norm [-]")
JOINT = {"L1": "", "L2": "", "L3": "2", "L4": "2"}
"""Joint invariants and the power of stress in them."""


def measure(drive: said.Contacts, case: FabricCase) -> Measured:
    """Return the table of the statistics of growing numbers of contacts."""
    with blamed(case, "contacts.file" if drive.file else "contacts"):
        normals = _read(drive, case) if drive.file else _drawn(drive, case)
    stress = None if drive.stress is None else to_tensor(np.array(drive.stress) * FACTOR)
    unit = case.unit_system.label("stress")
    joint = (
        tuple(f"{name} [{unit}{'2' * (place > 1)}]" for place, name in enumerate(JOINT)) if stress is not None else ()
    )
    headers = (PLANE if normals.shape[1] == 2 else SPACE) + joint
    counts = _counts(len(normals))
    return Measured(headers, _blocks(normals, stress, counts), len(counts), (("contacts", str(len(normals))),))


def _read(drive: said.Contacts, case: FabricCase) -> Array:
    """Return the normals of a file; ValueError names the line that is wrong."""
    lines = read_lines(case, str(drive.file))
    headers = [header.split("[")[0].strip() for header in lines[0]] if lines else []
    at = [headers.index(name) for name in ("nx", "ny", "nz") if name in headers]
    if len(at) < 2 or "nx" not in headers or "ny" not in headers:
        raise ValueError(f"{drive.file} needs columns nx, ny and, in space, nz (got {', '.join(headers) or 'nothing'})")
    found = []
    for number, line in enumerate(lines[1:], 2):
        try:
            found.append([float(line[place]) for place in at])
        except (ValueError, IndexError):
            raise ValueError(f"{drive.file}, line {number}: not {len(at)} numbers") from None
    normals = np.array(found).reshape(-1, len(at))
    (fabric_2d if len(at) == 2 else fabric_3d)(normals)
    return normals


def _drawn(drive: said.Contacts, case: FabricCase) -> Array:
    if drive.dimension == 2:
        return draw_2d(drive.intensity, drive.direction, drive.count, drive.seed)
    start = case.start or said.Start()
    if start.components is not None:
        return draw_3d(np.array(start.components) * FACTOR, drive.count, drive.seed)
    fabric = deposit(Fabric(norm=start.norm, bedding_angle=start.bedding_angle), VERTICAL)
    return draw_3d(fabric, drive.count, drive.seed)


def _counts(whole: int) -> list[int]:
    """Return growing numbers of contacts up to all of them."""
    decades = [m * 10**k for k in range(1, 9) for m in (1, 2, 5)]
    return [count for count in decades if count < whole] + [whole]


def _blocks(normals: Array, stress: Array | None, counts: list[int]) -> Iterator[Block]:
    one = _plane if normals.shape[1] == 2 else _space
    for count in counts:
        row, summary = one(normals[:count], stress)
        yield Block([(count, *row)], {"contacts": count} | summary)


def _plane(normals: Array, stress: Array | None) -> tuple[list[Value], dict[str, Value]]:
    found = fabric_2d(normals)
    flat = None if stress is None else stress[:2, :2]
    state: Value = "" if flat is None else anisotropic_state(flat, found.tensor)
    direction: Value = found.direction if np.isfinite(found.direction) else ""
    f = found.tensor
    row: list[Value] = [float(f[0, 0]), float(f[1, 1]), float(f[0, 1]), found.intensity, found.error, direction, state]
    return row + _joint(flat, f), {"Delta": found.intensity, "Delta_error": found.error, "phi": direction}


def _space(normals: Array, stress: Array | None) -> tuple[list[Value], dict[str, Value]]:
    found = fabric_3d(normals)
    size, error = float(norm(found.tensor)), float(np.linalg.norm(found.error))
    row = [*(found.tensor / FACTOR).tolist(), *(found.error / FACTOR).tolist(), size]
    return row + _joint(stress, to_tensor(found.tensor)), {"F_norm": size, "error_norm": error}


def _joint(stress: Array | None, fabric: Array) -> list[Value]:
    return [] if stress is None else [float(value) for value in joint_invariants(stress, fabric)]
