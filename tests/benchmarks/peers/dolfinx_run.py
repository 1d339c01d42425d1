"""The strip footing of the comparison by dolfinx 0.5 and MUMPS; `apt install python3-dolfinx libopenblas0-pthread`.

/usr/bin/python3 tests/benchmarks/peers/dolfinx_run.py 81k [lu|cholesky]

Displacement of degree 2, stress and tangent as functions on the three points of each triangle; forms are compiled by a
run of 5k dofs before the clock starts.
"""

import sys
import time

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from grid import CUTS, PRESSURE, report, returned, triangles
from mpi4py import MPI
from petsc4py import PETSc


def solve(cuts, factorisation):
    """Return unknowns, seconds, settlement, iterations and seconds of processor time."""
    begin, used = time.perf_counter(), time.process_time()
    points, cells = triangles(cuts)
    domain = ufl.Mesh(ufl.VectorElement("Lagrange", ufl.triangle, 1))
    mesh = dolfinx.mesh.create_mesh(MPI.COMM_WORLD, cells.astype(np.int64), points, domain)
    space = fem.VectorFunctionSpace(mesh, ("CG", 2))
    rule = {"quadrature_degree": 2, "quadrature_scheme": "default"}
    dx = ufl.Measure("dx", mesh, metadata=rule)
    stress_space = fem.FunctionSpace(
        mesh, ufl.VectorElement("Quadrature", mesh.ufl_cell(), 2, 3, quad_scheme="default")
    )
    tangent_space = fem.FunctionSpace(
        mesh, ufl.VectorElement("Quadrature", mesh.ufl_cell(), 2, 9, quad_scheme="default")
    )
    step, stress, tangent = fem.Function(space), fem.Function(stress_space), fem.Function(tangent_space)

    def strain(u):
        e = ufl.sym(ufl.grad(u))
        return ufl.as_vector([e[0, 0], e[1, 1], 2.0 * e[0, 1]])

    supports = held(mesh, space)
    trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
    stiff = ufl.as_matrix([[tangent[3 * i + j] for j in range(3)] for i in range(3)])
    bilinear = fem.form(ufl.dot(strain(test), ufl.dot(stiff, strain(trial))) * dx)
    inner = fem.form(ufl.dot(strain(test), stress) * dx)
    strip = dolfinx.mesh.locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[1], 0.0) & (x[0] < 1.0 + 1e-9))
    tags = dolfinx.mesh.meshtags(mesh, 1, np.sort(strip), np.ones(len(strip), np.int32))
    ds = ufl.Measure("ds", mesh, subdomain_data=tags)
    outer = fem.form(ufl.dot(test, ufl.as_vector([0.0, -PRESSURE])) * ds(1))
    load = petsc.assemble_vector(outer).array.copy()
    reference = quadrature()
    measured = fem.Expression(strain(step), reference)
    all_cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)

    matrix = petsc.create_matrix(bilinear)
    solver = PETSc.KSP().create(mesh.comm)
    solver.setType("preonly")
    solver.getPC().setType(factorisation)
    solver.getPC().setFactorSolverType("mumps")
    fixed = np.concatenate([bc.dof_indices()[0] for bc in supports])
    npoints = 3 * len(all_cells)
    old, plastic, total, iterations = np.zeros((npoints, 4)), np.zeros(npoints), np.zeros(len(load)), 0
    correction = fem.Function(space)
    for increment in range(1, 11):
        step.x.array[:] = 0.0
        for _ in range(30):
            increments = measured.eval(all_cells).reshape(npoints, 3)
            new, slipped, moduli = returned(old, plastic, increments)
            stress.x.array[:] = new[:, [0, 1, 3]].ravel()
            tangent.x.array[:] = moduli.ravel()
            force = petsc.assemble_vector(inner).array
            left = increment / 10.0 * load - force
            scale = max(np.linalg.norm(force), np.linalg.norm(load) * increment / 10.0)
            left[fixed] = 0.0
            if np.linalg.norm(left) <= 1e-8 * scale:
                break
            matrix.zeroEntries()
            petsc.assemble_matrix(matrix, bilinear, bcs=supports)
            matrix.assemble()
            matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
            solver.setOperators(matrix)
            rhs = matrix.createVecRight()
            rhs.array[:] = left
            solver.solve(rhs, correction.vector)
            step.x.array[:] += correction.x.array
            iterations += 1
        else:
            raise SystemExit(f"no equilibrium in increment {increment}")
        old, plastic, total = new, slipped, total + step.x.array
    wall, used = time.perf_counter() - begin, time.process_time() - used
    where = np.argmin(np.abs(space.tabulate_dof_coordinates()).sum(axis=1))
    return len(load), wall, -total[2 * where + 1], iterations, used


def at_points(mesh, count):
    """Return a function with `count` values at the points."""
    element = ufl.VectorElement("Quadrature", mesh.ufl_cell(), 2, count, quad_scheme="default")
    return fem.Function(fem.FunctionSpace(mesh, element))


def quadrature():
    """Return the three points of the rule."""
    import basix

    return basix.make_quadrature(basix.CellType.triangle, 2)[0]


def held(mesh, space):
    """Return the supports: sides in x, bottom in both directions."""
    zero, supports = PETSc.ScalarType(0.0), []
    planes = [(0, 0, 0.0), (0, 0, 7.0), (0, 1, -3.6), (1, 1, -3.6)]
    for component, axis, at in planes:
        facets = dolfinx.mesh.locate_entities_boundary(mesh, 1, lambda x, a=axis, v=at: np.isclose(x[a], v))
        dofs = fem.locate_dofs_topological(space.sub(component), 1, facets)
        supports.append(fem.dirichletbc(zero, dofs, space.sub(component)))
    return supports


size, factorisation = sys.argv[1], (sys.argv[2:] or ["lu"])[0]
solve(1, factorisation)
dofs, wall, settlement, iterations, processor = solve(CUTS[size], factorisation)
report(f"dolfinx {dolfinx.__version__} + MUMPS ({factorisation})", dofs, wall, settlement, iterations, processor)
