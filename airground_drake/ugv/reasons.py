"""Why proposals are accepted and refused: the reasons, and what they mean in words."""

from typing import Literal, NamedTuple

# Reasons of answers: see `answer.settle` for method (c), `outcome_gatekeeper` for method (d).
Reason = Literal[
    "cheaper", "not_cheaper", "waits", "no_difference", "kept", "dwell", "reversed", "no_plan",
    "first_stage",
    "stalls", "makes_way", "exhausted", "over",
]  # fmt: skip
OVER: Reason = "over"  # no refusal: the proposal was executed for as long as it was accepted, or came too late


class Words(NamedTuple):
    """A reason in words."""

    sentence: str  # the message to the UAV
    # Why a proposal was refused, in a few words, for a report's first screen; '' if the name of the reason does.
    refused: str = ""


WORDS: dict[Reason, Words] = {
    "cheaper": Words("the proposal leads to a better outcome than the UGV's own task"),
    "not_cheaper": Words(
        "the UGV's own task leads to as good an outcome or a better one", "the UGV's own task looked as good"
    ),
    "waits": Words("the best plan refuses now and accepts later", "waiting looked cheaper"),
    "no_difference": Words("the proposal would change nothing", "it would have changed nothing"),
    "kept": Words("as answered before"),
    "dwell": Words("as answered before: it is too early for another answer"),
    "reversed": Words("the best plan begins with the other answer, and is cheaper than this one throughout"),
    "first_stage": Words("the plan begins with this answer", "its plan began with refusing"),
    "no_plan": Words("no outcome could be computed", "no outcome could be computed"),
    "stalls": Words(
        "with the proposal the UGV would come to rest short of its goal, no nearer than without",
        "it would have stalled on the way",
    ),
    "makes_way": Words("the UGV makes way for another one and still reaches its goal"),
    "exhausted": Words("the UGV has used all of its tries and has not rested since", "it had used all of its tries"),
    "over": Words("the time of the proposal is over", "its time was over"),
}


def refusal(reason: str) -> str:
    """Why a proposal was refused, in a few words; of a third-party gatekeeper the name of its reason."""
    known: dict[str, str] = {name: words.refused for name, words in WORDS.items()}
    return known.get(reason) or reason.replace("_", " ")
