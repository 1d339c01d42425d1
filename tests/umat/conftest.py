"""Chang–Hicher points for the tests: the table of materials, and the regimes in which each of them is looked at."""

from typing import Any

import numpy as np
import pytest

import umat
from tests.umat.regimes import FABRIC, Regimes, regimes_of
from umat import mandel
from umat.chang_hicher import ChangHicher
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
    return regimes_of(material, rule)
