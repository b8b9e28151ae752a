"""Documents that are small as written and large as meant: refused before anything is expanded."""

from __future__ import annotations

import pytest
from scenarios.cases import SMALL, Write, message

ALIASES = "\n".join(["_0: &l0 [1, 1]"] + [f"_{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 9)}]" for i in range(1, 30)])
MERGES = "\n".join(
    ["_0: &m0 {k: 1}"] + [f"_{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 9)}]}}" for i in range(1, 30)]
)
CHAIN = "\n".join(["_0: &c0 {k: 1}"] + [f"_{i}: &c{i} {{<<: *c{i - 1}}}" for i in range(1, 300)])


@pytest.mark.parametrize(
    ("bomb", "said"),
    [
        (ALIASES, "too many values; at most 50000 are allowed, with aliases and merges expanded"),
        (MERGES, "too many values"),
        (CHAIN, "nested too deeply; at most 100 levels are allowed"),
        ("_a: &a [*a]", "nested too deeply"),
        ("_a: &a {<<: *a}", "nested too deeply"),
        ("_a: " + "[" * 200 + "]" * 200, "nested too deeply"),
        ("_a: " + "{a: " * 200 + "1" + "}" * 200, "nested too deeply"),
        ("_a: [" + "1, " * 51_000 + "1]", "too many values"),
        ("_a: &a {}\n_b: {<<: [" + "*a, " * 51_000 + "*a]}", "too many values"),
    ],
)
def test_bombs_are_refused(bomb: str, said: str, write: Write) -> None:
    text = message(write(f"{bomb}\n{SMALL}"))
    assert "bad.yaml:" in text
    assert said in text
