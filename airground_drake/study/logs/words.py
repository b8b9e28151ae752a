"""The output lines about a judged log: the verdict first, then its basis."""

from collections.abc import Iterator, Sequence

from airground_drake.check.rules import SMALL
from airground_drake.report.sentences import some
from airground_drake.study.logs.judging import BROKEN, KEPT, OPEN, Judged, JudgedPair
from airground_drake.study.logs.tracks import Span, Tracks

LEAST_MOVE_M = 0.0005  # smaller approaches do not count, m
# A robot that starts farther away from its start in the scenario, and from its safe distance, is named, m.
ELSEWHERE_M = 0.05
FASTER = 1.01  # a robot faster than this multiple of its limit is named; less may be position noise
LONGER = 1.01  # a log longer than the scenario by more than this gets a remark
# Broken pairs, all pairs, stretches of one pair, and remarks that are printed; `--json` and the page have all.
MOST_NAMED, MOST_PAIRS, MOST_SPANS, MOST_NOTES = 3, 20, 4, 12


def headline(judged: Judged) -> str:
    broken = [pair for pair in judged.pairs if pair.status == BROKEN]
    unsure = [pair for pair in judged.pairs if pair.status == OPEN]
    if broken:
        names = "; ".join(f"{pair.first}, {pair.second}" for pair in broken[:MOST_NAMED])
        more = f" and {len(broken) - MOST_NAMED} more" if len(broken) > MOST_NAMED else ""
        return f"NOT KEPT ({names}{more}): {least(broken[0])}"
    if unsure:
        pair = unsure[0]
        return f"NOT ESTABLISHED ({pair.first}, {pair.second}): {least(pair)}; the position error decides"
    frame = ", if the log is in the scenario's frame" if elsewhere(judged) else ""
    if not judged.covers_all:
        return f"No distance was broken where the log covers it{frame}."
    return f"Every distance was kept, with straight motion between samples{frame}."


def coverage(judged: Judged) -> str:
    lasts = judged.end_s - judged.begin_s
    text = f"The log has {min(lasts, judged.duration_s):.6g} of the scenario's {judged.duration_s:g} s"
    if lasts > LONGER * judged.duration_s:
        text = f"The log lasts {lasts:.6g} s, longer than the scenario's {judged.duration_s:g} s"
    gappy = [pair for pair in judged.pairs if pair.gaps_s]
    if not gappy:
        return f"{text}, without gaps."
    worst = gappy[0]
    many = f"; {len(gappy)} of {len(judged.pairs)} pairs have gaps" if len(gappy) > 1 else ""
    return f"{text}; {worst.first}, {worst.second} are not covered from {spans(worst.gaps_s)}{many}."


def least(pair: JudgedPair) -> str:
    below = f", below it {spans(pair.below_s)}" if pair.below_s else ""
    error = f" ± {pair.error_m:g} m" if pair.error_m else ""
    what = "overlap by " if pair.least_m < 0.0 else ""
    return f"{what}{abs(pair.least_m):.4f} m{error} at {pair.at_s:.3f} s, required {pair.safe_m:g} m{below}"


def spans(those: Sequence[Span]) -> str:
    periods = [f"{span.begin:.3f} to {span.end:.3f} s" for span in those]
    return some(periods, MOST_SPANS)


def doing(pair: JudgedPair) -> str:
    moves = []
    for name, came in sorted(pair.came_m.items(), key=lambda item: -item[1]):
        if came >= LEAST_MOVE_M:
            moves.append(f"{name} came {came:.3f} m nearer")
        elif came <= -LEAST_MOVE_M:
            moves.append(f"{name} moved {-came:.3f} m away")
        else:
            moves.append(f"{name} moved neither nearer nor away")
    return f"in the second before, {', '.join(moves)}"


def law(pair: JudgedPair) -> str:
    if pair.missed_m <= SMALL:
        held = f"the law held in all {pair.intervals} intervals" if pair.intervals else "no interval was recorded"
    else:
        who = ", ".join(f"{name} {missed_m:.3g} m" for name, missed_m in pair.missed_by_m.items() if missed_m > SMALL)
        by = f" ({who})" if len(pair.missed_by_m) > 1 and who else ""
        held = (
            f"the law was violated in {pair.lacking} of {pair.intervals} intervals, "
            f"by up to e = {pair.missed_m:.3g} m, in the {pair.missed_for_s:.4g} s from {pair.missed_at_s:.3f} s{by}"
        )
    if pair.passive:
        did = "did not come" if pair.missed_m <= SMALL else "came"
        fast = f"; {pair.second} moved at {pair.too_fast_m_s:.3g} m/s, above its declared speed"
        return f"{held}: {pair.first} {did} too near by its own motion{fast if pair.too_fast_m_s else ''}"
    promise = f"promises {pair.promised_m:.4g} m" if pair.promised_m is not None else "promises no distance"
    late = f", but the recording from {pair.starts_s:.3f} s on starts nearer than required"
    late = "" if pair.starts_m >= pair.safe_m - SMALL else late
    wrong = f"; with these position errors a law must keep {pair.law_m:.4g} m" if pair.error_m else ""
    return f"{held}{late}: the safety theorem {promise}{wrong}"


def remarks(judged: Judged) -> Iterator[str]:
    for name, (speed, limit) in judged.speeds_m_s.items():
        if speed > FASTER * limit:
            yield f"{name} moves at up to {speed:.3g} m/s, above its limit of {limit:g} m/s"
    if off := elsewhere(judged):
        yield f"{off}; if the log is in another frame, its distances to obstacles are meaningless"


def elsewhere(judged: Judged) -> str:
    """Which robots do not start as in the scenario, in words; '' if none, or if places of the scenario do not count."""
    near = min((pair.safe_m for pair in judged.pairs), default=0.0)
    off = [f"{name} by {away:.3g} m" for name, away in judged.away_m.items() if away > max(near, ELSEWHERE_M)]
    return f"robots do not start as in the scenario: {', '.join(off)}" if off and judged.by_scenario else ""


def source(name: str, tracks: Tracks) -> str:
    track = tracks.bodies[name]
    frame = f" in frame {track.origin['frame']}" if track.origin.get("frame") else ""
    clock = f", by {track.origin['clock']}" if track.origin.get("clock") else ""
    lasts = float(track.t_s[-1] - track.t_s[0])
    rate = f", {(len(track.t_s) - 1) / lasts:.3g} per second" if lasts else ""
    return f"{len(track.t_s)} positions{rate}, of {track.origin.get('stream', name)}{frame}{clock}"


def not_judged(judged: Judged) -> Iterator[str]:
    first, *others = judged.not_judged
    longest = f"the longest interval is {judged.longest_s:.3g} s, in which a robot"
    yield f"{first}; {longest} at its speed limit can leave the line by {judged.stray_m:.2g} m"
    yield from others


def lines(judged: Judged, tracks: Tracks) -> Iterator[str]:
    yield headline(judged)
    for pair in [pair for pair in judged.pairs if pair.status == BROKEN][:MOST_NAMED]:
        yield f"  {pair.first}, {pair.second}: {doing(pair)}"
    kept = sum(pair.status == KEPT for pair in judged.pairs)
    where = "" if judged.covers_all else " where the log covers them"
    yield f"{kept} of {len(judged.pairs)} distances were kept{where}. {coverage(judged)}"
    yield from (f"{name}: {source(name, tracks)}" for name in tracks.bodies)
    if tracks.origin:
        yield f"Time 0 is {tracks.origin}."
    notes = [*tracks.remarks, *remarks(judged)]
    yield from (f"Note: {remark}" for remark in notes[:MOST_NOTES])
    if len(notes) > MOST_NOTES:
        yield f"Note: {len(notes) - MOST_NOTES} more; --json has all"
    if tracks.ignored:
        more = f"; and {len(tracks.ignored) - MOST_NOTES} more" if len(tracks.ignored) > MOST_NOTES else ""
        yield f"Not used: {'; '.join(tracks.ignored[:MOST_NOTES])}{more}"
    yield "Least margins first, distances between surfaces:"
    for pair in judged.pairs[:MOST_PAIRS]:
        part = f"; covered {pair.covered_s:.6g} s" if pair.gaps_s else ""
        part += ", nearest at the edge of a gap" if any(pair.at_s in span for span in pair.gaps_s) else ""
        yield f"  {pair.first}, {pair.second}: {pair.status}, {least(pair)}{part}; {law(pair)}"
    if len(judged.pairs) > MOST_PAIRS:
        yield f"  and {len(judged.pairs) - MOST_PAIRS} more pairs; --json has all"
    yield from (f"Not judged: {limit}." for limit in not_judged(judged))
