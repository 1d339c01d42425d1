"""Extremes of a Chang–Hicher point: pressure, density, fabric, increments, directions, units, liquefaction.

Toyoura sand is sheared at constant volume by Δε = (½, 0, −½) times an amount. The reference is the same path in many
more increments, or with many more directions; a refused increment is a refusal. q and p of a state are the point's.
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

import umat
from fabfem.extremes.sweep import Extreme, Found, sweep
from umat import mandel, status
from umat.directions import directions
from umat.sands import TOYOURA_FABRIC_NORM, toyoura

SHEAR = np.array([-0.5, 0.0, 0.5, 0.0, 0.0, 0.0])
"""Strain of an amount ε1 − ε3 = 1, the major one along the deposition axis."""
DEPOSIT = np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / 6.0**0.5
RULE = "bazant_oh_37"
LIMIT = 6.0**0.5
"""‖F‖ of a deposit at which E(n) = 1 + F:nn falls to zero across the deposition axis."""


def extremes() -> Iterator[Extreme]:
    """Yield the sweeps."""
    steps = (1e4, 1e3, 100.0, 20.0, 5.0, 1.0)
    yield sweep("undrained shear of 5 %: q", "increments, 10⁴ the reference", steps, increments, 0.02, 20.0, True)
    pressures = (1e3, 100.0, 10.0, 1.0, 0.1, 0.05, 0.03, 0.02, 0.015, 0.01, 1e-3, 1e-6, 1e-10)
    yield sweep("undrained shear of 1 %, 100 increments: q", "p0 [kPa]", pressures, _pressed, 0.02, 1.0)
    loose = (0.8, 0.9, 0.934, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.65, 1.66)
    yield sweep("undrained shear of 1 %, 100 increments: q", "e, loose", loose, _dense, 0.02, 1.1)
    dense = (0.8, 0.7, 0.6, 0.58, 0.5, 0.4, 0.3, 0.2, 0.1, 0.01)
    yield sweep("undrained shear of 1 %, 100 increments: q", "e, dense", dense, _dense, 0.02, 0.58)
    shares = (0.0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999, 1.0, 1.01)
    yield sweep("undrained shear of 1 %, 100 increments: q", "‖F‖ / its limit √6", shares, _bedded, 0.02, 0.9)
    yield sweep("undrained shear of 1 %, 100 increments: q", "−‖F‖ / its limit", shares, _crossed, 0.02, 0.5)
    yield sweep("undrained shear of 5 %: q", "directions", (384, 160, 72, 37, 21), normals, 0.03, 37, True)
    yield sweep("undrained shear of 5 %: q", "stress unit / kPa", (1.0, 1e3, 1e-3), units, 1e-10, 1e-3)
    cycles = (1.0, 5.0, 20.0)
    yield sweep("e = 1.05, ±1 % undrained: least p / p0 > 0", "cycles", cycles, liquefied, 0.0, 20.0)


@cache
def sheared(
    amount: float,
    count: int,
    p: float = 100.0,
    e: float = 0.833,
    fabric: float = TOYOURA_FABRIC_NORM,
    rule: str = RULE,
    newtons: float = 1e3,
) -> tuple[float | None, str]:
    """Return q after a shear in equal increments, or None and why an increment was refused."""
    state: Any
    sand, normals = toyoura(newtons), directions(rule)
    state = umat.initial_state(sand, normals, p * mandel.IDENTITY[None], void_ratio=e, fabric=fabric * DEPOSIT)
    for number in range(count):
        response = umat.update(sand, normals, amount / count * SHEAR[None], state)
        if response.status[0] != status.OK:
            return None, f"{status.message(response.status[0])} after {100.0 * number * amount / count:.3g} % of shear"
        state = response.state
    return float(mandel.q(state.stress)[0]), ""


def increments(count: float) -> Found:
    """Return q in `count` increments, over that in 10⁴."""
    return _over(sheared(0.05, int(count)), sheared(0.05, 10_000))


def normals(count: float) -> Found:
    """Return q with a set of `count` directions, over that with 384."""
    rules = {384: "gauss_24x32", 160: "gauss_16x20", 72: "gauss_12x12", 37: "bazant_oh_37", 21: "bazant_oh_21"}
    return _over(sheared(0.05, 100, rule=rules[int(count)]), sheared(0.05, 100, rule="gauss_24x32"))


def units(scale: float) -> Found:
    """Return q in units of `scale` kPa over that in kPa."""
    q, reason = sheared(0.05, 100, p=100.0 / scale, newtons=1e3 * scale)
    return _over((None if q is None else q * scale, reason), sheared(0.05, 100))


def liquefied(cycles: float) -> Found:
    """Return 1 if p stays positive and finite through cycles of shear of very loose sand, whose p falls to nothing."""
    sand, rule = toyoura(), directions(RULE)
    state = umat.initial_state(sand, rule, 100.0 * mandel.IDENTITY[None], void_ratio=1.05, fabric=0.0 * DEPOSIT)
    least = np.inf
    for number in range(int(cycles) * 40):
        sign = 1.0 if number % 40 in (*range(10), *range(30, 40)) else -1.0
        response = umat.update(sand, rule, sign * 0.001 * SHEAR[None], state)
        if response.status[0] != status.OK:
            return Found(None, 1.0, f"{status.message(response.status[0])} in cycle {number // 40 + 1}")
        state = response.state
        least = min(least, float(mandel.p(state.stress)[0]))
    return Found(float(least > 0.0), 1.0)


def _pressed(p: float) -> Found:
    return _refined(p=p)


def _dense(e: float) -> Found:
    return _refined(e=e)


def _bedded(share: float) -> Found:
    return _refined(fabric=share * LIMIT)


def _crossed(share: float) -> Found:
    return _refined(fabric=-0.5 * share * LIMIT)


def _refined(**start: float) -> Found:
    """Return q in 100 increments over that in 400."""
    return _over(sheared(0.01, 100, **start), sheared(0.01, 400, **start))


def _over(ours: tuple[float | None, str], reference: tuple[float | None, str]) -> Found:
    reason = ours[1] or (f"reference: {reference[1]}" if reference[1] else "")
    return Found(None if reason else ours[0], reference[0] if reference[0] is not None else np.nan, reason)
