"""The sentences of a report's first screen in one table, the marks of its lines, and how lists are put into words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class Line(NamedTuple):
    """A sentence and its mark, a key of `MARKS`."""

    mark: str
    text: str


class Mark(NamedTuple):
    """How a mark is shown: its icon, its meaning for the legend and screen readers, and the class of its colour."""

    icon: str
    meaning: str
    look: str


MARKS = {
    "yes": Mark("✓", "yes", "good"),
    "partly": Mark("≈", "in part", "tuned"),
    "no": Mark("✗", "no", "bad"),
    "open": Mark("?", "not known", "open"),
    "none": Mark("\N{EN DASH}", "neither good nor bad", "idle"),
    "": Mark(" ", "", ""),
}
"""Marks of lines, never by colour alone; '' continues the line before."""
MAX_NAMES = 3
"""Maximum number of robots that a line names."""

SENTENCES = {
    # The headline
    "nothing_run": "? Nothing was run.",
    "nothing_judged": "? Not decided: {which}.",
    "could_not": "run{s} {runs} could not be judged",
    "alone": "All arrive safely.",
    "either_way": "With and without help, all arrive safely.",
    "helped": "With help, all arrive safely{failures}",
    "some_arrive": "≈ {who} safe and {bring} everyone home{failures}",
    "none_arrive": "✗ No method brings everyone home safely{failures}",
    "unsafe": "✗ Not safe{failures}",
    "safe_but": "✗ Safe, but {what}.",
    "safe_but_away": "✗ Safe, but not all arrive{failures}",
    "blameless": "No robot itself brought a distance below the required one",
    # Safe?
    "kept": "✓ {runs}: minimum distance {near.pair}, required {near.required_m:g} m.",
    "kept_idly": "\N{EN DASH} {runs}: minimum distance {near.pair}, required {near.required_m:g} m; nothing came near, "
    "so this was not tested.",
    "broken": "✗ {run.name}: {what}{expected}.",
    "unknown": "? {runs}: not known, {why}.",
    "printed": "✗ {runs} with {recursion}: {home}{what}{expected}.",
    "tested": "✓ Proved: {who} keep{s} every distance{covered}, whatever the UAV asks.",
    "idle": "\N{EN DASH} Proved for {who}, but nothing came near: its conditions hold with nothing to check.",
    "refuted": "✗ The proof does not apply to {runs}: its conditions did not hold ({lacking}).",
    "undecided": "? Not known whether the proof applies to {runs} ({lacking}).",
    "unproved": "? Not proved for {who} ({lacking}).",
    "covered": " between robots and from bodies at rest, and drive{s} no robot too near to what moves",
    # Who came how near to what
    "appears": "{near.whom} appears too near to {near.robot} ({near}, nobody's doing)",
    "appears_on": "{near.whom} appears on {near.robot} (nobody's doing)",
    "comes_within": "{near.robot} comes within {near} of {near.whom}",
    "collides": "{robot} collides with {what} at {t_s:.2f} s",
    "starts": "{first} starts {gap_m:.2f} m from {second}, required {required_m:.2f} m: nobody's doing",
    "appeared": "{second} appeared {gap_m:.2f} m from {first}: nobody's doing",
    "met": "{second} {met} {first} at {t_s:.2f} s ({gap}, required {required_m:.2f} m); {first} {reacted}",
    "caught": "{first} was caught between {second} and {between}, {caught_s[0]:.2f} to {caught_s[1]:.2f} s: {second} "
    "came to {gap_m:.2f} m by its own motion{kept}",
    "beside": "; {near.required_m:.2f} m from {near.whom} was kept",
    "too_fast": "{second} moved at {too_fast_m_s:.2f} m/s at {too_fast_s:.2f} s, declared {declared_m_s:.2f}: "
    "{safe_distance_m:.2f} m from {second} is not promised from then on",
    # Arrived?
    "home": "✓ {runs}: all{within}{by}.",
    "home_first": "≈ {run.name}: {robot} arrives at {at_s:.1f} s; {hit}: nothing after that counts.",
    "kept_away": "from {since_s:.1f} s it stood {off_m:.2f} m from its target, {where} which {by} stands{never}",
    "no_way": "the UAV found no way for {who}",
    # Messages, and Seeds?
    "messages": "  {runs}. Always-on supervision: {always}.",
    "all_seeds": "✓ all {seeds} keep every distance and bring all home",
    "some_seeds": "≈ {kept} of {seeds} keep every distance, {home} bring all home{worst}{promised}",
    "worst_seed": "; worst: {apart} ({first} to {second}, seed {seed}), required {safe_distance_m:g} m",
    "no_noise": "  There is no decision noise: the seed changes nothing but what third-party code makes of it.",
    # Zeno-free?
    "dwell": "✓ Proved{where}: triggers are at least {dwell_s:g} s apart.",
    "short_dwell": "≈ Proved{where}: triggers are at least {dwell_s:g} s apart. No practical protection: that is "
    "shorter than the control period, {period_s:g} s.",
    "no_dwell": "? Not proved{where}{bare} (ZENO-PROOF: {status}).",
    "too_soon": "✗ {run}: two triggers {gap} apart.",
    "gaps": "  Seen: {gaps} between triggers{smallest}.",
    "no_gaps": "  These runs cannot show it: {why}. Scenario dwell does.",
    # Threshold?
    "mistriggered": "✗ {run}: a trigger is missed, spurious or at the wrong time (THR-TRIG).",
    "not_judged": "? {runs}: not known whether triggers are missed (THR-TRIG).",
    "never_fired": "\N{EN DASH} Never fired{largest}: the threshold is {zeta} m.",
    "largest": " at decision variables up to {largest:.3g} m",
    "fired": "✓ Fired exactly when the decision variable reached {zeta} m, {when}.",
    "not_compared": "? {runs}: not compared with the task error without noise (THR-QUALITY).",
    "compared": "✓ Against the task error without noise{where}: {timing}.",
    "no_worse": "  {runs}: no worse.",
    "off": "up to {off_s:.2f} s {early} (at {error_m:.2f} m)",
    "ddm": "  Decisions about {ugv} in run {run}: {wrong:.2g} % wrong{mean}. By (17)-(18), for its {drift_m_s:.2g} m/s "
    "and {noise_m_sqrt_s:g} m/√s: {due:.2g} % wrong, {decision_time_of_17_s:.2g} s.",
    "optimal": "✓ {zeta:.4g} m is the Bayes optimum for the assumed drift {drift_m_s:.4g} m/s and noise "
    "{noise_m_sqrt_s:.4g} m/√s{never}.",
    "chosen": "✓ {zeta:.4g} m, {rule}, costs {more} the Bayes optimum {best:.4g} m for the assumed drift "
    "{drift_m_s:.4g} m/s and noise {noise_m_sqrt_s:.4g} m/√s{never}.",
    "never": "; within the speed limits no task error grows faster than {fastest:.3g} m/s",
    "own": "✓ For the drift and noise of {robot} in run {run}, {what}.",
    "delay": "{ideal}; {threshold_m:.4g} m costs as much as a delay of {cost_s:.2g} s",
    # Paper?
    "matches": "✓ {matched} of {all} results match{how}.",
    # Do not conclude that
    "real": "real vehicles are safe: the model is first-order, its sensing perfect",
    "real_own": "real vehicles are safe: {robot} showed {drift_m_s:.2g} of {declared_drift_m_s:.3g} m/s drift and "
    "{cover_m:.3g} of {declared_cover_m:.3g} m cover here, not everywhere",
    "real_plants": "real vehicles are safe: those here never slip, lag exactly as declared, and sense perfectly",
    "elsewhere": "{who} also safe elsewhere: that was only seen in these runs",
    "beside_movers": "a robot can keep its distance from {who}: what moves can come as near as it likes",
    "other_starts": "{who} also arrive from other starts or with other seeds: arrival is seen, not proved",
    "never_called": "the UAV helps: it was never called",
    "open_is_fine": "what could not be judged is fine",
    # As declared?
    "declared": "✓ {checks} checks as declared{told}.{more}",
    "undeclared": "{told} {checks} {are} not as declared.",
}
"""Sentences after the icon of their mark, and, without icon, clauses."""
_MARKED = {mark.icon: name for name, mark in MARKS.items()}


def say(name: str, found: Mapping[str, Any] | None = None, /, **values: Any) -> Line:
    """A sentence of the table with its mark, with values that a claim found and others."""
    icon, text = SENTENCES[name][0], SENTENCES[name][2:]
    return Line(_MARKED[icon], text.format(**{**(found or {}), **values}))


def clause(name: str, found: Mapping[str, Any] | None = None, /, **values: Any) -> str:
    """A clause of the table, with values that a claim found and others."""
    return SENTENCES[name].format(**{**(found or {}), **values})


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """The values of each key, in the order in which the keys first appear."""
    found: dict[K, list[V]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def counted(count: int, noun: str) -> str:
    """A number and its noun: "1 check", "2 checks"."""
    return f"{count} {noun}{'s' * (count != 1)}"


def joined(words: Sequence[str]) -> str:
    """Words as a list: "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def upper(told: str) -> str:
    """A clause as the beginning of a sentence."""
    return f"{told[0].upper()}{told[1:]}"
