"""How good the tangent of the enhanced CH model is, for every fabric law and both localisations.

`python tests/benchmarks/tangents.py` prints for each the least and the largest order of the Taylor remainder, and the
largest difference from central differences over the largest entry, of eight points: sliding, elastic, unloading,
reversed, mixed, softening, and sliding and mixed in several sub-steps (`tests/umat/regimes.py`).
"""

import sys
from pathlib import Path

import numpy as np

from umat.directions import directions
from umat.fabric import LAWS
from umat.sands import toyoura

sys.path.append(str(Path(__file__).parents[2]))
from tests.umat.regimes import REGIMES, difference_errors, regimes_of, taylor_orders


def main() -> None:
    """Print the table."""
    rule = directions("bazant_oh_37")
    closer: list[str] = []
    print("| law | total: order of the remainder | differences | rate: order | differences |\n|---|---|---|---|---|")
    names, worst = list(REGIMES), {}
    for name, law in LAWS.items():
        cells = []
        for localisation in ("total", "rate"):
            regimes = regimes_of(toyoura()._replace(law=law(), localisation=localisation), rule)
            orders, errors = taylor_orders(regimes), difference_errors(regimes)
            cells += [f"{orders.min():.3f} … {orders.max():.3f}", f"{errors.max():.1e}"]
            near = taylor_orders(regimes, 2e-4)
            outside = np.flatnonzero(abs(orders - 2.0) > 0.05)
            closer += [f"{name}, {localisation}, {names[k]}: {orders[k]:.3f}, {near[k]:.3f}" for k in outside]
            worst[name, localisation] = names[abs(orders - 2.0).argmax()], names[errors.argmax()]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    print("\nFarthest from 2, and largest difference, at:", worst)
    print("Outside 2.00 ± 0.05, and there with a tenth of the changes:", *closer, sep="\n* ")


if __name__ == "__main__":
    main()
