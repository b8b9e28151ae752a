"""How many examples a property gets."""

from typing import Any

from hypothesis import settings


def examples(count: int, fuzz: int = 5000, **more: Any) -> settings:
    """Settings of a property: `count` examples in the suite, `fuzz` of them with `--hypothesis-profile=fuzz`."""
    return settings(max_examples=count if settings.default.derandomize else fuzz, **more)
