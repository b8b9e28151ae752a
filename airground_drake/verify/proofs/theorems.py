"""What each theorem says, read from the comments `(** THEOREM` of the `.v` files, which prove it with Coq."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

FOLDER = Path(__file__).parent.parent / "coq"  # where the theories and their record are
# (** THEOREM (20): Its statement, after the equations of the paper that it is about, if there are any.
#     - A hypothesis.
#     Silent on: What it does not say. *)
_COMMENT = re.compile(
    r"^\(\*\* THEOREM(?: (?P<equation>[^:]+))?: (?P<body>(?:(?!\*\)).)*) \*\)\n"
    r"(?:Theorem|Lemma|Corollary) (?P<name>\w+)",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Theorem:
    """A theorem of the `.v` files."""

    name: str  # file and name in Coq, such as "Safety.safe_always"
    equation: str  # number of the paper's equation that it is about, or "ours"
    statement: str  # its statement, in one plain sentence
    hypotheses: tuple[str, ...]  # a sentence each
    silent_on: str  # what it does not state, in one plain sentence; may be empty


def _read(file: Path) -> Iterator[Theorem]:
    for comment in _COMMENT.finditer(file.read_text(encoding="utf-8")):
        established, _, silent_on = comment["body"].partition("\n    Silent on: ")
        statement, *hypotheses = (" ".join(part.split()) for part in established.split("\n    - "))
        name, equation = f"{file.stem}.{comment['name']}", comment["equation"] or "ours"
        yield Theorem(name, equation, statement, tuple(hypotheses), " ".join(silent_on.split()))


# All theorems by name.
THEOREMS: Mapping[str, Theorem] = MappingProxyType(
    {theorem.name: theorem for file in sorted(FOLDER.glob("*.v")) for theorem in _read(file)}
)
