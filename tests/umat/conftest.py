"""Chang–Hicher points for the tests: the table of materials, and the regimes in which each of them is looked at."""

from typing import Any, NamedTuple

import numpy as np
import pytest

import umat
from umat import mandel
from umat.chang_hicher import ChangHicher, ChangHicherState
from umat.directions import Directions, directions
from umat.fabric import Constant, LiDafalias, ZhaoKruyt
from umat.lanes import COMPILED
from umat.sands import toyoura

#: the law with a derivative of its own, the one that does not evolve, and one that is derived by complex steps
LAWS = {"zhao_kruyt": ZhaoKruyt(), "constant": Constant(), "li_dafalias": LiDafalias()}
MATERIALS = {
    f"{localisation} {name}": toyoura()._replace(law=law, localisation=localisation)
    for name, law in LAWS.items()
    for localisation in ("total", "rate")
}
if not COMPILED:  # the same kernels as a numpy program, 500 times slower: each localisation, each kind of derivative
    MATERIALS = {name: MATERIALS[name] for name in ("total zhao_kruyt", "rate li_dafalias")}
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


@pytest.fixture(scope="session")
def rule() -> Directions:
    return directions("bazant_oh_37" if COMPILED else "bazant_oh_21")


@pytest.fixture(scope="session")
def isotropic_start(rule):
    """A function that returns `n` points at p [kPa] under isotropic stress."""

    def start(
        material: ChangHicher, n: int = 1, p: float = 100.0, void_ratio: float = 0.8, fabric: Any = FABRIC
    ) -> Any:
        stress = np.repeat(p * mandel.IDENTITY[None], n, axis=0)
        return umat.initial_state(material, rule, stress, void_ratio=void_ratio, fabric=fabric)

    return start


@pytest.fixture(scope="session", params=MATERIALS)
def material(request) -> ChangHicher:
    return MATERIALS[request.param]


@pytest.fixture(scope="session")
def regimes(material, rule) -> Regimes:
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
