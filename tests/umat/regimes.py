"""States and increments at which the tangent of every material is looked at, and how good it is there."""

from typing import Any, NamedTuple

import numpy as np

import umat
from umat import mandel
from umat.chang_hicher import ChangHicher, ChangHicherState
from umat.directions import Directions
from umat.lanes import COMPILED

#: deposited along y, ‖F‖ = 0.2
FABRIC = 0.2 * mandel.deviator([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]) * 1.5**0.5
#: what a regime starts from: void ratio, and six equal strain increments before
STARTS = {
    "virgin": (0.8, np.zeros(6)),
    "sheared": (0.8, 1e-3 * np.array([-0.5, 1.0, -0.5, 0.1, 0.0, 0.2])),
    "softened": (0.78, 1e-2 * np.array([-0.8, 1.0, -0.8, 0.0, 0.05, 0.1])),
}
#: start and strain increment
REGIMES = {
    "sliding": ("virgin", 1e-4 * np.array([-0.3, 1.0, -0.4, 0.2, 0.1, 0.3])),
    "elastic": ("sheared", -1e-5 * np.array([-0.5, 1.0, -0.5, 0.1, 0.0, 0.2])),
    "unloading": ("sheared", -1e-3 * np.array([-0.5, 1.0, -0.5, 0.1, 0.0, 0.2])),
    "reversed": ("sheared", -5e-3 * np.array([-0.5, 1.0, -0.5, 0.1, 0.0, 0.2])),
    "mixed": ("sheared", 2e-4 * np.array([0.3, 0.5, -0.2, -0.8, 0.4, -0.6])),
    "softening": ("softened", 5e-4 * np.array([-0.8, 1.0, -0.8, 0.0, 0.05, 0.1])),
    "sub-stepped sliding": ("virgin", 3e-3 * np.array([-0.3, 1.0, -0.4, 0.2, 0.1, 0.3])),
    "sub-stepped mixed": ("sheared", 4e-3 * np.array([0.3, 0.5, -0.2, -0.8, 0.4, -0.6])),
}
if not COMPILED:
    REGIMES = {name: REGIMES[name] for name in ("sliding", "elastic", "unloading", "mixed", "sub-stepped sliding")}
    del STARTS["softened"]


class Regimes(NamedTuple):
    """One point for each row of `REGIMES`."""

    names: list[str]
    material: ChangHicher
    directions: Directions
    state: ChangHicherState
    increment: np.ndarray
    largest: np.ndarray
    """Largest step of a derivative, relative to the increment: no contact begins or ceases to slide within it."""

    def updated(self, increment: Any = None) -> Any:
        """Return the response of the points."""
        chosen = self.increment if increment is None else increment
        return umat.update(self.material, self.directions, chosen, self.state)

    def repeated(self, times: int) -> ChangHicherState:
        """Return the state with each point `times` times in a row."""
        return ChangHicherState(*(np.repeat(array, times, axis=0) for array in self.state))


def regimes_of(material: ChangHicher, rule: Directions) -> Regimes:
    """Return the points of a material."""
    void_ratio, before = (np.array(column) for column in zip(*STARTS.values(), strict=True))
    stress = np.repeat(100.0 * mandel.IDENTITY[None], len(STARTS), axis=0)
    state = umat.initial_state(material, rule, stress, void_ratio=void_ratio, fabric=FABRIC)
    for _ in range(6):
        response = umat.update(material, rule, before, state)
        assert not response.status.any()
        state = response.state
    places = [list(STARTS).index(start) for start, _ in REGIMES.values()]
    state = ChangHicherState(*(array[places] for array in state))
    increment = np.array([increment for _, increment in REGIMES.values()])
    largest = np.where(np.array(list(REGIMES)) == "elastic", 0.05, 2e-4)
    return Regimes(list(REGIMES), material, rule, state, increment, largest)


DIRECTION = np.array([0.5, -0.3, 0.4, 0.3, -0.5, 0.4])
DIRECTION /= np.linalg.norm(DIRECTION)


def taylor_orders(regimes: Regimes, span: float = 2e-3) -> np.ndarray:
    """Return the order of the remainder σ(Δε + h d) − σ(Δε) − h D d in h, a slope over five halvings, of each point.

    The largest h is the part `span` of the increment.
    """
    base, n = regimes.updated(), len(regimes.names)
    ratio = 2.0 ** -np.arange(5)
    # well above the residual, 1e-5 of the increment at most, at which the tangent is taken
    sizes = np.outer(np.maximum(regimes.largest, span) * mandel.norm(regimes.increment), ratio)
    trial = regimes.increment[:, None] + sizes[..., None] * DIRECTION
    response = umat.update(regimes.material, regimes.directions, trial.reshape(-1, 6), regimes.repeated(len(ratio)))
    assert not response.status.any()
    change = response.stress.reshape(n, -1, 6) - base.stress[:, None]
    remainder = mandel.norm(change - sizes[..., None] * (base.tangent @ DIRECTION)[:, None])
    assert (remainder[:, 0] > 0.0).all()
    return np.polyfit(np.log(ratio), np.log(remainder).T, 1)[0]


def difference_errors(regimes: Regimes) -> np.ndarray:
    """Return the largest difference of the tangent from central differences over its largest entry, of each point."""
    n = len(regimes.names)
    step = (0.3 * regimes.largest * mandel.norm(regimes.increment))[:, None, None]
    shift = step * np.concatenate([np.eye(6), -np.eye(6)])
    trial = (regimes.increment[:, None] + shift).reshape(-1, 6)
    stress = umat.update(regimes.material, regimes.directions, trial, regimes.repeated(12)).stress.reshape(n, 12, 6)
    difference = np.swapaxes(stress[:, :6] - stress[:, 6:], 1, 2) / (2.0 * step)
    tangent = regimes.updated().tangent
    size = np.abs(tangent).max(axis=(1, 2), keepdims=True)
    return np.abs((tangent - difference) / size).max(axis=(1, 2))
