"""The fields of an increment as they are stored: smoothed at nodes, raw means in cells, tensors in VTK's order."""

from fabfem.boundary_value.errors import FIELD
from fabfem.boundary_value.fields import point_fields
from fabfem.boundary_value.problem import Problem
from fabfem.case.boundary_value import Output
from fabfem.fem.solve import Increment
from fabfem.output.vtu import Frame
from umat import mandel
from umat.mandel import Array

VTK_ROW, VTK_COLUMN = [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]


def frame(problem: Problem, output: Output, increment: Increment) -> Frame:
    """Return the fields of an increment that the case asks for."""
    space = problem.model.space
    gathered = point_fields(space, problem.model.zones, increment.displacement, increment.states, output.fields)
    if problem.mesh_error and FIELD in output.fields:
        gathered[FIELD] = problem.mesh_error.field(increment)
    shown = {name: in_vtk_order(values) for name, values in gathered.items()}
    at_nodes = {name: space.nodal(values) for name, values in shown.items()} if "nodes" in output.at else {}
    in_cells = {name: space.cell_mean(values) for name, values in shown.items()} if "cells" in output.at else {}
    if "displacement" in output.fields:
        at_nodes = {"displacement": space.displacement(increment.displacement), **at_nodes}
    return Frame(increment.time, at_nodes, in_cells)


def in_vtk_order(values: Array) -> Array:
    """Return Mandel vectors (n, 6) as components XX YY ZZ XY YZ XZ; other shapes pass through."""
    return mandel.to_tensor(values)[..., VTK_ROW, VTK_COLUMN] if values.shape[1:] == (6,) else values
