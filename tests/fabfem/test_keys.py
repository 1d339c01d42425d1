"""The keys of a case as people read them."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fabfem.case.keys import Keys, keys
from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE

ROOT = Path(__file__).parents[2]
TABLES = keys()
SHORT_FORMS = {("material.NAME", "umat")}


def test_the_page_is_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "--markdown"]) == DONE
    assert capsys.readouterr().out == (ROOT / "docs" / "keys.md").read_text(encoding="utf-8")


def said(table: dict[str, Any], place: str = "") -> Iterator[tuple[str, str, Any]]:
    """Yield the place, key and value of all that stands in a table."""
    named = place in ("material", "law", "mesh.boundary", "mesh.zone")
    for key, value in table.items():
        below = f"{place}.{'NAME' if named else key}".lstrip(".")
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict):
                yield from said(one, below)
        if not named:
            yield place, key, value


@pytest.mark.parametrize("path", sorted((ROOT / "cases").rglob("*.toml")), ids=lambda path: path.stem)
def test_every_key_of_the_shipped_cases_is_there(path: Path) -> None:
    case = tomllib.loads(path.read_text(encoding="utf-8"))
    here = [table for table in TABLES if case["scene"]["kind"] in table.scenes]
    places = {table.place.strip("[]") for table in here}
    known = {(table.place.strip("[]"), key.name) for table in here for key in table.keys} | SHORT_FORMS
    for place, key, _ in said(case):
        inside = f"{place}.{key}".lstrip(".")
        apart = any(f'{key} = "' in table.kind for table in here if table.place.strip("[]") == place)
        held = any(other == inside or other.startswith(f"{inside}.") for other in places)
        by_name = any((place.rpartition(".")[0], place.rpartition(".")[2]) == at for at in known)  # { NAME = value }
        assert (place, key) in known or held or apart or by_name, f"{place}: {key}"


def one(place: str, kind: str = "") -> Keys:
    """The table at a place."""
    (found,) = [table for table in TABLES if (table.place, table.kind) == (place, kind)]
    return found


def test_what_a_key_may_be_and_is_when_left_out() -> None:
    number, needed, absent, named = (
        next(key for key in one(*at).keys if key.name == name)
        for at, name in (
            (("[material.NAME]", 'model = "elastic"'), "poisson_ratio"),
            (("[material.NAME]", 'model = "elastic"'), "youngs_modulus"),
            (("[water]", ""), "bulk_modulus"),
            (("[material.NAME.fabric]", ""), "parameters"),
        )
    )
    assert (number.value, number.default) == ("number > -1, < 0.5", "0.3")
    assert (needed.value, needed.default) == ("number > 0", "")
    assert (absent.default, named.value) == ("–", "number by name")


def test_what_kinds_share_stands_before_them() -> None:
    shared, *kinds = [table for table in TABLES if table.place == "[material.NAME]"]
    assert "unit_weight" in [key.name for key in shared.keys]
    assert [table.kind for table in kinds][:2] == ['model = "elastic"', 'model = "von_mises"']
    assert all("unit_weight" not in [key.name for key in table.keys] for table in kinds)


def test_a_part_is_shown_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "mesh"]) == DONE
    out = capsys.readouterr().out
    assert "[mesh.box]" in out
    assert "cells : list of whole number ≥ 1\n" in out
    assert "lower : list of number, needed" in out
    assert "[solver]" not in out
    assert main(["keys", "meshh"]) == BAD_INPUT
    assert "did you mean 'mesh'?" in capsys.readouterr().err
