"""The critical state that a law names, drawn over the Lode angle: [ZK Fig 2], [Y Figs 2, 3]."""

from collections.abc import Iterator

import numpy as np

from fabfem.case import FabricCase
from fabfem.case import fabric as said
from fabfem.fabric_tests.curves import Curve, curves
from fabfem.fabric_tests.drives import Block, Measured, Value, blamed
from umat.fabric.critical import critical_state

HEADERS = ("law", "lode [degree]", "b [-]", "M [-]", "F_qc [-]", "M/M_c [-]", "F_qc/F_qcc [-]", "M F_qc [-]")


def measure(drive: said.Surface, case: FabricCase) -> Measured:
    """Return the table of all laws over all Lode angles."""
    laws = curves(case)
    for curve in laws:
        with blamed(case, f"law.{curve.name}"):
            critical_state(curve.law, 0.0)
    remains = (("laws", str(len(laws))), ("angles", str(drive.angles)))
    return Measured(HEADERS, _blocks(drive, laws), len(laws), remains)


def _blocks(drive: said.Surface, laws: tuple[Curve, ...]) -> Iterator[Block]:
    lode = np.linspace(0.0, 60.0, drive.angles)
    # s_i ∝ cos(θ − 0, 120, 240°): b = (s_2 − s_3)/(s_1 − s_3)
    major, middle, minor = (np.cos(np.radians(lode - turn)) for turn in (0.0, 120.0, 240.0))
    b = (middle - minor) / (major - minor)
    for curve in laws:
        ratio, fabric = critical_state(curve.law, lode)
        columns = (lode, b, ratio, fabric, ratio / ratio[0], fabric / fabric[0], ratio * fabric)
        rows: list[tuple[Value, ...]] = [
            (curve.name, *(float(value) for value in row)) for row in zip(*columns, strict=True)
        ]
        product = ratio * fabric
        summary = {
            "law": curve.name,
            "M_compression": float(ratio[0]),
            "M_extension": float(ratio[-1]),
            "F_compression": float(fabric[0]),
            "F_extension": float(fabric[-1]),
            "spread_of_M_F": float((product.max() - product.min()) / product.mean()),
        }
        yield Block(rows, summary)
