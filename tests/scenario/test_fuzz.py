"""Nothing but ScenarioError, whatever the file."""

import copy
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml
from builders.nested import places
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from scenario.cases import SMALL, SMALL_DATA

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.document import text_of
from airground_drake.scenario.load import load, resolved


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One for all examples: a fixture of its own for each would not be made anew."""
    return tmp_path_factory.mktemp("fuzz")


JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.integers(-3, 3).map(lambda k: k * 10**400),
    st.floats(),
    st.sampled_from([1e308, -1e308, 5e-324, 1e-9, 1e9]),
    st.text(max_size=5),
    st.text(st.characters(categories=["Cs", "Cc", "Zl", "Zp"]), max_size=3),
    st.sampled_from(["5 km", "nan", "a\nb", "<<", "*x", "yes", "2020-01-01", ""]),
    st.just([]),
    st.just({}),
    st.lists(st.floats(), max_size=4),
    st.lists(st.lists(st.floats(-20, 20), min_size=3, max_size=3), max_size=3),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)


def loads_or_explains(path: Path, content: bytes, overrides: Sequence[str] = ()) -> None:
    """Load; an accepted scenario round-trips, a refused one is explained in one line; any other exception passes."""
    path.write_bytes(content)
    refusal = ""
    try:
        scenario = load(str(path), overrides)
    except ScenarioError as error:
        refusal = str(error)
    assert refusal.isprintable()
    if not refusal:
        path.write_text(text_of(resolved(scenario)), encoding="utf-8")
        assert load(str(path)) == scenario


@examples(40, fuzz=3000)
@given(data=st.data())
def test_mutated_data(folder: Path, data: st.DataObject) -> None:
    mutated = copy.deepcopy(SMALL_DATA)
    for _ in range(data.draw(st.integers(1, 2))):
        found = [*places(mutated)]
        (*_, last), node = found[data.draw(st.integers(0, len(found) - 1))] if found else (("name",), mutated)
        action = data.draw(st.sampled_from(["replace", "replace", "drop", "add"]))
        if action == "drop" and found:
            del node[last]
        elif action == "add" and isinstance(node, dict):
            node[data.draw(st.text(max_size=4))] = data.draw(JUNK)
        else:
            node[last] = data.draw(JUNK)
    text = yaml.safe_dump(mutated, sort_keys=False)
    loads_or_explains(folder / "data.yaml", text.encode("utf-8", "surrogatepass"))


@examples(40, fuzz=3000)
@given(data=st.data())
def test_mutated_text(folder: Path, data: st.DataObject) -> None:
    content = SMALL.encode()
    begin = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(begin, min(begin + 30, len(content))))
    inserted = data.draw(st.one_of(st.binary(max_size=6), st.text("{}[]:,&*!|>%@`'\"\\#-? \t\n0a<.~", max_size=6)))
    new = inserted if isinstance(inserted, bytes) else inserted.encode()
    loads_or_explains(folder / "text.yaml", content[:begin] + new + content[end:])


@examples(40)
@given(
    key=st.one_of(st.sampled_from([".".join(map(str, path)) for path, _ in places(SMALL_DATA)]), st.text()),
    value=st.one_of(JUNK.map(str), st.text(max_size=8)),
)
def test_random_overrides(folder: Path, key: str, value: str) -> None:
    loads_or_explains(folder / "overridden.yaml", SMALL.encode(), [f"{key}={value}"])
