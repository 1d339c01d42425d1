"""Compiled routines of other programs looked at, and materials of this one written as routines for others.

What is wrong with the words of the command is a `CaseError`: one sentence, as for a case file.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fabfem.case import CaseError, read_case, suggest
from fabfem.case import materials as said
from fabfem.substance import Surroundings, substance
from fabfem.units import FORCES, LENGTHS, Units
from umat.conformance import Finding, examined
from umat.directions import Directions, directions
from umat.export import export_umat
from umat.external import External
from umat.mandel import FACTOR

UNCONFINED = 100.0
"""Isotropic stress that a routine is looked at from, in its own unit, where none is given."""


def check_routine(
    library: Path, properties: Sequence[float], state_variables: int, initial_state: Sequence[float],
    components: int, stress: Sequence[float], size: float,
) -> tuple[Finding, ...]:  # fmt: skip
    """Return what calling a routine shows; see `umat.conformance`.

    Parameters
    ----------
    library : Path
        The shared library.
    properties, state_variables, initial_state, components
        PROPS, NSTATV, STATEV at the start, NTENS.
    stress : sequence of 0, 3 or 6 floats
        xx, yy, zz, yz, xz, xy, compression positive; 100 isotropic where there is none.
    size : float
        Norm of the strain increments [-].

    Raises
    ------
    CaseError
        If the library cannot be loaded or the numbers do not fit.
    """
    if len(stress) not in (0, 3, 6):
        raise CaseError(f"--stress takes 3 or 6 numbers, got {len(stress)}")
    if not size > 0.0:
        raise CaseError(f"--size must be positive, got {size:g}")
    start = np.zeros(6)
    start[:3] = UNCONFINED
    start[: len(stress)] = stress
    material = External(str(library), tuple(properties), state_variables, tuple(initial_state), components)
    with _blamed(library):
        return examined(material, start * FACTOR, size)


def export(material: str, library: Path, case: Path | None, rule: str, units: str, cpu: str) -> tuple[str, ...]:
    """Write a library and return lines on its PROPS and STATEV; see `umat.export`.

    Parameters
    ----------
    material : str
        Name of a calibrated sand, or of a material in a case.
    library : Path
        The file to write.
    case : Path or None
        Case file that has the material; its parameters, fabric law, directions and units are used.
    rule, units : str
        Contact directions and units, such as ``kN,m``, of a sand without a case.
    cpu : str
        Processor that the code is for; see `umat.export.export_umat`.

    Raises
    ------
    CaseError
        If a name is unknown, the material cannot be exported, or no library can be made.
    """
    if not library.parent.is_dir():
        raise CaseError(f"--out: there is no folder '{library.parent}'")
    with _blamed(case or "export-umat"):
        record, contacts, used, start = _of_case(case, material) if case else _of_sand(material, rule, units)
        layout = export_umat(record, contacts, library, cpu)
    wanted = f"{library}: umat_, NSTATV = {layout.state_variables}, stress in {used.label('stress')}"
    return (wanted, *layout.lines(), *start)


def _of_sand(name: str, rule: str, units: str) -> tuple[Any, Directions, Units, tuple[str, ...]]:
    from umat.sands import SANDS

    if name not in SANDS:
        raise CaseError(f"--material: there is no sand '{name}'{suggest(name, SANDS)}")
    force, _, length = units.partition(",")
    if force not in FORCES or length not in LENGTHS:
        raise CaseError(f"--units: '{units}' is not a force and a length such as kN,m")
    used = Units(length, force)
    return SANDS[name](newtons=used.newtons, metres=used.metres), directions(rule), used, ()


def _of_case(path: Path, name: str) -> tuple[Any, Directions, Units, tuple[str, ...]]:
    case = read_case(path)
    if name not in case.material:
        raise CaseError(f"{path.name}: there is no material '{name}'{suggest(name, case.material)}")
    table = case.material[name]
    if not isinstance(table, said.ChangHicher):
        raise CaseError(f"{path.name}: material.{name}: only the model chang_hicher can be exported")
    filling = substance(table, Surroundings(case.unit_system, 2, False, path.parent))
    fabric = table.fabric or said.Fabric()
    numbers = (table.void_ratio, fabric.norm, fabric.bedding_angle, fabric.azimuth)
    start = "PROPS of the case: " + ", ".join(f"{number:g}" for number in numbers)
    return filling.material, filling.directions, case.unit_system, (start,)


@contextmanager
def _blamed(place: object) -> Iterator[None]:
    try:
        yield
    except CaseError:
        raise
    except ValueError as error:
        raise CaseError(f"{place}: {error}") from error
