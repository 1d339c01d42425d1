"""A run that is killed and resumed leaves what one that was not leaves, to the last bit; another run is not resumed."""

import json
import random
from pathlib import Path
from typing import Any

import pytest
from restart_kills import content, killed
from restart_scenes import CYCLES, ELASTIC, ELEMENTS, GROUND, MOHR, ROUTINE, SCENES, pushed, scene

from fabfem.case import CaseError, read_case
from fabfem.case.toml import write_toml
from fabfem.cli import main
from fabfem.output.checkpoints import PATTERN, newest
from fabfem.restart import Restart
from fabfem.run import run_case
from tests.umat.compiled import compiled


def written(folder: Path, tables: dict[str, Any], name: str = "case.toml") -> Path:
    path = folder / name
    path.write_text(write_toml(tables), encoding="utf-8")
    if tables["material"] == {"soil": ROUTINE}:
        compiled("mohr_coulomb.c", folder)
    return path


@pytest.mark.parametrize("name", SCENES)
def test_killed_and_resumed_to_the_last_bit(name: str, tmp_path: Path) -> None:
    case = written(tmp_path, SCENES[name])
    whole = run_case(case, tmp_path / "whole", quiet=True)
    assert whole.status == "completed", whole.reason
    chance = random.Random(name)
    killed(case, tmp_path / "torn", chance.randrange(1, max(whole.increments - 1, 2)), chance)
    outcome = run_case(case, tmp_path / "torn", quiet=True, restart=Restart(resume=True))
    assert (outcome.status, outcome.increments) == ("completed", whole.increments)
    assert content(tmp_path / "torn") == content(tmp_path / "whole")


def test_killed_again_and_again(tmp_path: Path) -> None:
    """Each life of the run is killed some increments further on, the last one not."""
    case = written(tmp_path, SCENES["consolidation"])
    whole = run_case(case, tmp_path / "whole", quiet=True)
    chance, lives = random.Random(2), 0
    for row in (4, 13, 21, 34):
        lives += killed(case, tmp_path / "torn", row, chance, "--resume")
    assert lives >= 2, "the run was over before it could be killed"
    assert run_case(case, tmp_path / "torn", quiet=True, restart=Restart(resume=True)).status == "completed"
    assert whole.increments == len(rows_of(tmp_path / "torn"))
    assert content(tmp_path / "torn") == content(tmp_path / "whole")


@pytest.mark.parametrize("name", SCENES)
def test_every_checkpoint_of_a_run_leads_to_its_end(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All checkpoints are kept, and the run resumed from every third."""
    monkeypatch.setattr("fabfem.output.checkpoints.KEPT", 10**6)
    case = written(tmp_path, SCENES[name])
    run_case(case, tmp_path / "out", quiet=True)
    whole = content(tmp_path / "out")
    for file in sorted((tmp_path / "out").glob(PATTERN), reverse=True)[::3]:
        for later in (tmp_path / "out").glob(PATTERN):
            if later.name > file.name:
                later.unlink()
        run_case(case, tmp_path / "out", quiet=True, restart=Restart(resume=True))
        assert content(tmp_path / "out") == whole, file.name


@pytest.mark.parametrize("name", ELEMENTS)
def test_a_killed_element_test_goes_on_from_its_last_stage(name: str, tmp_path: Path) -> None:
    case = written(tmp_path, ELEMENTS[name])
    whole = run_case(case, tmp_path / "whole", quiet=True)
    assert whole.status == "completed", whole.reason
    chance = random.Random(name)
    killed(case, tmp_path / "torn", chance.randrange(12, 28), chance)
    outcome = run_case(case, tmp_path / "torn", quiet=True, restart=Restart(resume=True))
    assert (outcome.status, outcome.increments) == ("completed", whole.increments)
    assert content(tmp_path / "torn") == content(tmp_path / "whole")
    run_case(case, tmp_path / "torn", quiet=True, restart=Restart(resume=True))
    assert content(tmp_path / "torn") == content(tmp_path / "whole")
    further = ELEMENTS[name] | {"stage": [*ELEMENTS[name]["stage"], CYCLES | {"name": "further"}]}
    branch = Restart(branch=tmp_path / "whole")
    outcome = run_case(written(tmp_path, further, "further.toml"), tmp_path / "branch", quiet=True, restart=branch)
    assert outcome.status == "completed"
    assert {line.split(",")[0] for line in rows_of(tmp_path / "branch")} == {"further"}


def test_a_killed_run_of_fabric_laws_is_run_again(tmp_path: Path) -> None:
    case = Path(__file__).parents[3] / "cases" / "fabric" / "yuan_13_creation.toml"
    run_case(case, tmp_path / "whole", quiet=True)
    killed(case, tmp_path / "torn", 5, random.Random(1))
    run_case(case, tmp_path / "torn", quiet=True, restart=Restart(resume=True))
    assert content(tmp_path / "torn") == content(tmp_path / "whole")


def rows_of(folder: Path) -> list[str]:
    return (folder / "history.csv").read_text().splitlines()[1:]


@pytest.fixture
def torn(tmp_path: Path) -> Path:
    """A folder with ``case.toml`` and an unfinished result in ``out``: increments beyond 4 are lost."""
    case = written(tmp_path, SCENES["mohr_coulomb"])
    run_case(case, tmp_path / "out", quiet=True)
    for file in sorted((tmp_path / "out").glob(PATTERN))[1:]:
        file.unlink()
    return tmp_path


COARSE = {"mesh": {"box": {"cells": [2, 2], "lower": [0.0, -1.0], "upper": [1.5, 0.0]}}}
CHANGES = {
    "material": (scene(MOHR | {"cohesion": 3.0}, pushed()), "material.soil.cohesion was 2.0 and is 3.0"),
    "stage": (scene(MOHR, pushed(0.03)), "stage[push].displacement[1].y was -0.02 and is -0.03"),
    "mesh": (scene(MOHR, pushed()) | COARSE, "mesh"),
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_changed_case_is_refused_with_the_difference_named(
    what: str, torn: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tables, sentence = CHANGES[what]
    before = content(torn / "out")
    assert main(["solve", str(written(torn, tables)), "--out", str(torn / "out"), "--resume", "--quiet"]) == 2
    assert sentence in capsys.readouterr().err
    assert content(torn / "out") == before


def test_a_changed_version_is_refused(torn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fabfem.identity.versions", lambda: {"fabfem": "9.9"})
    with pytest.raises(CaseError, match=r"version.fabfem was \".*\" and is \"9.9\""):
        run_case(torn / "case.toml", torn / "out", quiet=True, restart=Restart(resume=True))


def test_what_changes_no_number_is_no_difference(torn: Path) -> None:
    tables = SCENES["mohr_coulomb"] | {"title": "another title", "checkpoint": {"seconds": 1.0}}
    outcome = run_case(written(torn, tables), torn / "out", quiet=True, restart=Restart(resume=True))
    assert outcome.status == "completed"


def test_a_branch_is_a_new_result_from_the_state(torn: Path) -> None:
    """A branch that changes nothing is the rest of the run; one with more stages goes on from its end."""
    whole = (torn / "out" / "history.csv").read_text().splitlines()
    restart, same = Restart(branch=torn / "out"), torn / "case.toml"
    start = newest(torn / "out")
    assert start is not None
    run_case(same, torn / "rest", quiet=True, restart=restart)
    assert (torn / "rest" / "history.csv").read_text().splitlines() == [whole[0], *whole[1 + start.start.number :]]
    assert json.loads((torn / "rest" / "report.json").read_text())["branch"]["increment"] == start.start.number
    tables = scene(MOHR | {"cohesion": 3.0}, pushed(), pushed(0.01, name="further"))
    outcome = run_case(written(torn, tables, "more.toml"), torn / "more", quiet=True, restart=restart)
    assert outcome.status == "completed"
    last = (torn / "more" / "history.csv").read_text().splitlines()[-1].split(",")
    assert last[0] == "further"


def test_what_a_branch_cannot_be(torn: Path) -> None:
    restart = Restart(branch=torn / "out")
    with pytest.raises(CaseError, match="a folder of its own"):
        run_case(torn / "case.toml", torn / "out", quiet=True, restart=restart)
    with pytest.raises(CaseError, match="unknowns and the mesh has"):
        run_case(written(torn, CHANGES["mesh"][0]), torn / "new", quiet=True, restart=restart)
    with pytest.raises(CaseError, match="stage 2, 'push', and the stages are ground"):
        run_case(written(torn, scene(MOHR) | {"stage": [GROUND]}), torn / "new", quiet=True, restart=restart)
    with pytest.raises(CaseError, match="keeps another state"):
        run_case(written(torn, scene(ELASTIC, pushed())), torn / "new", quiet=True, restart=restart)
    with pytest.raises(CaseError, match="no checkpoint to branch from"):
        run_case(torn / "case.toml", torn / "new", quiet=True, restart=Restart(branch=torn / "nowhere"))


def test_a_damaged_checkpoint_gives_way_to_the_one_before(tmp_path: Path) -> None:
    case = written(tmp_path, SCENES["von_mises"])
    run_case(case, tmp_path / "out", quiet=True)
    whole, files = content(tmp_path / "out"), sorted((tmp_path / "out").glob(PATTERN))
    assert len(files) == 2
    files[1].write_bytes(files[1].read_bytes()[:1000])
    assert run_case(case, tmp_path / "out", quiet=True, restart=Restart(resume=True)).status == "completed"
    assert content(tmp_path / "out") == whole
    for file in sorted((tmp_path / "out").glob(PATTERN)):
        file.write_bytes(b"nonsense")
    with pytest.raises(CaseError, match="no checkpoint can be read"):
        run_case(case, tmp_path / "out", quiet=True, restart=Restart(resume=True))


def test_nothing_to_resume_is_a_run_from_the_beginning(tmp_path: Path) -> None:
    case = written(tmp_path, SCENES["elastic"])
    outcome = run_case(case, tmp_path / "out", quiet=True, restart=Restart(resume=True))
    assert outcome.status == "completed"
    assert read_case(case).checkpoint.increments == 1
