"""The local iteration of one point, a line for each evaluation: ``NUMBA_DISABLE_JIT=1 python -m fabfem.trace FILE``.

Without the compiler a kernel is a plain function, so that the one that judges every evaluation can be watched; this is
done in a process that does nothing else. Arithmetic differs from the compiled kernel's in the last digits.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from fabfem.output.archive import read_archive

HEAD = "  evaluation  fraction    portion     iteration  residual    sub-step    then"


def watched(judge: Callable[..., int], tell: Callable[[str], None]) -> Callable[..., int]:
    """Return the function that judges an evaluation of the Chang–Hicher point, telling what it judges."""
    from umat.chang_hicher import pool as codes
    from umat.chang_hicher import rows
    from umat.lanes import spot

    verdicts: dict[Any, str] = {codes.EQUILIBRIUM: "equilibrium", codes.ITERATE: "next step", codes.CUT: "given up"}

    def judged(constants: Any, count: int, pool: Any, lane: int) -> int:
        verdict = judge(constants, count, pool, lane)
        fraction, portion, norm, length, margin = (
            float(pool.rows[spot(row, lane)])
            for row in (rows.FRACTION, rows.PORTION, rows.NORM, rows.LENGTH, rows.MARGIN)
        )
        done = verdicts.get(verdict, "outside the friction limit" if margin <= 0.0 else "try again")
        counts = int(pool.counts[codes.EVALUATIONS, lane]), int(pool.counts[codes.ITERATIONS, lane])
        tell(
            f"  {counts[0]:10d}  {fraction:<10.4e}  {portion:<10.4e}  {counts[1]:9d}  {norm:.4e}  {length:.4e}  {done}"
        )
        return verdict

    return judged


def main(file: Path) -> None:
    """Print the local iteration of the point in a file and its status."""
    import umat
    from umat.status import message

    integrate = import_module("umat.chang_hicher.integrate")  # the package has a function of that name
    point = read_archive(file).refused
    print(HEAD)
    integrate.judge = watched(integrate.judge, print)  # type: ignore[attr-defined]
    response = umat.update(point.material, point.directions, point.strain_increment, point.state)
    print(f"  status {int(response.status[0])}, {message(int(response.status[0]))}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
