"""Time of a point update of the enhanced CH model, and where it goes.

`python tests/benchmarks/stress_point.py` prints µs per point for one and two threads, beside the same algorithm as
plain numpy (this script again with the compiler switched off) and von Mises.
Points are plastic, |Δε| = 1e-4, 37 half-sphere directions, tangent included; medians of five.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

import umat
from umat.directions import directions
from umat.lanes import COMPILED
from umat.mandel import Array
from umat.sands import TOYOURA_FABRIC_NORM, toyoura

DEPOSIT = TOYOURA_FABRIC_NORM / 6**0.5 * np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0])


def median_time(run: Callable[[], object], repeats: int = 5) -> float:
    """Return the median wall time of `run` [s]."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def plastic_points(n: int) -> tuple[umat.ChangHicher, object, Array, object]:
    """Return material, directions, increments of length 1e-4 in n random directions, and the state after twenty."""
    material, rule = toyoura(), directions("bazant_oh_37")
    rng = np.random.default_rng(0)
    increment = rng.normal(size=(n, 6))
    increment *= 1e-4 / np.linalg.norm(increment, axis=1)[:, None]
    stress = np.tile([100.0, 100.0, 100.0, 0.0, 0.0, 0.0], (n, 1))
    state = umat.initial_state(material, rule, stress, void_ratio=0.8, fabric=DEPOSIT)
    for _ in range(20):
        state = umat.update(material, rule, increment, state).state
    return material, rule, increment, state


def chang_hicher(n: int, threads: int) -> dict[str, float]:
    """Return µs and evaluations per point."""
    umat.set_threads(threads)
    points = plastic_points(n)
    seconds = median_time(lambda: umat.update(*points))
    return {"us": seconds / n * 1e6, "evaluations": float(umat.update(*points).work.mean())}


def von_mises(n: int) -> float:
    """Return µs per point of the fastest reference material, one thread."""
    umat.set_threads(1)
    material = umat.VonMises(1e4, 0.3, 17.3, 100.0)
    state = umat.initial_state(material, None, np.zeros((n, 6)))
    increment = np.random.default_rng(0).normal(size=(n, 6)) * 1e-3
    return median_time(lambda: umat.update(material, None, increment, state)) / n * 1e6


def plain_numpy() -> dict[str, float]:
    """Return the figures of this script with the compiler switched off."""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, __file__, "--plain"]
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(found.stdout)


def main() -> None:
    """Print the table."""
    if not COMPILED:
        print(json.dumps(chang_hicher(256, 1)))
        return
    one, two, plain = chang_hicher(4096, 1), chang_hicher(4096, 2), plain_numpy()
    print("| update with tangent, 37 directions | µs per point | ratio |\n|---|---|---|")
    print(f"| Chang–Hicher, one thread ({one['evaluations']:.1f} evaluations) | {one['us']:.2f} | 1 |")
    print(f"| Chang–Hicher, two threads | {two['us']:.2f} | {two['us'] / one['us']:.2f} |")
    print(f"| the same source as plain numpy | {plain['us']:.0f} | {plain['us'] / one['us']:.0f} |")
    print(f"| von Mises | {(vm := von_mises(20000)):.2f} | {vm / one['us']:.3f} |")


if __name__ == "__main__":
    main()
