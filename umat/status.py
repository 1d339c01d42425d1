"""What became of a point: failure is a value, one int8 code per point, 0 when done.

A refused point returns its old stress and state, so nothing of the attempt is left.
Codes are plain integers because compiled kernels use them as constants.
"""

OK = 0
NO_CONVERGENCE = 1
WORK_LIMIT = 2
NO_EQUILIBRIUM = 3
PRESSURE_RANGE = 4
VOID_RATIO_RANGE = 5
FABRIC_LIMIT = 6
BAD_INPUT = 7
CUT_BACK = 8
OUTSIDE_FAULT = 9

_MESSAGES = {
    OK: "The point was updated.",
    NO_CONVERGENCE: "The local iteration did not converge; try a smaller increment.",
    WORK_LIMIT: "The bound on the work of one point was reached; "
    "try a smaller increment, a looser tolerance or a higher bound.",
    NO_EQUILIBRIUM: "No stress carries this strain increment; try a smaller increment.",
    PRESSURE_RANGE: "The pressure left the range in which the law holds; try a smaller increment or some confinement.",
    VOID_RATIO_RANGE: "The void ratio left the range in which the law holds; "
    "check the initial void ratio or try a smaller increment.",
    FABRIC_LIMIT: "The fabric would make the density of contacts negative in some "
    "direction; check the initial fabric or try a smaller increment.",
    BAD_INPUT: "A strain increment or an old state is not a finite number.",
    CUT_BACK: "The external routine asks for a smaller increment (PNEWDT < 1).",
    OUTSIDE_FAULT: "The external routine returned a stress, a state or a tangent that is not a finite number; "
    "try a smaller increment, and `fabfem check-umat`.",
}

CODES = tuple(_MESSAGES)


def message(code: int) -> str:
    """Return the sentence that explains a status code, and what to try."""
    return _MESSAGES[int(code)]
