"""Time of a point update of the enhanced CH model, where it goes, what it needs, and the first call.

`python tests/benchmarks/stress_point.py` prints tables: µs per point for one and two threads, beside the same algorithm
as plain numpy (this script again with the compiler switched off), the bare contact sum and von Mises; the parts of an
update; memory; and the first call of a session with and without compiled code on disk.
Points are plastic, |Δε| = 1e-4, 37 half-sphere directions, tangent included; medians of nine, of processor time but for
two threads.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np
from timing import median_time

import umat
from umat.directions import Directions, directions, mirrored
from umat.lanes import COMPILED
from umat.mandel import Array
from umat.sands import TOYOURA_FABRIC_NORM, toyoura

DEPOSIT = TOYOURA_FABRIC_NORM / 6**0.5 * np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0])
FIRST_CALL = """
import time; begin = time.process_time(), time.perf_counter()
import numpy as np, umat
from umat.directions import directions
from umat.sands import toyoura
material, rule = toyoura(), directions("bazant_oh_37")
state = umat.initial_state(material, rule, np.array([[100.0, 100.0, 100.0, 0.0, 0.0, 0.0]]), void_ratio=0.8)
umat.update(material, rule, np.full((1, 6), 1e-5), state)
print(time.process_time() - begin[0], time.perf_counter() - begin[1])
"""


def plastic_points(n: int, plane_strain: bool = False) -> tuple[umat.ChangHicher, Directions, Array, Any]:
    """Return material, directions, increments of length 1e-4 in n random directions, and the state after twenty."""
    material, rule = toyoura(), directions("bazant_oh_37")
    rng = np.random.default_rng(0)
    increment = rng.normal(size=(n, 6))
    if plane_strain:
        rule = mirrored(directions("bazant_oh_37"))
        increment[:, 3:5] = 0.0
    increment *= 1e-4 / np.linalg.norm(increment, axis=1)[:, None]
    stress = np.tile([100.0, 100.0, 100.0, 0.0, 0.0, 0.0], (n, 1))
    state = umat.initial_state(material, rule, stress, void_ratio=0.8, fabric=DEPOSIT)
    for _ in range(20):
        state = umat.update(material, rule, increment, state).state
    return material, rule, increment, state


def chang_hicher(n: int, threads: int, plane_strain: bool = False) -> dict[str, float]:
    """Return µs and evaluations per point."""
    umat.set_threads(threads)
    points = plastic_points(n, plane_strain)
    clock = time.process_time if threads == 1 else time.perf_counter
    seconds = median_time(lambda: umat.update(*points), 9, clock)
    return {"us": seconds / n * 1e6, "evaluations": float(umat.update(*points).work.mean())}


def von_mises(n: int) -> float:
    """Return µs per point of the fastest reference material, one thread."""
    umat.set_threads(1)
    material = umat.VonMises(1e4, 0.3, 17.3, 100.0)
    state = umat.initial_state(material, None, np.zeros((n, 6)))
    increment = np.random.default_rng(0).normal(size=(n, 6)) * 1e-3
    return median_time(lambda: umat.update(material, None, increment, state), 9, time.process_time) / n * 1e6


def plain_numpy() -> dict[str, float]:
    """Return the figures of this script with the compiler switched off."""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, __file__, "--plain"]
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(found.stdout)


def first_calls() -> list[tuple[float, float]]:
    """Return processor and wall time [s] to the first answer of a session: nothing compiled before, and again."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": folder}
        command = [sys.executable, "-c", FIRST_CALL]
        runs = [
            subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()
            for _ in range(2)
        ]
    return [(float(cpu), float(wall)) for cpu, wall in runs]


def memory() -> str:
    """Return what a point keeps, and what a thread works in."""
    from umat.chang_hicher.material import rule_of
    from umat.chang_hicher.pool import make_pool

    _, rule, _, state = plastic_points(64)
    per_point = sum(array.nbytes for array in state) // 64 // 8
    pool = sum(array.nbytes for array in make_pool(len(rule_of(rule).weights), True))
    return (
        f"A point keeps {per_point} doubles, {per_point - len(rule.weights)} beside one per direction; "
        f"a thread works in {pool // 1024} KiB."
    )


def main() -> None:
    """Print the tables."""
    if not COMPILED:
        print(json.dumps(chang_hicher(256, 1)))
        return
    from stress_point_parts import bare_sum, parts

    one, two, plain = chang_hicher(4096, 1), chang_hicher(4096, 2), plain_numpy()
    quarter = chang_hicher(4096, 1, plane_strain=True)
    limit, mises = bare_sum() * one["evaluations"], von_mises(20000)
    print("| update with tangent, 37 directions | µs per point | ratio |\n|---|---|---|")
    print(f"| Chang–Hicher, one thread ({one['evaluations']:.2f} evaluations) | {one['us']:.2f} | 1 |")
    print(f"| Chang–Hicher, two threads | {two['us']:.2f} | {two['us'] / one['us']:.2f} |")
    print(f"| plane strain, quarter sphere, one thread | {quarter['us']:.2f} | {quarter['us'] / one['us']:.2f} |")
    print(f"| the same source as plain numpy | {plain['us']:.0f} | {plain['us'] / one['us']:.0f} |")
    print(f"| the bare contact sum, as often | {limit:.2f} | {limit / one['us']:.2f} |")
    print(f"| von Mises | {mises:.2f} | {mises / one['us']:.3f} |")
    print("\n| part of an update | µs per point | share |\n|---|---|---|")
    spent = parts(one["evaluations"])
    spent["bookkeeping: into the lanes and out, decisions of single points"] = one["us"] - sum(spent.values())
    for name, us in spent.items():
        print(f"| {name} | {us:.2f} | {us / one['us']:.0%} |")
    print(f"\n{memory()}\n")
    for name, (cpu, wall) in zip(("compiling", "compiled before"), first_calls(), strict=True):
        print(f"First call of a session, {name}: {cpu:.1f} s of processor time, {wall:.1f} s.")


if __name__ == "__main__":
    main()
