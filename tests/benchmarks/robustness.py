"""Random strain increments on random points: how often the stress point succeeds, and what it costs.

    python tests/benchmarks/robustness.py [--cases 200000] [--law zhao_kruyt] [--localisation total] [--units kPa]

Pressure 0.1 kPa … 10 MPa, void ratio 0.58 … 1.1, ‖F‖ from 0 to the limit where E(n) vanishes somewhere, after random
shear of up to 5 %, an increment of 10⁻⁸ … 0.05 in shear, compression, extension, reversed, carried on or mixed.
`--law all` runs every law. Prints a table by decade of ‖Δε‖; `umat` alone is needed.
"""

import argparse
import time
from typing import Any, NamedTuple

import numpy as np

import umat
from umat import mandel, status
from umat.chang_hicher.integrate import integrate
from umat.chang_hicher.material import constants_of, rule_of
from umat.chang_hicher.planes import terms
from umat.chang_hicher.pool import make_pool
from umat.directions import Directions, directions
from umat.fabric import LAWS
from umat.sands import toyoura

KINDS = ("shear", "compression", "extension", "reversed", "carried on", "mixed")
UNITS = {"kPa": (1e3, 1.0), "Pa": (1.0, 1.0), "MPa": (1e6, 1.0)}
DECADES = range(-8, -1)
SPAN = (-8.0, np.log10(0.05))


class Cases(NamedTuple):
    """Points and what is asked of them."""

    state: Any
    increment: np.ndarray
    kind: np.ndarray


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return the vectors divided by their lengths."""
    return vectors / mandel.norm(vectors)[:, None]


def random_fabric(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return fabrics (n, 6) from none to 99 % of the limit of positive density, many of them small."""
    direction = unit(mandel.deviator(rng.normal(size=(n, 6))))
    limit = -1.0 / np.linalg.eigvalsh(mandel.to_tensor(direction)).min(axis=1)
    share = rng.uniform(0.0, 0.99, n) * rng.choice([0.0, 0.1, 0.3, 1.0], n)
    return (share * limit)[:, None] * direction


def start(material: Any, rule: Directions, rng: np.random.Generator, n: int) -> Any:
    """Return random points; half of them under isotropic stress where the law lets them be, the others under 3 p G."""
    pressure = material.reference_pressure / 101.3 * 10.0 ** rng.uniform(-1.0, 4.0, n)
    void_ratio, fabric = rng.uniform(0.58, 1.1, n), random_fabric(rng, n)
    along_fabric = rng.random(n) < 0.5
    limit = np.tan(np.radians(material.friction_angle))
    along_fabric |= mandel.norm(fabric) > 0.5 * limit  # an isotropic stress may not be carried
    stress = pressure[:, None] * (mandel.IDENTITY + 0.4 * along_fabric[:, None] * fabric)
    return umat.initial_state(material, rule, stress, void_ratio=void_ratio, fabric=fabric)


def random_cases(material: Any, rule: Directions, n: int, seed: int, steps: int = 10) -> Cases:
    """Return points sheared in `steps` random increments of up to 0.05 together, and an increment for each."""
    rng = np.random.default_rng(seed)
    state = start(material, rule, rng, n)
    before, amount = unit(rng.normal(size=(n, 6))), 10.0 ** rng.uniform(-5.0, SPAN[1], n)
    for _ in range(steps):
        state = umat.update(material, rule, before * (amount / steps)[:, None], state).state
    kind, volume = rng.integers(0, len(KINDS), n), rng.normal(size=(n, 6))
    direction = np.select(
        [(kind == k)[:, None] for k in range(5)],
        [mandel.deviator(volume), volume + 3 * mandel.IDENTITY, volume - 3 * mandel.IDENTITY, -before, before],
        volume,
    )
    return Cases(state, 10.0 ** rng.uniform(*SPAN, n)[:, None] * unit(direction), kind)


def substeps(material: Any, rule: Directions, cases: Cases) -> np.ndarray:
    """Return the number of sub-steps of each point, which the kernel counts and a response does not carry."""
    old, n = cases.state, len(cases.increment)
    constants, padded = constants_of(material), rule_of(rule)
    data = (old.stress / material.reference_pressure, *(np.array(a) for a in old[1:]), cases.increment)
    counts = np.zeros(n, np.int8), np.zeros(n), np.zeros(n, np.int32), np.zeros(n, np.int32)
    out = (*(np.array(a) for a in data[:6]), np.zeros((n, 6, 6)), *counts)
    pool = make_pool(len(padded.weights), constants.total)
    integrate(material.law, constants, padded, terms(rule.symmetry == "quarter"), pool, data, out, np.arange(n))
    return counts[3]


def table(material: Any, rule: Directions, cases: Cases, response: Any) -> None:
    """Print success and work by decade, the kinds of the refused, and their codes."""
    size = mandel.norm(cases.increment)
    failed = response.status != status.OK
    cuts = substeps(material, rule, cases)
    print(
        f"{'strain':>8} {'cases':>8} {'refused':>8} {'success':>10} {'evaluations':>12} {'99 %':>6} {'most':>6}"
        f" {'sub-steps':>10} {'most':>6}  codes"
    )
    for decade in DECADES:
        inside = (size >= 10.0**decade) & (size < 10.0 ** (decade + 1))
        done, work = inside & ~failed, response.work[inside & ~failed]
        if not done.any():
            continue
        codes = response.status[inside & failed]
        codes = ", ".join(f"{code}: {(codes == code).sum()}" for code in np.unique(codes))
        rate = 100.0 * done.sum() / inside.sum()
        print(f"{f'1e{decade}':>8} {inside.sum():8d} {(inside & failed).sum():8d} {rate:9.3f}% {work.mean():12.1f}"
              f" {np.percentile(work, 99):6.0f} {work.max():6d}"
              f" {cuts[done].mean():10.2f} {cuts[done].max():6d}  {codes}")  # fmt: skip
    for k, name in enumerate(KINDS):
        print(f"{name:>12}: {(failed & (cases.kind == k)).sum()} of {(cases.kind == k).sum()} refused")
    pressure = mandel.p(cases.state.stress[failed]) / material.reference_pressure
    if failed.any():
        print("pressure of the refused / p_ref, quartiles:", np.percentile(pressure, [0, 25, 50, 75, 100]))


def limits(material: Any, rule: Directions, cases: Cases, response: Any) -> None:
    """Print how near the points refused with `FABRIC_LIMIT` come to the end of the contact density E(n) = 1 + F:nn.

    The greatest part of the increment that is answered is found by bisection, and the least E(n) of the rule there.
    """
    at = response.status == status.FABRIC_LIMIT
    if not at.any():
        return
    old, increment = type(cases.state)(*(array[at] for array in cases.state)), cases.increment[at]
    answered, refused = np.zeros(len(increment)), np.ones(len(increment))
    for _ in range(30):
        part = 0.5 * (answered + refused)
        fine = umat.update(material, rule, increment * part[:, None], old).status == status.OK
        answered, refused = np.where(fine, part, answered), np.where(fine, refused, part)
    end = umat.update(material, rule, increment * answered[:, None], old).state

    def least(fabric: np.ndarray) -> np.ndarray:
        return 1.0 + np.einsum("ai,pij,aj->pa", rule.normals, mandel.to_tensor(fabric), rule.normals).min(axis=1)

    for name, values in (("part answered", answered), ("least E(n) before", least(old.fabric)),
                         ("and there", least(end.fabric))):  # fmt: skip
        print(f"FABRIC_LIMIT, {name}: median {np.median(values):.2g}, most {values.max():.2g}")


def run(law: str, localisation: str, units: str, cases: int, seed: int, rule: Directions) -> None:
    """Run and print one table."""
    material = toyoura(*UNITS[units])._replace(law=LAWS[law](), localisation=localisation)
    chosen = random_cases(material, rule, cases, seed)
    begin = time.perf_counter()
    response = umat.update(material, rule, chosen.increment, chosen.state)
    seconds = time.perf_counter() - begin
    finite = all(np.isfinite(a).all() for a in (response.stress, response.tangent, *response.state))
    print(f"\n{law}, {localisation}, {units}, {rule.name}: {cases} cases, {seconds:.1f} s, "
          f"{'no' if finite else 'SOME'} number that is not finite")  # fmt: skip
    table(material, rule, chosen, response)
    limits(material, rule, chosen, response)


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200_000)
    parser.add_argument("--law", choices=[*LAWS, "all"], default="zhao_kruyt")
    parser.add_argument("--localisation", choices=["total", "rate", "both"], default="total")
    parser.add_argument("--units", choices=UNITS, default="kPa")
    parser.add_argument("--directions", default="bazant_oh_37")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    for law in LAWS if asked.law == "all" else [asked.law]:
        for localisation in ("total", "rate") if asked.localisation == "both" else [asked.localisation]:
            run(law, localisation, asked.units, asked.cases, asked.seed, directions(asked.directions))


if __name__ == "__main__":
    main()
