"""What is said about a case that can be run but is odd."""

from pathlib import Path

import pytest

from fabfem.case import case_from, read_tables
from fabfem.cli import main
from fabfem.commands.status import DONE
from fabfem.remarks import remarks
from fabfem.study.variants import with_value

CASE = Path(__file__).parents[2] / "cases" / "element" / "drained_triaxial.toml"


@pytest.mark.parametrize(
    ("void_ratio", "said"),
    [(0.59, "0.59 is denser than the densest"), (0.598, ""), (0.977, ""), (0.98, "0.98 is looser than the loosest")],
)
def test_a_packing_that_a_sand_does_not_have_is_remarked_on(void_ratio: float, said: str) -> None:
    case = case_from(with_value(read_tables(CASE), "material.sand.void_ratio", void_ratio), CASE)
    found = list(remarks(case))
    assert [said in remark for remark in found] == ([True] if said else [])


def test_the_terminal_shows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "case.toml"
    path.write_text(CASE.read_text(encoding="utf-8").replace("void_ratio = ", "void_ratio = 0.5 # "), encoding="utf-8")
    assert main(["check", str(path)]) == DONE
    assert "# remark: material.sand.void_ratio: 0.5 is denser" in capsys.readouterr().out
    assert main(["solve", str(path), "--out", str(tmp_path / "out")]) == DONE
    assert "\nremark: material.sand.void_ratio: 0.5 is denser" in capsys.readouterr().out
