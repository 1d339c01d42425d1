"""Directional distributions: rose diagrams as ``roses.csv``, and E(n) as a surface for ParaView in ``fields.pvd``.

A diagram runs around a plane of the specimen; the surface has the radius 4π E(n), 1 where contacts are as many in all
directions, and carries normal force and mobilised friction. Normal forces are over their mean over all contacts
alike, f_n/⟨f_n⟩ with the average over the sphere.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfem.case.element import Roses
from fabfem.output.history import History
from fabfem.output.vtu import FieldFiles, Frame
from umat import contacts
from umat.mandel import Array

COUNT = 144
"""Directions of a diagram."""
HEADERS = (
    "stage",
    "increment [-]",
    "eps_q [-]",
    "angle [deg]",
    "4 pi E [-]",
    "f_n / mean [-]",
    "f_t / f_n [-]",
)
SPHERE = (36, 72)
"""Bands from pole to pole and around the surface."""


Taken = tuple[int, int, tuple[tuple[float, str], ...]]
"""States taken, size of the table [bytes], time and file of the surfaces stored."""


class RoseFiles:
    """The diagrams and surfaces of a run."""

    def __init__(self, folder: Path, asked: Roses, stage: str, kept: Taken | None = None) -> None:
        self.asked, self.stage = asked, stage
        self._taken, size, stored = kept if kept else (0, 0, ())
        self._table = History(folder / "roses.csv", HEADERS, size)
        self._normals, cells = sphere(*SPHERE)
        note = "radius 4 pi E(n) of the contact directions"
        self._files = FieldFiles(folder, self._normals, cells, "triangle", note, stored)

    def memory(self) -> Taken:
        """Return what an earlier run hands on: states taken, size of the table, surfaces stored."""
        return self._taken, self._table.size, tuple(self._files.stored)

    def offer(self, specimen: Any, state: Any, stage: str, increment: int, strain: float) -> None:
        """Store the distributions of a state if the case asks for this one."""
        wanted = self.asked.strain if self.asked.strain is not None else self.asked.increments or ()
        here = strain * (1.0 + 1e-9) + 1e-15 if self.asked.strain is not None else increment
        due = sum(here >= threshold for threshold in wanted)
        if stage != self.stage or due <= self._taken:
            return
        self._taken = due
        angles, normals = contacts.ring(self.asked.plane, COUNT)
        table = zip(angles, *distributions(specimen, state, normals), strict=True)
        for row in table:
            self._table.write((stage, increment, strain, *map(float, row)))
        density, force, friction = distributions(specimen, state, self._normals)
        fields = {"contact_density": density, "normal_force": force, "mobilised_friction": friction}
        self._files.write(Frame(float(increment), fields, {}, density[:, None] * self._normals))

    def close(self) -> None:
        """Close the table."""
        self._table.close()


def distributions(specimen: Any, state: Any, normals: Array) -> tuple[Array, Array, Array]:
    """Return 4π E, f_n over its mean and f_t/f_n in directions (N, 3), each (N,)."""
    force, friction = contacts.mobilisation(specimen.material, specimen.directions, state, normals)
    return contacts.density(state.fabric, normals)[0], force[0], friction[0]


def sphere(bands: int, around: int) -> tuple[Array, NDArray[np.int64]]:
    """Return points (n, 3) of the unit sphere and its triangles (m, 3), their normals outwards."""
    polar = np.repeat(np.linspace(0.0, np.pi, bands + 1)[1:-1], around)
    azimuth = np.tile(np.linspace(0.0, 2.0 * np.pi, around, endpoint=False), bands - 1)
    rings = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
    points = np.vstack([rings, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    here = np.arange(around)
    turned = (here + 1) % around
    top, bottom, last = len(rings), len(rings) + 1, (bands - 2) * around
    cells = [np.stack([np.full(around, top), here, turned], axis=1)]
    for ring in range(bands - 2):
        a, b = ring * around + here, ring * around + turned
        cells += [np.stack([a, a + around, b], axis=1), np.stack([b, a + around, b + around], axis=1)]
    cells += [np.stack([np.full(around, bottom), last + turned, last + here], axis=1)]
    return points, np.concatenate(cells).astype(np.int64)
