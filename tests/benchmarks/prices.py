"""Price and cost of shipped cases: ``python tests/benchmarks/prices.py [CASE ...]`` writes the table of docs/study.md.

Each case is priced by ``fabfem check --price`` with an empty store of rates, run by ``fabfem solve``, and priced
again. What a run took is the processor time of its process from start to end, on one thread, because other programs
share the machine; on one that does nothing else it is the wall time.
"""

import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from page import write_table

from umat.cache import FOLDER, user_cache

HOME = Path(__file__).parents[2]
CASES = (
    *sorted(f"element/{path.stem}" for path in (HOME / "cases" / "element").glob("*.toml")),
    *("fabric/all_laws", "fabric/contacts_3d", "fabric/critical_surfaces", "fabric/probe_2d_isobaric"),
    *("fabric/yuan_8_11_dense", "fabric/yuan_13_creation"),
    *("studies/lame", "studies/strip_von_mises", "studies/strip_prandtl", "hollow_cylinder/torsion"),
    *("hollow_cylinder/thin_wall", "footing/eccentric_clay", "footing/inclined_clay", "slope/griffiths_lane_1"),
    *("specimen/biaxial_band", "footing/strip_toyoura"),
)
UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}
HEADINGS = (
    "case",
    "predicted at first use [s]",
    "processor time [s]",
    "predicted / taken",
    "predicted after the run [s]",
)


def measure(name: str, environment: dict[str, str]) -> tuple[str, float, float, float]:
    """Return the name of a case, its price at first use, what it took, and its price afterwards [s]."""
    path = str(HOME / "cases" / f"{name}.toml")
    first = _price(path, environment)
    with tempfile.TemporaryDirectory() as folder:
        before = _children()
        _fabfem(["solve", path, "--out", folder, "--quiet"], environment)
        taken = _children() - before
    return name, first, taken, _price(path, environment)


def _price(path: str, environment: dict[str, str]) -> float:
    said = re.search(r"time +about ([\d.e+]+) (s|min|h)\b", _fabfem(["check", path, "--price"], environment))
    assert said, path
    return float(said[1]) * UNITS[said[2]]


def _fabfem(words: list[str], environment: dict[str, str]) -> str:
    command = [sys.executable, "-m", "fabfem", *words]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False).stdout


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(names: list[str]) -> None:
    """Price and run cases, and replace the table in the page if all were asked for."""
    with tempfile.TemporaryDirectory() as cache:
        (Path(cache) / FOLDER).symlink_to(user_cache() / FOLDER)  # kernels are there, rates are not
        single = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
        environment = os.environ | dict.fromkeys(single, "1") | {"XDG_CACHE_HOME": cache}
        rows = []
        for name in names or CASES:
            rows.append(measure(name, environment))
            print(*rows[-1], flush=True)
    ratios = [max(first / taken, taken / first) for _, first, taken, _ in rows]
    lines = ["| " + " | ".join(HEADINGS) + " |", "|" + "---|" * len(HEADINGS)]
    lines += [f"| `{name}` | {a:.2g} | {b:.2g} | {a / b:.2f} | {c:.2g} |" for name, a, b, c in rows]
    within = sum(ratio <= 2.0 for ratio in ratios)
    lines.append(f"\n{within} of {len(rows)} within a factor of two at first use.")
    print(lines[-1])
    if not names:
        write_table("study.md", "prices", lines)


if __name__ == "__main__":
    main(sys.argv[1:])
