"""Malformed case files: a short run of `tests/benchmarks/fuzz_cases.py`, and what its long runs have found."""

import importlib.util
import sys
from collections import Counter
from pathlib import Path

import pytest

from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("fuzz_cases", ROOT / "tests" / "benchmarks" / "fuzz_cases.py")
assert SPEC is not None
assert SPEC.loader is not None
fuzz_cases = importlib.util.module_from_spec(SPEC)
sys.modules["fuzz_cases"] = fuzz_cases
SPEC.loader.exec_module(fuzz_cases)


def test_mutants_are_refused_or_are_cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz_cases, "PATIENCE", 600)  # the first may compile the material
    found = [(file.name, judged) for file, _, judged in fuzz_cases.fuzz(tmp_path, 150, seed=3)]
    assert [(name, judged.what) for name, judged in found if judged.verdict in ("fault", "long")] == []
    verdicts = Counter(judged.verdict for _, judged in found)
    assert verdicts["refused"] > 100
    assert verdicts["accepted, other"] > 5


FOUND = {
    "a list for the kind": ('kind = "boundary_value"', 'kind = ["boundary_value"]'),
    "a table for the kind": ('kind = "boundary_value"', "kind = { a = 1 }"),
}


@pytest.mark.parametrize("name", FOUND)
def test_what_the_fuzz_has_found(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old, new = FOUND[name]
    text = (folder / "case.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / "case.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    assert main(["check", str(folder / "case.toml")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.startswith("fabfem: case.toml: ")
    assert said.count("\n") == 1
