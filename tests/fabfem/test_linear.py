"""Every linear solver solves, says how well, and turns failure into a sentence."""

from importlib.util import find_spec

import numpy as np
import pytest
from scipy.sparse import csr_matrix, diags, random_array, triu

from fabfem.fem.linear import DirectSolver, SuperLUBackend, make_solver
from fabfem.fem.pardiso import PardisoBackend

needs_pardiso = pytest.mark.skipif(find_spec("pypardiso") is None, reason="pypardiso is not installed")
SOLVERS = {"superlu": lambda: DirectSolver(SuperLUBackend()), "pardiso": lambda: DirectSolver(PardisoBackend())}
SYMMETRIC = SOLVERS | {"pardiso symmetric": lambda: DirectSolver(PardisoBackend(symmetric=True))}


def rows(table: dict) -> list:
    return [
        pytest.param(make, marks=[needs_pardiso] if "pardiso" in name else [], id=name) for name, make in table.items()
    ]


def system(n: int = 200, skew: float = 1.0) -> csr_matrix:
    """A matrix of symmetric pattern, unsymmetric by `skew`, with its whole diagonal stored."""
    half = random_array((n, n), density=0.02, rng=np.random.default_rng(5)).tocsr()
    matrix = csr_matrix(half + half.T + skew * 0.5 * (half - half.T) + diags(np.full(n, 4.0)))
    matrix.sort_indices()
    return matrix


def give(solver: DirectSolver, matrix: csr_matrix) -> None:
    """Let a solver factor a symmetric matrix, of which it may want the upper triangle alone."""
    solver.factor(triu(matrix, format="csr") if solver.triangle else matrix)


@pytest.mark.parametrize("make", rows(SOLVERS))
def test_solves_unsymmetric_systems_of_one_pattern(make) -> None:
    solver, matrix = make(), system()
    for factor in (1.0, -3.0, 1e6):
        changed = csr_matrix((factor * matrix.data * np.linspace(1.0, 1.2, matrix.nnz), matrix.indices, matrix.indptr))
        solver.factor(changed)
        x = np.sin(np.arange(200.0))
        solution = solver.solve(changed @ x)
        assert solution.ok
        assert solution.residual < 1e-10
        np.testing.assert_allclose(solution.x, x, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("make", rows(SYMMETRIC))
def test_solves_symmetric_systems(make) -> None:
    solver, matrix = make(), system(skew=0.0)
    for factor in (1.0, 2.0):
        give(solver, matrix * factor)
        assert solver.solve(np.ones(200)).residual < 1e-10


@pytest.mark.parametrize("make", rows(SYMMETRIC))
def test_takes_a_new_pattern(make) -> None:
    solver = make()
    for n in (200, 150):
        give(solver, system(n, skew=0.0))
        assert solver.solve(np.ones(n)).ok


@pytest.mark.parametrize("make", rows(SYMMETRIC))
@pytest.mark.parametrize(("value", "word"), [(0.0, "singular"), (np.nan, "not finite"), (np.inf, "not finite")])
def test_failure_is_a_sentence(make, value: float, word: str) -> None:
    solver, matrix = make(), system(skew=0.0)
    first = slice(matrix.indptr[0], matrix.indptr[1])
    matrix.data[first] = value
    matrix.data[matrix.indices == 0] = value
    give(solver, matrix)
    solution = solver.solve(np.ones(200))
    assert not solution.ok
    assert word in solution.reason
    assert not solution.x.any()


@pytest.mark.parametrize("make", rows(SYMMETRIC))
def test_recovers_after_a_failure(make) -> None:
    solver, matrix = make(), system(skew=0.0)
    give(solver, matrix * 0.0)
    assert not solver.solve(np.ones(200)).ok
    give(solver, matrix)
    assert solver.solve(np.ones(200)).ok


@pytest.mark.parametrize("make", rows(SYMMETRIC))
def test_right_hand_sides_of_zero_and_nan(make) -> None:
    solver = make()
    give(solver, system(skew=0.0))
    assert solver.solve(np.zeros(200)).ok
    assert "not finite" in solver.solve(np.full(200, np.nan)).reason


def test_unknown_solver_is_named() -> None:
    with pytest.raises(ValueError, match="no linear solver 'lu'"):
        make_solver("lu")
