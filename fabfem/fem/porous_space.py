"""A space whose nodes move and whose corner nodes have a pore pressure; `pores` has the equations."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from fabfem.fem.elements import ELEMENTS, shape
from fabfem.fem.space import Space

PORE_PRESSURE = "pore_pressure"
"""Name of the component that a support holds where water drains."""


@dataclass(frozen=True)
class PorousSpace(Space):
    """A space whose unknowns are the displacements of all nodes, then the pore pressures of the corner nodes.

    Attributes
    ----------
    pressure_nodes : (m,) array
        Nodes of the mesh that have a pressure, ascending.
    pressure_values : (nq, ncorner) array
        Shape functions of the pressure at the points of the reference element.
    pressure_gradients : (nel, nq, ncorner, dim) array
    """

    pressure_nodes: np.ndarray
    pressure_values: np.ndarray
    pressure_gradients: np.ndarray

    @property
    def nmotion(self) -> int:
        """Number of displacement dofs, which come first."""
        return len(self.mesh.points) * len(self.components)

    @property
    def ndof(self) -> int:
        """Unknowns, fixed ones included."""
        return self.nmotion + len(self.pressure_nodes)

    def dofs_on(self, boundary: str, component: str) -> np.ndarray:
        """Dofs of one component on a boundary, each once."""
        if component != PORE_PRESSURE:
            return super().dofs_on(boundary, component)
        here = np.isin(self.pressure_nodes, self.mesh.nodes_on(boundary))
        return self.nmotion + np.flatnonzero(here)

    def summed(self, force: np.ndarray) -> np.ndarray:
        """(ndof,) nodal forces and volumes with what the elements of other ranks add to them."""
        if self.mesh.ranks.size == 1:
            return force
        volumes = np.zeros((len(self.mesh.points), 1))
        volumes[self.pressure_nodes, 0] = force[self.nmotion :]
        whole = self.mesh.ranks.summed(volumes)[self.pressure_nodes, 0]
        return np.concatenate([super().summed(force[: self.nmotion]), whole])

    @cached_property
    def counted(self) -> np.ndarray | slice:
        """Which dofs this rank counts: all, or those of the nodes that it owns."""
        motion, owned = super().counted, self.mesh.ranks.owned(self.pressure_nodes)
        if isinstance(motion, slice) or isinstance(owned, slice):
            return slice(None)
        return np.concatenate([motion, owned])

    def displacement(self, u: np.ndarray) -> np.ndarray:
        """(nnodes, 3) displacement along the three axes of the kinematics."""
        return super().displacement(u[: self.nmotion])

    def at_rest(self, u: np.ndarray) -> np.ndarray:
        """The unknowns with the displacement set to zero."""
        rest = np.zeros_like(u)
        rest[self.nmotion :] = u[self.nmotion :]
        return rest

    def nodal_pressure(self, u: np.ndarray) -> np.ndarray:
        """(nnodes,) pore pressure, interpolated at the nodes between corners."""
        pressure = np.zeros(len(self.mesh.points))
        pressure[self.pressure_nodes] = u[self.nmotion :]
        corners = len(self.mesh.element.corners)
        for k, between in enumerate(self.mesh.element.midside, corners):
            pressure[self.mesh.cells[:, k]] = pressure[self.mesh.cells[:, list(between)]].mean(axis=1)
        return pressure

    def point_pressure(self, u: np.ndarray) -> np.ndarray:
        """(npoints,) pore pressure at the points."""
        return (u[self._pressure_dofs] @ self.pressure_values.T).ravel()

    @cached_property
    def _pressure_dofs(self) -> np.ndarray:
        """(nel, ncorner) dofs."""
        return self.dofs[:, self.mesh.cells.shape[1] * len(self.components) :]


def porous(space: Space) -> PorousSpace:
    """The space with pore pressure as well.

    Raises ValueError where the displacement is linear: the pair would not be stable.
    """
    element = space.mesh.element
    if not element.linear:
        raise ValueError(f"pore pressure needs a quadratic displacement; {element.name} is linear. Take order = 2.")
    corner = ELEMENTS[element.linear]
    cells = space.mesh.cells[:, : len(corner.corners)]
    nodes = np.unique(cells)
    values, reference = shape(corner, space.where)
    jacobian = np.einsum("eai,qaj->eqij", space.mesh.points[space.mesh.cells], shape(element, space.where)[1])
    gradients = np.einsum("qaj,eqji->eqai", reference, np.linalg.inv(jacobian))
    numbers = len(space.mesh.points) * len(space.components) + np.searchsorted(nodes, cells)
    given = {field.name: getattr(space, field.name) for field in fields(space)}
    given["dofs"] = np.ascontiguousarray(np.hstack([space.dofs, numbers.astype(np.int32)]))
    return PorousSpace(**given, pressure_nodes=nodes, pressure_values=values, pressure_gradients=gradients)
