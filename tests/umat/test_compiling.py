"""Kernels within kernels are compiled by passes of their own and compute what they do compiled by numba alone."""

import gc
import subprocess
import sys

import numpy as np
import pytest

from umat.lanes import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="the compiler is switched off")


def power(x, n):
    """Return x**n by a loop."""
    value = 1.0
    for _ in range(n):
        value = value * x
    return value


def between(x):
    """Return what lies between a kernel and another one that it calls."""
    return min(power(x, 3), 5.0)


def several(x, out):
    """Fill three numbers, through a function that is called by two others."""
    out[0], out[1] = power(x, 2), between(x)
    if out[0] > out[1]:
        out[2] = out[0] - out[1]
    else:
        out[2] = -1.0


@pytest.fixture
def answers():
    """Return a function of the decorators of the inner and of the middle function that gives the three numbers."""
    from numba import njit

    def build(inner, middle):
        scope = {}
        for function, decorator in ((power, inner), (between, middle), (several, njit)):
            namespace = function.__globals__ | scope
            scope[function.__name__] = decorator(type(function)(function.__code__, namespace, function.__name__))
        filled = []
        for x in (0.3, 1.5, 2.5):
            out = np.zeros(3)
            scope["several"](x, out)
            filled.append(out)
        return np.array(filled)

    return build


@pytest.mark.parametrize("middle", ["numba", "kernel", "inlined"])
@pytest.mark.parametrize("inner", ["kernel", "inlined"])
def test_kernels_compute_what_numba_makes_of_them(answers, inner, middle):
    from numba import njit

    from umat import lanes

    by = {"numba": njit, "kernel": lanes.kernel, "inlined": lanes.inlined}
    expected = np.array([[0.09, 0.027, 0.063], [2.25, 3.375, -1.0], [6.25, 5.0, 1.25]])
    np.testing.assert_allclose(answers(by[inner], by[middle]), expected, rtol=1e-14)
    np.testing.assert_array_equal(answers(by[inner], by[middle]), answers(njit, njit))


def test_inner_kernels_have_no_machine_code():
    from umat import lanes, lookups

    kernel = lanes.kernel(power)
    kernel.compile("float64(float64, int64)")
    library = next(iter(kernel.overloads.values())).library
    assert library._compiled_object is None
    assert [f.name for f in library._final_module.functions if not f.is_declaration]
    # an operation on the same types is looked up once, whatever function it stands in
    known = len(lookups._signatures), len(lookups._builders)
    lanes.kernel(lambda a, b: (a * b) * a).compile("float64(float64, float64)")
    assert (len(lookups._signatures), len(lookups._builders)) == known


def test_garbage_is_collected_after_compiling():
    from umat import lanes

    assert gc.isenabled()
    lanes.kernel(lambda a: a + 1).compile("int64(int64)")
    assert gc.isenabled()
    with pytest.raises(Exception, match="nothing"):
        lanes.kernel(lambda a: a.nothing).compile("float64(float64)")
    assert gc.isenabled()


def test_a_numba_that_is_not_known_compiles_by_itself():
    code = (
        "import numba; numba.__version__ = '9.9.0'\n"
        "import sys; from umat import lanes\n"
        "assert 'umat.compiling' not in sys.modules\n"
        "inner = lanes.inlined(lambda x: x * x)\n"
        "print(numba.njit(lambda x: inner(x) + 1.0)(3.0))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "10.0\n", done.stderr
