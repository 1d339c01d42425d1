"""How a fabric evolution law is written, and how the stress point reads it.

A law is a record of parameters and one function, in one file:

    @law(Name, "fabric", "stress", "plastic")
    def increment(law, fabric, stress, state_parameter, ratio, strain, plastic): ...

which returns the increment of the fabric anisotropy tensor F over a step, six Mandel components. Its
arguments are 6-tuples (`state_parameter` a number): F and the stress at the middle of the step, the state
parameter ψ there, and the increments of the stress ratio tensor s/p, of strain and of plastic strain. Stress may be
in any unit: only ratios of it may be used. The function is plain arithmetic that also holds for complex numbers (no
abs, no comparison but through `.real`), because its derivative is found by a complex step, exact to rounding. The
names in the decorator say which arguments the law reads; the others cost nothing.

A law that is used much may add its own derivative (see `zhao_kruyt`).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from ..lanes import COMPILED, at, entry, inlined, kernel, lanes

#: place of each argument among the inputs of a law, and their number
SPAN = {
    "fabric": (0, 6),
    "stress": (6, 12),
    "state_parameter": (12, 13),
    "ratio": (13, 19),
    "strain": (19, 25),
    "plastic": (25, 31),
}
INPUTS = 31
STEP = 1e-100  #: of the complex step
TINY = 1e-60  #: under a root, so that a direction without length is zero
SMALL = 1e-3  #: length of F and of s/p below which their Lode angle fades out


class _Entry(NamedTuple):
    increment: Callable[..., Any]
    inputs: tuple[int, ...]
    slope: Any


_LAWS: dict[type, _Entry] = {}


def law(
    record: type, *arguments: str, slope: Callable[..., Any] | None = None
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register the decorated function for a record; `arguments` names what it reads."""
    inputs = tuple(k for name in SPAN if name in arguments for k in range(*SPAN[name]))

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        _LAWS[record] = _Entry(function, inputs, slope)
        return function

    return register


def known_laws() -> list[type]:
    """Return the records of all laws that have been imported."""
    return list(_LAWS)


def fabric_increment(
    law: Any, fabric: Any, stress: Any, state_parameter: Any, ratio: Any, strain: Any, plastic: Any
) -> Any:
    """Return the increment of F, six components, of the law that the record belongs to."""
    return _LAWS[type(law)].increment(law, fabric, stress, state_parameter, ratio, strain, plastic)


def active_inputs(law: Any) -> tuple[int, ...]:
    """Return the numbers of the inputs that the law reads."""
    return _LAWS[type(law)].inputs


def slope_of(law: Any, inputs: Any, slope: Any) -> None:
    """Fill the derivative of the increment, rows 31 i + k, from the inputs' rows (both flat)."""
    entry = _LAWS[type(law)]
    if entry.slope is None:
        complex_slope(law, inputs, slope)
    else:
        entry.slope(law, inputs, slope)


if COMPILED:

    @overload(fabric_increment)
    def _fabric_increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
        return _LAWS[law.instance_class].increment

    @overload(active_inputs)
    def _active_inputs(law):
        inputs = _LAWS[law.instance_class].inputs
        return lambda law: inputs

    @overload(slope_of)
    def _slope_of(law, inputs, slope):
        entry = _LAWS[law.instance_class]
        if entry.slope is None:
            return lambda law, inputs, slope: complex_slope(law, inputs, slope)
        return entry.slope.py_func


@inlined
def six_at(rows, first, l):
    """Return six rows as a tuple, of lane l (of all lanes with the compiler switched off)."""
    return (
        rows[at(first, l)],
        rows[at(first + 1, l)],
        rows[at(first + 2, l)],
        rows[at(first + 3, l)],
        rows[at(first + 4, l)],
        rows[at(first + 5, l)],
    )


@kernel
def _shifted(values, first, k):
    """Return the tuple with an imaginary step in its entry k - first, if it has one."""
    a, b, c, d, e, f = values
    step = STEP * 1j
    return (
        a + step * (k == first),
        b + step * (k == first + 1),
        c + step * (k == first + 2),
        d + step * (k == first + 3),
        e + step * (k == first + 4),
        f + step * (k == first + 5),
    )


@entry
def increments(law, inputs, out):
    """Fill six rows with the law's increments from the rows of its inputs (both flat)."""
    for l in lanes():
        a, b, c, d, e, f = fabric_increment(
            law,
            six_at(inputs, 0, l),
            six_at(inputs, 6, l),
            inputs[at(12, l)],
            six_at(inputs, 13, l),
            six_at(inputs, 19, l),
            six_at(inputs, 25, l),
        )
        out[at(0, l)], out[at(1, l)], out[at(2, l)] = a, b, c
        out[at(3, l)], out[at(4, l)], out[at(5, l)] = d, e, f


@entry
def complex_slope(law, inputs, slope):
    """Fill the derivative of any law by complex steps."""
    for k in active_inputs(law):
        for l in lanes():
            values = fabric_increment(
                law,
                _shifted(six_at(inputs, 0, l), 0, k),
                _shifted(six_at(inputs, 6, l), 6, k),
                inputs[at(12, l)] + STEP * 1j * (k == 12),
                _shifted(six_at(inputs, 13, l), 13, k),
                _shifted(six_at(inputs, 19, l), 19, k),
                _shifted(six_at(inputs, 25, l), 25, k),
            )
            a, b, c, d, e, f = values
            slope[at(k, l)] = a.imag / STEP
            slope[at(INPUTS + k, l)] = b.imag / STEP
            slope[at(2 * INPUTS + k, l)] = c.imag / STEP
            slope[at(3 * INPUTS + k, l)] = d.imag / STEP
            slope[at(4 * INPUTS + k, l)] = e.imag / STEP
            slope[at(5 * INPUTS + k, l)] = f.imag / STEP


# --- tensors as 6-tuples, also complex -------------------------------------------------------------------------


@inlined
def dot(a, b):
    """Return a : b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@inlined
def scaled(k, a):
    """Return k a."""
    return (k * a[0], k * a[1], k * a[2], k * a[3], k * a[4], k * a[5])


@inlined
def plus(a, b):
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


@inlined
def deviator(a):
    """Return a - tr(a)/3 I."""
    m = (a[0] + a[1] + a[2]) / 3.0
    return (a[0] - m, a[1] - m, a[2] - m, a[3], a[4], a[5])


@inlined
def length(a):
    """Return √(a : a)."""
    return np.sqrt(dot(a, a) + TINY)


@inlined
def determinant(a):
    """Return det a of a tensor in Mandel components."""
    return a[0] * a[1] * a[2] + 0.5 * (
        2.0**0.5 * a[3] * a[4] * a[5] - a[0] * a[3] * a[3] - a[1] * a[4] * a[4] - a[2] * a[5] * a[5]
    )


@inlined
def cos3theta(a):
    """Return cos 3θ of a deviator, θ = 0 in compression; it fades to 0 where a is shorter than `SMALL`."""
    n2 = dot(a, a) + SMALL * SMALL
    return 3.0 * 6.0**0.5 * determinant(a) / (n2 * np.sqrt(n2))


@inlined
def stress_ratio(stress):
    """Return the tensor s/p and q/p."""
    p = (stress[0] + stress[1] + stress[2]) / 3.0
    ratio = scaled(1.0 / p, deviator(stress))
    return ratio, np.sqrt(1.5 * (dot(ratio, ratio) + SMALL * SMALL * 1e-6))
