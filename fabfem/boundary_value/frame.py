"""The fields of an increment as they are stored: smoothed at nodes, raw means in cells, tensors in VTK's order."""

from fabfem.boundary_value.discretisation import FIELD
from fabfem.boundary_value.fields import AT_NODES, PORE_PRESSURE, point_fields
from fabfem.boundary_value.problem import Problem
from fabfem.boundary_value.water import nodal_pore_pressure, point_pore_pressure
from fabfem.case.boundary_value import Output
from fabfem.fem.solve import Increment
from fabfem.fem.space import Space
from fabfem.output.vtu import Frame
from umat import mandel
from umat.mandel import Array

VTK_ROW, VTK_COLUMN = [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]


def frame(problem: Problem, output: Output, increment: Increment) -> Frame:
    """Return the fields of an increment that the case asks for."""
    space = problem.model.space
    gathered = point_fields(space, increment, output.fields)
    if problem.mesh_error and FIELD in output.fields:
        gathered[FIELD] = problem.mesh_error.field(increment)
    shown = {name: in_vtk_order(values) for name, values in gathered.items()}
    at_nodes = {name: _smoothed(space, values) for name, values in shown.items()} if "nodes" in output.at else {}
    in_cells = {name: space.cell_mean(values) for name, values in shown.items()} if "cells" in output.at else {}
    of_nodes = {name: space.displacement(AT_NODES[name](increment)) for name in output.fields if name in AT_NODES}
    at_nodes = of_nodes | at_nodes
    if PORE_PRESSURE in output.fields:
        at_nodes[PORE_PRESSURE] = nodal_pore_pressure(problem.case, space, increment)
        in_cells[PORE_PRESSURE] = space.cell_mean(point_pore_pressure(problem.case, space, increment))
    return Frame(increment.time, at_nodes, in_cells)


def _smoothed(space: Space, values: Array) -> Array:
    """Return values at nodes: scalars within the range around each, of tensors a fit exact for linear fields."""
    return space.nodal_within(values) if values.ndim == 1 else space.nodal(values)


def in_vtk_order(values: Array) -> Array:
    """Return Mandel vectors (n, 6) as components XX YY ZZ XY YZ XZ; other shapes pass through."""
    return mandel.to_tensor(values)[..., VTK_ROW, VTK_COLUMN] if values.shape[1:] == (6,) else values
