"""The footings of the comparison by dolfinx 0.5; `apt install python3-dolfinx libopenblas0-pthread`.

/usr/bin/python3 tests/benchmarks/peers/dolfinx_run.py 81k|solid-50k|... [lu|cholesky|gamg]

Displacement of degree 2, stress and tangent as functions on the three points of each triangle or four of each
tetrahedron; forms are compiled by a small run before the clock starts. Solved by MUMPS, or by GMRES to
10⁻³ with PETSc's multigrid of the elastic stiffness, told of the rigid motions, as fabfem solves solids.
"""

import sys
import time

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from grid import CUTS, PRESSURE, SOLIDS, report, returned, tetrahedra, triangles
from mpi4py import MPI
from petsc4py import PETSc

SHEARS = {2: ((0, 1),), 3: ((0, 1), (0, 2), (1, 2))}


def solve(points, cells, solver):
    """Return unknowns, seconds, settlement, iterations and seconds of processor time."""
    begin, used = time.perf_counter(), time.process_time()
    dim, nstrain = points.shape[1], {2: 3, 3: 6}[points.shape[1]]
    domain = ufl.Mesh(ufl.VectorElement("Lagrange", ufl.triangle if dim == 2 else ufl.tetrahedron, 1))
    mesh = dolfinx.mesh.create_mesh(MPI.COMM_WORLD, cells.astype(np.int64), points, domain)
    space = fem.VectorFunctionSpace(mesh, ("CG", 2))
    dx = ufl.Measure("dx", mesh, metadata={"quadrature_degree": 2, "quadrature_scheme": "default"})
    step, stress, tangent = fem.Function(space), at_points(mesh, nstrain), at_points(mesh, nstrain**2)

    def strain(u):
        e = ufl.sym(ufl.grad(u))
        return ufl.as_vector([*(e[i, i] for i in range(dim)), *(2.0 * e[i, j] for i, j in SHEARS[dim])])

    supports = held(mesh, space)
    trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
    stiff = ufl.as_matrix([[tangent[nstrain * i + j] for j in range(nstrain)] for i in range(nstrain)])
    bilinear = fem.form(ufl.dot(strain(test), ufl.dot(stiff, strain(trial))) * dx)
    inner = fem.form(ufl.dot(strain(test), stress) * dx)
    top = dolfinx.mesh.locate_entities_boundary(
        mesh, dim - 1, lambda x: np.isclose(x[dim - 1], 0.0) & (x[: dim - 1] < 1.0 + 1e-9).all(axis=0)
    )
    tags = dolfinx.mesh.meshtags(mesh, dim - 1, np.sort(top), np.ones(len(top), np.int32))
    ds = ufl.Measure("ds", mesh, subdomain_data=tags)
    outer = fem.form(ufl.dot(test, ufl.as_vector([*(dim - 1) * [0.0], -PRESSURE])) * ds(1))
    load = petsc.assemble_vector(outer).array.copy()
    measured = fem.Expression(strain(step), quadrature(dim))
    all_cells = np.arange(mesh.topology.index_map(dim).size_local, dtype=np.int32)

    matrix = petsc.create_matrix(bilinear)
    ksp, near = linear_solver(mesh.comm, solver), None
    fixed = np.concatenate([bc.dof_indices()[0] for bc in supports])
    if solver == "gamg":
        matrix.setNearNullSpace(rigid(space, fixed))
    npoints = {2: 3, 3: 4}[dim] * len(all_cells)
    old, plastic, total, iterations = np.zeros((npoints, 2 * dim)), np.zeros(npoints), np.zeros(len(load)), 0
    correction = fem.Function(space)
    for increment in range(1, 11):
        step.x.array[:] = 0.0
        for _ in range(30):
            increments = measured.eval(all_cells).reshape(npoints, nstrain)
            new, slipped, moduli = returned(old, plastic, increments)
            stress.x.array[:] = new[:, [0, 1, 3] if dim == 2 else slice(None)].ravel()
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
            near = near or (matrix.copy() if solver == "gamg" else matrix)
            ksp.setOperators(matrix, near)
            rhs = matrix.createVecRight()
            rhs.array[:] = left
            ksp.solve(rhs, correction.vector)
            correction.x.array[fixed] = 0.0  # an iteration leaves something there
            step.x.array[:] += correction.x.array
            iterations += 1
        else:
            raise SystemExit(f"no equilibrium in increment {increment}")
        old, plastic, total = new, slipped, total + step.x.array
    wall, used = time.perf_counter() - begin, time.process_time() - used
    where = np.argmin(np.abs(space.tabulate_dof_coordinates()).sum(axis=1))
    return len(load), wall, -total[dim * where + dim - 1], iterations, used


def linear_solver(comm, name):
    """Return PETSc's solver: MUMPS, or GMRES with GAMG of the first matrix, the elastic one."""
    ksp = PETSc.KSP().create(comm)
    if name == "gamg":
        ksp.setType("gmres")  # with conjugate gradients PETSc calls its own preconditioner indefinite, sometimes
        ksp.setTolerances(rtol=1e-3)
        ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        ksp.getPC().setType("gamg")
        ksp.getPC().setReusePreconditioner(True)
    else:
        ksp.setType("preonly")
        ksp.getPC().setType(name)
        ksp.getPC().setFactorSolverType("mumps")
    return ksp


def rigid(space, fixed):
    """Return the rigid motions of a solid, zero where it is held, orthonormal."""
    x = space.tabulate_dof_coordinates() - space.tabulate_dof_coordinates().mean(axis=0)
    modes = [np.tile(axis, (len(x), 1)) for axis in np.eye(3)] + [np.cross(axis, x) for axis in np.eye(3)]
    modes = np.stack([mode.ravel() for mode in modes], axis=1)
    modes[fixed] = 0.0
    basis = np.linalg.qr(modes)[0]
    vectors = [PETSc.Vec().createWithArray(np.ascontiguousarray(column)) for column in basis.T]
    return PETSc.NullSpace().create(vectors=vectors)


def at_points(mesh, count):
    """Return a function with `count` values at the points."""
    element = ufl.VectorElement("Quadrature", mesh.ufl_cell(), 2, count, quad_scheme="default")
    return fem.Function(fem.FunctionSpace(mesh, element))


def quadrature(dim):
    """Return the points of the rule, three or four."""
    import basix

    return basix.make_quadrature({2: basix.CellType.triangle, 3: basix.CellType.tetrahedron}[dim], 2)[0]


def held(mesh, space):
    """Return the supports: sides across themselves, bottom in all directions."""
    zero, supports, dim = PETSc.ScalarType(0.0), [], mesh.topology.dim
    sides = [(axis, axis, end) for axis in range(dim - 1) for end in (0.0, 7.0 if dim == 2 else 5.0)]
    for component, axis, at in sides + [(i, dim - 1, -3.6 if dim == 2 else -3.0) for i in range(dim)]:
        facets = dolfinx.mesh.locate_entities_boundary(mesh, dim - 1, lambda x, a=axis, v=at: np.isclose(x[a], v))
        dofs = fem.locate_dofs_topological(space.sub(component), dim - 1, facets)
        supports.append(fem.dirichletbc(zero, dofs, space.sub(component)))
    return supports


def mesh_of(size):
    """Return points and cells."""
    return tetrahedra(SOLIDS[size]) if size in SOLIDS else triangles(CUTS[size])


size, kind = sys.argv[1], (sys.argv[2:] or ["lu"])[0]
solve(*(tetrahedra((5, 5, 1)) if size in SOLIDS else triangles(1)), kind)
dofs, wall, settlement, iterations, processor = solve(*mesh_of(size), kind)
name = "GAMG" if kind == "gamg" else f"MUMPS ({kind})"
report(f"dolfinx {dolfinx.__version__} + {name}", dofs, wall, settlement, iterations, processor)
