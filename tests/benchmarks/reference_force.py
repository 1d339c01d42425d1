"""Error against the drained tests of Toyoura sand by reference force and fabric: table in docs/study.md.

``python tests/benchmarks/reference_force.py [FOLDER]``; runs are kept in FOLDER (results/reference_force).
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console

from fabfem.case import case_from, read_tables
from fabfem.study.calibrate import Fit, to_unit
from fabfem.study.measured import measured_curves
from fabfem.study.processes import Pool, limits

CASE = Path(__file__).parents[2] / "cases" / "studies" / "toyoura_f_ref.toml"
FORCES = (1e-6, 2.5e-6, 5e-6, 1e-5, 2e-5, 5e-5)
"""Reference forces [kN]."""
FABRICS = {
    "evolving from 0.208": {"law": "zhao_kruyt", "norm": 0.208},
    "frozen at 0.208": {"law": "constant", "norm": 0.208},
    "evolving from 0": {"law": "zhao_kruyt", "norm": 0.0},
    "none": {"law": "constant", "norm": 0.0},
}


def main(folder: Path) -> None:
    """Print a row for each fabric and force."""
    tables = read_tables(CASE)
    print("| σ1/σ3, ε_v [%] at f_ref [N] |", *(f"{1e3 * force:g} |" for force in FORCES))
    print("|---|" + "---|" * len(FORCES))
    with Pool(limits()) as pool:
        for name, fabric in FABRICS.items():
            sand = {"sand": tables["material"]["sand"] | {"fabric": fabric}}
            case = case_from(tables | {"material": sand}, CASE)
            assert case.calibration is not None
            measured = measured_curves(case.calibration, case.locate(case.calibration.data), CASE.name)
            fit = Fit(case, case.calibration, measured, tables | {"material": sand}, folder, pool, Console(quiet=True))
            units = [np.array([to_unit(case.calibration.parameter[0], force)]) for force in FORCES]
            fit.answer(units)
            rms = [fit.rms(unit)["all"] for unit in units]
            print(f"| fabric {name} |", *(f"{gap['sr']:.3f}, {gap['eps_v_pct']:.2f} |" for gap in rms), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("results/reference_force"))
