"""Probes: small steps in all directions of a plane from one state, and the responses to them, in ``probes.csv``.

Stress probes of one size give the response envelope of strain, strain probes that of stress. Each starts from the same
state, which is left as it is. A probe that the material refuses (a stress it cannot carry) has no row.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fabfem.case.paths import Probe
from fabfem.laboratory.columns import COMPONENTS
from fabfem.laboratory.plans import probes
from fabfem.laboratory.specimen import Specimen
from fabfem.laboratory.stages import SHARE
from fabfem.output.history import History
from umat.mandel import FACTOR, Array
from umat.path import Controls, follow


def headers(stress_unit: str) -> list[str]:
    """Return the header of ``probes.csv``: changes since the start of the probe, tensor components."""
    found = ["stage", "angle [deg]", "fraction [-]"]
    for what, unit in (("stress", stress_unit), ("strain", "-"), ("fabric", "-")):
        found += [f"d_{what}_{name} [{unit}]" for name in COMPONENTS]
    return found


def responses(specimen: Specimen, stage: Probe, state: Any) -> Iterator[tuple[float, float, Array, Array, Array]]:
    """Yield angle [deg], fraction and the changes of stress, strain and fabric, (6,) each, along every probe."""
    angles, leg = probes(stage)
    points = type(state)(*(np.repeat(part, len(angles), axis=0) for part in state))
    control = Controls(error=SHARE * specimen.case.accuracy.curve)
    history = follow(specimen.material, specimen.directions, points, leg, stage.increments, control)
    fabric = history.fabric - np.nan_to_num(history.fabric[0])
    for k, angle in enumerate(angles):
        for row in range(1, stage.increments + 1):
            stress = history.stress[row, k] - history.stress[0, k]
            if np.isfinite(stress).all():
                yield float(angle), float(history.fraction[row]), stress, history.strain[row, k], fabric[row, k]


class ProbeFile:
    """The table of all probes of a run."""

    def __init__(self, folder: Path, stress_unit: str, kept: int = 0) -> None:
        self._table = History(folder / "probes.csv", headers(stress_unit), kept)

    @property
    def size(self) -> int:
        """Size of the table so far [bytes]."""
        return self._table.size

    def write(self, specimen: Specimen, stage: Probe, state: Any) -> int:
        """Write the probes of a stage and return how many were carried to their end."""
        ends = 0
        for angle, fraction, *changes in responses(specimen, stage, state):
            self._table.write((stage.name, angle, fraction, *map(float, np.concatenate([c / FACTOR for c in changes]))))
            ends += fraction == 1.0
        return ends

    def close(self) -> None:
        """Close the table."""
        self._table.close()
