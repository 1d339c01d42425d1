"""Places in a case, and the variants that other values there make."""

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabfem.case import CaseError
from fabfem.case.study import Parameter
from fabfem.study.variants import Setting, choices, one_at_a_time, variant, with_value

TABLES: dict[str, Any] = {
    "title": "t",
    "mesh": {"file": "a.msh"},
    "support": [{"boundary": "b", "fix": ["x"]}, {"boundary": "c", "fix": ["y"]}],
    "stage": [{"name": "rest"}, {"name": "push", "increments": {"maximum": 0.1}}],
    "study": {"knob": []},
    "sweep": {},
}

PLACES = {
    "key": ("title", "u", lambda t: t["title"]),
    "table": ("mesh.file", "b.msh", lambda t: t["mesh"]["file"]),
    "table that is not there": ("solver.tolerance", 1e-3, lambda t: t["solver"]["tolerance"]),
    "entry by name": ("stage[push].increments.maximum", 0.5, lambda t: t["stage"][1]["increments"]["maximum"]),
    "entry by number": ("support[2].fix", ("x", "y"), lambda t: t["support"][1]["fix"]),
    "table below an entry": ("stage[rest].increments.initial", 0.5, lambda t: t["stage"][0]["increments"]["initial"]),
}

NO_PLACES = {
    "entry of another name": ("stage[pusch].k0", "there is no entry 'pusch'; did you mean 'push'?"),
    "entry beyond the list": ("support[3].fix", "there is no entry '3'"),
    "entry of a table": ("mesh[1].file", "there is no entry '1'"),
    "below a value": ("title.length", "no table that could hold 'length'"),
    "empty": ("", "is no place in a case"),
    "two dots": ("a..b", "is no place in a case"),
}


@pytest.mark.parametrize("name", PLACES)
def test_a_value_is_put_at_a_place_and_nothing_else_changes(name: str) -> None:
    place, value, look = PLACES[name]
    before = repr(TABLES)
    changed = with_value(TABLES, place, value)
    assert look(changed) == (list(value) if isinstance(value, tuple) else value)
    assert repr(TABLES) == before
    assert changed.keys() - {"solver"} == TABLES.keys()


@pytest.mark.parametrize("name", NO_PLACES)
def test_a_place_that_is_not_there_gets_a_sentence(name: str) -> None:
    place, said = NO_PLACES[name]
    with pytest.raises(CaseError, match=re.escape(said)):
        with_value(TABLES, place, 1)


def test_a_variant_says_nothing_about_other_runs() -> None:
    settings = [Setting("size", ("mesh.size", "mesh.coarse"), 2.0, (("mesh.order", 1),))]
    assert variant(TABLES, settings)["mesh"] == {"file": "a.msh", "size": 2.0, "coarse": 2.0, "order": 1}
    assert variant(TABLES, settings).keys().isdisjoint({"study", "sweep"})


@given(st.lists(st.lists(st.integers(), min_size=1, max_size=4, unique=True), min_size=1, max_size=3))
def test_a_product_has_every_combination_once(values: list[list[int]]) -> None:
    parameters = [Parameter(name=f"p{i}", at=("a",), values=tuple(some)) for i, some in enumerate(values)]
    found = choices(parameters)
    expected = 1
    for some in values:
        expected *= len(some)
    assert len(set(found)) == len(found) == expected
    assert len(one_at_a_time(parameters)) == 1 + sum(map(len, values))


def test_values_go_along_with_their_own() -> None:
    turned = Parameter(name="angle", at="a.x", values=(1.0, 2.0), along={"a.y": (10.0, 20.0), "b": ("p", "q")})
    made = [variant({"a": {"x": 0.0}}, choice) for choice in choices([turned])]
    assert made == [{"a": {"x": 1.0, "y": 10.0}, "b": "p"}, {"a": {"x": 2.0, "y": 20.0}, "b": "q"}]
    with pytest.raises(ValueError, match=r"has 2 values, but 1 along with them for a\.y"):
        Parameter(name="angle", at="a.x", values=(1.0, 2.0), along={"a.y": (10.0,)})


def test_equal_values_are_told_apart_by_what_goes_along() -> None:
    tests = Parameter(name="test", at="a.x", values=(1.0, 1.0, 2.0), along={"a.y": (10.0, 20.0, 10.0)})
    made = choices([tests])
    assert [setting.value for (setting,) in made] == ["1.0 10.0", "1.0 20.0", "2.0 10.0"]
    assert [variant({}, choice)["a"] for choice in made] == [{"x": 1.0, "y": y} for y in (10.0, 20.0)] + [
        {"x": 2.0, "y": 10.0}
    ]
    named = Parameter(name="test", at=("a.x", "b"), values=(1.0, 1.0), along={"c": (1, 2)}, labels=("p", "q"))
    assert [setting.value for (setting,) in choices([named])] == ["p", "q"]
    assert variant({}, choices([named])[1]) == {"a": {"x": 1.0}, "b": 1.0, "c": 2}
