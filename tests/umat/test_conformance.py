"""Every fault that a routine may have is found and named, and a good routine has none."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.umat.compiled import compiled
from umat.conformance import examined
from umat.external import External

STRESS = np.array([100.0, 100.0, 100.0, 0.0, 0.0, 0.0])
FAULTS = {
    1: ("bad", "changes its inputs: DSTRAN"),
    2: ("bad", "writes beyond the end of STRESS"),
    3: ("bad", "keeps a state of its own"),
    4: ("note", "leaves DDSDDE at zero"),
    5: ("bad", "DDSDDE is not the derivative"),
    6: ("note", "are refused"),
    7: ("bad", "not finite"),
    8: ("bad", "ended the process .exit code 7. while looking for changed inputs"),
    9: ("note", "does not turn with the strain"),
    10: ("note", "does not turn with the strain"),
    11: ("bad", "depends on TIME or DTIME"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("routines")


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(folder: Path, fault: int) -> None:
    findings = examined(External(compiled("faulty.c", folder), (float(fault),)), STRESS)
    verdict, part = FAULTS[fault]
    assert any(each.verdict == verdict and re.search(part, each.sentence) for each in findings), findings


@pytest.mark.parametrize(
    ("name", "properties", "notes"),
    [("elastic.f", (1e4, 0.3), 0), ("mohr_coulomb.c", (1e4, 0.3, 5.0, 30.0, 10.0), 1), ("faulty.c", (0.0,), 0)],
)
def test_good_routines_are_found_good(folder: Path, name: str, properties: tuple[float, ...], notes: int) -> None:
    """The one note on Mohr–Coulomb is that it refuses plane stress."""
    findings = examined(External(compiled(name, folder), properties, 1), STRESS, 1e-3)
    assert not [each for each in findings if each.verdict == "bad"]
    assert len([each for each in findings if each.verdict == "note"]) == notes, findings
    assert len(findings) >= 10
