"""How wrong a set of contact directions is, and what it costs: undrained shear at fixed α to 10 % strain.

    python tests/benchmarks/direction_sets.py [--alpha 45] [--b 0] [--turns 8]
    python tests/benchmarks/direction_sets.py --paths

Error: the largest difference of q, and of p, from the path with `lebedev_65` (727 directions), over the path's
largest q. Each rule stands in the frame of the deposit (as it is), in that of the stress (turned by α), and in random
frames. Rules that are symmetric about the plane of shear are then mirrored: the quarter sphere that is left, in frames
that turn within the plane. Time: processor time of the path in a batch of 64 points, least of three, over that of
`bazant_oh_37` as it is. `--paths` prints instead the errors of some rules in both frames along eight paths.
"""

import argparse
import time
from contextlib import suppress

import numpy as np

import umat
from umat import mandel, path
from umat.directions import Directions, directions, mirrored, rotated
from umat.sands import TOYOURA_FABRIC_NORM, toyoura

RULES = ("bazant_oh_21", "lebedev_11", "bazant_oh_33", "gauss_6x12", "bazant_oh_37", "lebedev_15", "lebedev_17",
         "icosahedral_61", "gauss_8x16", "lebedev_19", "lebedev_21", "lebedev_23", "gauss_12x16")  # fmt: skip
EXACT = "lebedev_65"
FEW = ("bazant_oh_37", "lebedev_17", "lebedev_19", "lebedev_21", "lebedev_23")
PATHS = (
    *((alpha, 0.5, 0.8) for alpha in (15.0, 30.0, 45.0, 60.0, 75.0)),
    *((alpha, 0.0, 0.833) for alpha in (20.0, 45.0, 70.0)),
)
"""α [deg], b and void ratio."""
VERTICAL = mandel.deviator([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
RECORDS = 50


def follow(rule: Directions, leg: path.Leg, void_ratio: float, n: int = 1) -> path.History:
    """Return the path of n equal points."""
    sand = toyoura()
    fabric = TOYOURA_FABRIC_NORM * VERTICAL / mandel.norm(VERTICAL)
    stress = np.repeat(100.0 * mandel.IDENTITY[None], n, axis=0)
    return path.follow(
        sand, rule, umat.initial_state(sand, rule, stress, void_ratio=void_ratio, fabric=fabric), leg, RECORDS
    )


def curve(rule: Directions, leg: path.Leg, void_ratio: float) -> np.ndarray:
    """Return q and p along the path, (2, records)."""
    history = follow(rule, leg, void_ratio)
    return np.stack([mandel.q(history.stress[1:, 0]), mandel.p(history.stress[1:, 0])])


def cost(rule: Directions, leg: path.Leg, void_ratio: float) -> float:
    """Return the seconds of the path in a batch."""
    seconds = []
    for _ in range(3):
        begin = time.process_time()
        follow(rule, leg, void_ratio, 64)
        seconds.append(time.process_time() - begin)
    return min(seconds)


def turns(n: int) -> np.ndarray:
    """Return n random rotations (n, 3, 3)."""
    q, r = np.linalg.qr(np.random.default_rng(0).normal(size=(n, 3, 3)))
    q *= np.sign(np.einsum("nii->ni", r))[:, None]
    q[np.linalg.det(q) < 0.0] *= -1.0
    return q


def in_plane(degrees: float) -> np.ndarray:
    """Return the rotation (3, 3) from the vertical y to the horizontal x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def quarters(name: str) -> list[Directions]:
    """Return the quarter spheres of a rule that is symmetric about the plane of shear, turned within it; or nothing."""
    found = []
    for degrees in (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 120.0, 150.0):
        with suppress(ValueError):
            found.append(mirrored(rotated(directions(name), in_plane(degrees))))
    return found


def error(rule: Directions, leg: path.Leg, void_ratio: float, exact: np.ndarray) -> float:
    """Return the error of a rule along a path [%]."""
    return 100.0 * float(np.nanmax(np.abs(curve(rule, leg, void_ratio) - exact)) / exact[0].max())


def undrained(alpha: float, b: float) -> path.Leg:
    """Return the path."""
    return path.undrained(0.1, alpha=alpha, b=b, vertical="y", horizontal="x")


def print_paths() -> None:
    """Print the errors of some rules in the frames of the deposit and of the stress along eight paths."""
    print("| α | b |", *(f"{name} |" for name in FEW))
    print("|" + "---|" * (2 + len(FEW)))
    for alpha, b, void_ratio in PATHS:
        leg = undrained(alpha, b)
        exact = curve(directions(EXACT), leg, void_ratio)
        cells = []
        for name in FEW:
            frames = directions(name), rotated(directions(name), in_plane(alpha))
            cells.append(", ".join(f"{error(rule, leg, void_ratio, exact):.1f} %" for rule in frames))
        print(f"| {alpha:g}° | {b:g} |", *(f"{cell} |" for cell in cells), flush=True)


def print_rules(alpha: float, b: float, void_ratio: float, n_turns: int) -> None:
    """Print the errors and times of all rules along one path."""
    leg = undrained(alpha, b)
    exact = curve(directions(EXACT), leg, void_ratio)

    def off(rule: Directions) -> float:
        return error(rule, leg, void_ratio, exact)

    def spread(rules: list[Directions]) -> str:
        errors = [off(rule) for rule in rules]
        return f"{np.mean(errors):.1f} %, {max(errors):.1f} %" if errors else ""

    unit = cost(directions("bazant_oh_37"), leg, void_ratio)
    titles = ("rule", "directions", "deposit's frame", "stress's frame", "random frames: mean, most", "time",
              "mirrored", "frames in the plane: mean, most", "time")  # fmt: skip
    print("|", *(f"{title} |" for title in titles))
    print("|" + "---|" * len(titles))
    for name in RULES:
        rule, parts = directions(name), quarters(name)
        cells = [name, len(rule), f"{off(rule):.1f} %", f"{off(rotated(rule, in_plane(alpha))):.1f} %"]
        cells += [spread([rotated(rule, turn) for turn in turns(n_turns)])]
        cells += [f"{cost(rule, leg, void_ratio) / unit:.2f}"]
        cells += [len(parts[0]) if parts else "", spread(parts)]
        cells += [f"{cost(parts[0], leg, void_ratio) / unit:.2f}" if parts else ""]
        print("|", *(f"{cell} |" for cell in cells), flush=True)


def main() -> None:
    """Read the command line and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--alpha", type=float, default=45.0)
    parser.add_argument("--b", type=float, default=0.0)
    parser.add_argument("--void-ratio", type=float, default=0.833)
    parser.add_argument("--turns", type=int, default=8)
    parser.add_argument("--paths", action="store_true")
    asked = parser.parse_args()
    umat.set_threads(1)
    if asked.paths:
        print_paths()
    else:
        print_rules(asked.alpha, asked.b, asked.void_ratio, asked.turns)


if __name__ == "__main__":
    main()
