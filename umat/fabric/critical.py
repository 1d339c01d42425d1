"""The critical state that a law names: q/p and √(3/2) ‖F‖ over the Lode angle of stress [ZK 7, 8; Y 3.1, 4].

Only `zhao_kruyt` and `yuan` say both. θ is 0 in triaxial compression and 60° in extension, F along s; for
F along s the angles θ_F and θ_σ are one.
"""

from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..mandel import Array
from .yuan import Yuan, shape, shapes
from .zhao_kruyt import ZhaoKruyt

ROOT = 1.5**0.5


@singledispatch
def critical_state(law: Any, lode: ArrayLike) -> tuple[Array, Array]:
    """Return critical q/p and √(3/2) ‖F‖ at Lode angles [deg]; ValueError if the law names no critical state."""
    raise ValueError("names no critical q/p and ‖F‖ over the Lode angle; zhao_kruyt and yuan do")


@critical_state.register
def _(law: ZhaoKruyt, lode: ArrayLike) -> tuple[Array, Array]:
    """M = M_c g_s and F_c = F_c0 / g_s [ZK 2, 7, 8]."""
    c = law.extension
    g = 2.0 * c / ((1.0 + c) - (1.0 - c) * np.cos(3.0 * np.radians(lode)))
    return law.critical_ratio * g, ROOT * law.critical_fabric / g


@critical_state.register
def _(law: Yuan, lode: ArrayLike) -> tuple[Array, Array]:
    """M = M_cc h1 and M_F = M_Fc h2 [Y 3.1, 4]."""
    sine = -np.cos(3.0 * np.radians(np.asarray(lode, float)))
    l1, l2, _ = shapes(law)
    return law.critical_ratio * shape(l1, sine), law.critical_fabric * shape(l2, sine)
