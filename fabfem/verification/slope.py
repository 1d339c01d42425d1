"""A slope that falls to the right, its toe at the origin, in cells that follow its face; and the search for its factor.

The grid is cut along rows (y) and columns; above the toe a column leans as the face does, so that every cell stays a
quadrilateral. Boundaries are left, bottom, right; the zone above the toe is "slope", below it "ground".
"""

from dataclasses import dataclass, replace

import numpy as np

from fabfem.fem.box import grid_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.mesh import Mesh
from fabfem.verification.ground import ladder
from fabfem.verification.scene import Answer, Tables, held


@dataclass(frozen=True)
class Slope:
    """The shape of a slope [length]: face `height` by `run`, level ground, and the size of its cells.

    Attributes
    ----------
    height, run : float
        Of the face; run = 0 is a vertical cut.
    crest, toe, depth : float
        Level ground behind and before it, and ground below the toe.
    fine : float
        Size of the cells along the face.
    growth : float
        Ratio of the widths of neighbouring columns, away from the face.
    """

    height: float
    run: float
    crest: float
    toe: float = 0.0
    depth: float = 0.0
    fine: float = 0.5
    growth: float = 1.05

    def mesh(self) -> Mesh:
        """Return the mesh of linear quadrilaterals."""
        x = np.concatenate([-self._ladder(self.run + self.crest)[::-1], self._ladder(self.toe)[1:]])
        y = np.concatenate([-self._ladder(self.depth)[::-1], self._even(self.height)[1:]])
        grid = grid_mesh("quad", [x, y])
        middle = grid.points[grid.cells].mean(axis=1)
        cells = grid.cells[(middle[:, 0] < 0.0) | (middle[:, 1] < 0.0)]
        used, cells = np.unique(cells, return_inverse=True)
        cells = cells.reshape(-1, 4)
        at = grid.points[used]
        nodes = {"left": at[:, 0] == x[0], "bottom": at[:, 1] == y[0], "right": (at[:, 0] == x[-1]) & (self.toe > 0.0)}
        sides = {name: outer_facets(cells, "quad", np.flatnonzero(on)) for name, on in nodes.items() if on.any()}
        low = at[cells].mean(axis=1)[:, 1] < 0.0
        zones = {name: np.flatnonzero(part) for name, part in (("slope", ~low), ("ground", low)) if part.any()}
        return replace(grid, points=self._leaning(at), cells=cells, zones=zones, boundaries=sides)

    def _leaning(self, at: np.ndarray) -> np.ndarray:
        """Places of the grid's nodes, columns above the toe drawn back from the face."""
        x, y = at.T
        length = self.run + self.crest
        back = self.run * np.maximum(y, 0.0) / self.height
        return np.stack([np.where(x <= 0.0, x * (length - back) / length - back, x), y], axis=1)

    def _ladder(self, length: float) -> np.ndarray:
        return ladder(length, self.fine, self.growth)

    def _even(self, length: float) -> np.ndarray:
        return np.linspace(0.0, length, int(np.ceil(length / self.fine)) + 1)


def searched(materials: dict[str, Tables], stand: float, step: float = 0.2, tolerance: float = 0.005) -> Tables:
    """Return the tables of a slope under its weight whose strength is then divided until it fails.

    `stand` divides the strength while the weight is turned on, less than one where it would not stand without.
    """
    weight = {"name": "weight", "kind": "gravity", "strength_factor": stand}
    safety = {"name": "safety", "kind": "strength_reduction", "step": step, "tolerance": tolerance}
    return {
        "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
        "material": materials,
        "support": held(left="x", bottom="xy"),
        "stage": [weight, safety],
    }


def factor(answer: Answer) -> float | None:
    """Return the middle of the bracket, or None where there is none."""
    end = answer.collapsed
    if end is None or end.last_equilibrium is None or end.first_failure is None or end.verdict != "collapse":
        return None
    return 0.5 * (end.last_equilibrium + end.first_failure)


def bracket(answer: Answer) -> str:
    """Return the note of a slope's row: the bracket and the number of cells, or why there is none."""
    end = answer.collapsed
    if end is None or factor(answer) is None:
        return answer.stopped or "no bracket was found"
    count = len(answer.problem.model.space.mesh.cells)
    return f"{count} quad8; between {end.last_equilibrium:.4f} and {end.first_failure:.4f}"
