"""Ground below half a footing: a grid that is finest at the footing's edge, and the tables that all footings share.

The footing is the boundary ``footing`` 0 ≤ x ≤ B/2, the rest of the top is ``surface``; B = 1, the surface at y = 0.
"""

from dataclasses import dataclass, replace

import numpy as np

from fabfem.fem.box import grid_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.mesh import Mesh
from fabfem.verification.scene import Answer, Tables, held, stage

HALF = 0.5
"""Half width, or radius, of the footing [B]."""


@dataclass(frozen=True)
class Ground:
    """A domain of `width` by `depth` [B], its cells growing by the ratio `growth` from `fine` at the edge."""

    width: float
    depth: float
    fine: float
    growth: float = 1.2

    def mesh(self, cell_type: str) -> Mesh:
        """Return the mesh of linear cells."""
        inner = HALF - self._ladder(HALF)[::-1]
        x = np.concatenate([inner, HALF + self._ladder(self.width - HALF)[1:]])
        mesh = grid_mesh(cell_type, [x, -self._ladder(self.depth)[::-1]])
        on_top, left = mesh.points[:, 1] == 0.0, mesh.points[:, 0] - HALF
        parts = {"footing": on_top & (left <= 1e-9), "surface": on_top & (left >= -1e-9)}
        named = {name: outer_facets(mesh.cells, cell_type, np.flatnonzero(there)) for name, there in parts.items()}
        sides = {name: facets for name, facets in mesh.boundaries.items() if name != "top"}
        return replace(mesh, boundaries=sides | named)

    def _ladder(self, length: float) -> np.ndarray:
        return ladder(length, self.fine, self.growth)


def ladder(length: float, fine: float, growth: float) -> np.ndarray:
    """Return ascending coordinates from 0 to `length`, at distances that grow from `fine` by the ratio `growth`."""
    if length == 0.0:
        return np.zeros(1)
    steps = int(np.ceil(np.log1p(length / fine * (growth - 1.0)) / np.log(growth)))
    rungs = np.concatenate([[0.0], np.cumsum(growth ** np.arange(steps))])
    return rungs * length / rungs[-1]


def footing(material: Tables, settlement: float, rough: bool, surcharge: float = 0.0, axial: bool = False) -> Tables:
    """Return the tables of a footing that settles; the reaction ``load`` is a mean pressure without the surcharge.

    Ground with weight or surcharge begins under an isotropic stress of its overburden (K0 = 1).
    """
    side, up = ("r", "z") if axial else ("x", "y")
    area = np.pi * HALF**2 if axial else HALF
    motion = {"boundary": "footing", up: -settlement} | ({side: 0.0} if rough else {})
    stages = [stage("settlement", 0.01, 0.04, displacement=[motion])]
    if surcharge or material.get("unit_weight"):
        pressure = [{"boundary": ["footing", "surface"], "value": surcharge}] if surcharge else []
        stages = [
            {"name": "ground", "kind": "geostatic", "k0": 1.0, "surcharge": surcharge, "pressure": pressure},
            *stages,
        ]
    return {
        "scene": {"kind": "boundary_value", "kinematics": "axisymmetric" if axial else "plane_strain"},
        "material": {"ground": material},
        "solver": {"tolerance": 1e-4},
        "support": held(left=side, right=side, bottom=side + up),
        "stage": stages,
        "reaction": [{"name": "load", "boundary": "footing", "component": up, "scale": -1.0 / area}],
    }


def settled(answer: Answer, elements: str) -> str:
    """Return the note of a footing's row: its elements, and whether it had come to its limit."""
    count = len(answer.problem.model.space.mesh.cells)
    return answer.stopped or f"{count} {elements}; rose {100.0 * answer.rise('load'):.2f} % in the last fifth"
