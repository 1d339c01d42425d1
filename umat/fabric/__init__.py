"""Fabric evolution laws, one file each; a new file here is a new law (see `law`).

The laws of `probe_2d` are of the plane and stay outside the stress point; they run along given histories
(`umat.fabric_history`) like all others.
"""

from typing import Any

from .constant import Constant
from .law import fabric_increment, known_laws
from .li_dafalias import LiDafalias
from .nemat_nasser import NematNasser
from .petalas import Petalas
from .probe_2d import PLANAR_LAWS, Probe2D, Probe2DByAnisotropy, UniformStrain2D
from .sun_sundaresan import SunSundaresan
from .tian_yao import TianYao
from .uniform_strain import UniformStrain
from .wan_guo import WanGuo
from .woo_salgado import WooSalgado
from .yang import Yang
from .yuan import Yuan
from .zhao_kruyt import ZhaoKruyt

__all__ = [
    "LAWS",
    "PLANAR_LAWS",
    "Constant",
    "LiDafalias",
    "NematNasser",
    "Petalas",
    "Probe2D",
    "Probe2DByAnisotropy",
    "SunSundaresan",
    "TianYao",
    "UniformStrain",
    "UniformStrain2D",
    "WanGuo",
    "WooSalgado",
    "Yang",
    "Yuan",
    "ZhaoKruyt",
    "fabric_increment",
    "known_laws",
    "law_named",
]

#: record of each law by the name that a case uses, the name of its file
LAWS: dict[str, type[Any]] = {record.__module__.rpartition(".")[2]: record for record in known_laws()}


def law_named(name: str) -> type[Any]:
    """Return the record of a law; ValueError names the laws there are."""
    if name not in LAWS:
        raise ValueError(f"there is no fabric law {name!r}; there are {', '.join(sorted(LAWS))}")
    return LAWS[name]
