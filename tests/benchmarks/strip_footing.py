"""The strip footing: what its settings cost and change, and its curve beside the centrifuge tests.

    python tests/benchmarks/strip_footing.py                 the table of docs/footing.md (about ten minutes)
    python tests/benchmarks/strip_footing.py --curve PNG     load against settlement, bedding horizontal and vertical

Each row of the table changes one setting of `cases/footing/strip_toyoura.toml`. Times are without compilation.
"""

import argparse
import csv
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fabfem.boundary_value.problem import build
from fabfem.case import read_case
from fabfem.fem.solve import Stopped, march, reaction

CASE = Path(__file__).parents[2] / "cases" / "footing" / "strip_toyoura.toml"
MEASURED = CASE.with_name("toyoura_footing_centrifuge.csv")
WIDTH, UNIT_WEIGHT, SETTLEMENT = 0.9, 15.3, 0.09
SHARES = (0.25, 0.5, 0.75, 1.0)
"""Parts of the settlement at which the load is printed."""
ROWS: dict[str, dict[str, str]] = {
    "as shipped": {},
    "viscosity 1e-3": {"viscosity": "1e-3"},
    "viscosity 5e-4": {"viscosity": "5e-4"},
    "viscosity 1e-4": {"viscosity": "1e-4"},
    "force tolerance 1e-2": {"tolerance": "1e-2"},
    "force tolerance 1e-3": {"tolerance": "1e-3"},
    "point tolerance 1e-2": {"open_pressure": "1e-3\ntolerance = 1e-2"},
    "point tolerance 1e-4": {"open_pressure": "1e-3\ntolerance = 1e-4"},
    "open pressure 1e-4": {"open_pressure": "1e-4"},
    "no point held": {"held": "0.0"},
    "increments 2 %": {"increments": "{ initial = 0.01, minimum = 1e-5, maximum = 0.02 }"},
    "increments 0.5 %": {"increments": "{ initial = 0.005, minimum = 1e-5, maximum = 0.005 }"},
}
"""Keys of the case and their values."""


class Curve(NamedTuple):
    """Load against settlement, and what it took."""

    settlement: np.ndarray
    """Over the width [-]."""
    load: np.ndarray
    """q/γB [-]."""
    seconds: float
    iterations: int
    held: int
    """Most points held in one increment."""
    drag: float
    """Largest share of viscous forces."""
    end: str
    """Empty, or why it stopped."""


def changed(text: str, values: dict[str, str]) -> str:
    """Return the case with the first line `key = …` of each key changed."""
    for key, value in values.items():
        lines = text.splitlines()
        place = next(i for i, line in enumerate(lines) if line.startswith(f"{key} = "))
        lines[place] = f"{key} = {value}"
        text = "\n".join(lines)
    tomllib.loads(text)
    return text


def run(values: dict[str, str], bedding: float = 0.0, most: int = 10_000) -> Curve:
    """Run the case with some values changed, `most` increments of the settlement."""
    text = changed(CASE.read_text(encoding="utf-8"), values).replace(
        "bedding_angle = 0.0", f"bedding_angle = {bedding}"
    )
    text = text.replace("../../meshes", (CASE.parents[2] / "meshes").as_posix())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_text(text, encoding="utf-8")
        problem = build(read_case(path))
    begin, steps, end = time.perf_counter(), [], ""
    for step in march(problem.model):
        if isinstance(step, Stopped):
            end = f"stopped at {100 * step.fraction:.0f} %: {step.reason}"
        elif step.stage == "settlement":
            steps.append(step)
        if len(steps) == most:
            break
    load = [-2.0 * reaction(problem.model.space, step, "footing", "y") for step in steps]
    return Curve(
        settlement=np.array([0.0, *(step.fraction for step in steps)]) * SETTLEMENT / WIDTH,
        load=np.array([0.0, *load]) / (WIDTH * UNIT_WEIGHT * WIDTH),
        seconds=time.perf_counter() - begin,
        iterations=sum(step.iterations for step in steps),
        held=max(step.held for step in steps),
        drag=max(step.drag for step in steps),
        end=end,
    )


def table() -> None:
    """Print the table."""
    run({}, most=2)  # compiles
    heads = " | ".join(f"s/B = {100 * share * SETTLEMENT / WIDTH:.1f} %" for share in SHARES)
    print(f"| setting | {heads} | seconds | solves | held | drag | end |")
    print("|" + "---|" * (6 + len(SHARES)))
    for name, values in ROWS.items():
        curve = run(values)
        last = curve.settlement[-1]
        wanted = np.array(SHARES) * SETTLEMENT / WIDTH
        loads = np.where(wanted <= last + 1e-9, np.interp(wanted, curve.settlement, curve.load), np.nan)
        cells = [*(f"{load:.2f}" for load in loads), f"{curve.seconds:.0f}", curve.iterations, curve.held]
        print(f"| {name} |", *(f"{cell} |" for cell in cells), f"{100 * curve.drag:.2f} % | {curve.end} |", flush=True)


def measured() -> list[dict[str, Any]]:
    """Return the rows of the centrifuge tests."""
    with MEASURED.open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def draw(picture: Path) -> None:
    """Draw the curves of both beddings and the measured peaks."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
    for bedding, label, colour in ((0.0, "horizontal", "#1b5a8c"), (90.0, "vertical", "#c0561c")):
        curve = run({}, bedding)
        print(bedding, curve.seconds, curve.end, np.column_stack([curve.settlement, curve.load])[::10], sep="\n")
        axes.plot(100 * curve.settlement, curve.load, color=colour, lw=2, label=f"fabfem, bedding {label}")
        for row in measured():
            if float(row["bedding_deg"]) == bedding:
                peak = float(row["q_peak_kPa"]) / (float(row["gamma_kN_m3"]) * float(row["B_m"]))
                where = 100 * float(row["s_over_B_at_peak"])
                axes.plot(where, peak, "o", color=colour, label=f"centrifuge, peak, bedding {label}")
    axes.set(xlabel="settlement s/B [%]", ylabel="q/γB [-]", xlim=(0, None), ylim=(0, None))
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.savefig(picture, dpi=130)


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--curve", type=Path, metavar="PNG")
    asked = parser.parse_args()
    if asked.curve:
        draw(asked.curve)
    else:
        table()


if __name__ == "__main__":
    main()
