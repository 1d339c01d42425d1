"""MKL PARDISO (the extra ``fabfem[fast]``) as a direct solver that keeps its analysis while the pattern stays."""

import os
from collections.abc import Sequence
from ctypes import POINTER, byref, c_int32
from typing import Any
from weakref import finalize

import numpy as np
from scipy.sparse import csr_matrix


def _same(pattern: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> bool:
    """Whether two patterns are one; their arrays are compared only where they are not the same."""
    return all(mine is its or np.array_equal(mine, its) for mine, its in zip(pattern, other, strict=True))


class PardisoBackend:
    """MKL PARDISO; the analysis is kept while the pattern stays."""

    name = "pardiso"

    def __init__(self, symmetric: bool = False, coupled: bool = False) -> None:
        # MKL's sums may differ from run to run unless it is told otherwise before it starts
        os.environ.setdefault("MKL_CBWR", "AUTO")
        # its threads would keep the processors busy for 0.2 s after each call, while the points need them
        os.environ.setdefault("KMP_BLOCKTIME", "0")
        from pypardiso import PyPardisoSolver

        self._solver = PyPardisoSolver(mtype=-2 if symmetric else 1)
        handle, kind, settings = self._solver.pt, c_int32(self._solver.mtype), self._solver.iparm
        self._solver.libmkl.pardisoinit(_address(handle), byref(kind), _address(settings))  # its defaults
        for number, value in ({} if coupled else _SETTINGS).items():
            settings[number - 1] = value
        settings[_FROM_ZERO - 1] = 1
        # the next solver finds the library at once, instead of looking through all folders again (0.2 s)
        os.environ.setdefault("PYPARDISO_MKL_RT", self._solver.libmkl._name)
        self.triangle, self._coupled = symmetric, coupled
        self._matrix, self._pattern = csr_matrix((0, 0)), (np.zeros(0), np.zeros(0))

    def factor(self, matrix: csr_matrix, fresh: bool) -> None:
        """Factor, with a new analysis where the pattern is new or `fresh`."""
        pattern = (matrix.indptr, matrix.indices)
        known = _same(pattern, self._pattern)
        if not len(self._pattern[0]):  # there is nothing to free before
            finalize(self, self._solver.free_memory, everything=True)
        self._matrix, self._pattern = matrix, pattern
        self._solver.iparm[_PIVOTS - 1] = fresh or self._coupled
        self._call(22 if known and not fresh else 12, np.zeros(matrix.shape[0]))

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve with the last factors."""
        return self._call(33, rhs)

    def forget(self) -> None:
        """Let the last matrix go; the analysis of its pattern stays."""
        self._matrix = csr_matrix((0, 0))

    def _call(self, phase: int, rhs: np.ndarray) -> np.ndarray:
        """Run a phase on arrays as they are; pypardiso's own call would copy the pattern, counted from one."""
        pardiso, matrix, x, error = self._solver, self._matrix, np.zeros_like(rhs), c_int32(0)
        copies, which, kind, at, n, sides, silent = (
            byref(c_int32(value)) for value in (1, 1, pardiso.mtype, phase, len(rhs), 1, 0)
        )
        pattern = (_address(matrix.indptr), _address(matrix.indices), _address(pardiso.perm))
        handle, values, settings = _address(pardiso.pt), _address(matrix.data), _address(pardiso.iparm)
        given, found = _address(np.ascontiguousarray(rhs)), _address(x)
        pardiso._mkl_pardiso(
            *(handle, copies, which, kind, at, n, values, *pattern, sides, settings, silent, given, found),
            byref(error),
        )
        if error.value:
            raise ArithmeticError(f"PARDISO refused the stiffness matrix (error {error.value})")
        return x


def _address(array: np.ndarray) -> Any:
    """Where an array without gaps begins, for C."""
    return array.ctypes.data_as(POINTER(np.ctypeslib.as_ctypes_type(array.dtype)))


_SETTINGS = {2: 2, 8: 0, 10: 13, 11: 0, 13: 0, 24: 1}
"""PARDISO's parameters, counted from 1: nested dissection (2), no refinement but where a pivot was perturbed (8), by
1e-13 (10), no scaling (11) or matching (13), which would need a new analysis for every matrix; two levels of parallel
work (24). With its own defaults, which equations with pore pressures need, a solve takes two to three times as long,
for refinement that `DirectSolver` does where it is due."""


_PIVOTS, _FROM_ZERO = 21, 35
"""Pivots of two rows in a symmetric matrix: a tenth slower, only where those of one have left a poor solution; and
indices that count from zero."""
