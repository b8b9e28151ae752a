"""`sweep`: the runs of a scenario for every combination of values of some keys, as a table."""

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from itertools import chain
from typing import Any

import pandas as pd

from airground_drake.base.errors import UnknownNameError
from airground_drake.base.registry import RUN_CLAIMS
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS
from airground_drake.scenario.load import resolved, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.study.campaign import pool
from airground_drake.study.campaign.distributions import GRID, Key
from airground_drake.study.campaign.spec import NOT_JUDGED, Spec
from airground_drake.study.campaign.store import table_of
from airground_drake.study.campaign.swept import per_run
from airground_drake.study.campaign.work import died, rows_of


def sweep(
    scenario: Scenario,
    values: Mapping[str, Sequence[Any]],
    runs: Collection[str] = (),
    claims: Collection[str] = (),
    jobs: int = 1,
    *,
    allow_plugins: bool = True,
) -> pd.DataFrame:
    """Simulate and judge the runs of a scenario for every combination of values.

    Args:
        scenario: from a file or made in Python.
        values: lists of values by dotted key, such as `{"decision.threshold.zeta_m": [2.5, 3.0]}`.
        runs: names of runs; default: all of the scenario.
        claims: identifiers of claims about runs; default: all.
        jobs: number of processes.
        allow_plugins: whether third-party code that the scenario or a value names may be imported.

    Returns:
        A row for each combination and run, see `swept.per_run`. `ended` says `judged`, or why not; `what` explains it.

    Raises:
        ScenarioError: if the scenario is not valid, a key does not exist or would replace one given before it, or
            third-party code is not allowed.
        UnknownNameError: if a run or a claim does not exist.
        ValueError: if a key has no values.
    """
    scenario = validated(scenario)
    if empty := [key for key, given in values.items() if not len(given)]:
        raise ValueError(f"no values for {', '.join(empty)}; wanted: a list of at least one value")
    spec = Spec(
        name=scenario.name, scenario=scenario.name, runs=tuple(runs), claims=tuple(claims), digest="", source="",
        drawn={key: Key(GRID, list(given)) for key, given in values.items()}, data=resolved(scenario) | NOT_JUDGED,
    )  # fmt: skip
    for kind, names, allowed in (("run", runs, scenario.runs), ("claim", claims, RUN_CLAIMS)):
        for name in names:
            if name not in allowed:
                raise UnknownNameError(kind, name, allowed)
    if not allow_plugins:
        plugins.refuse(scenario, scenario.name)
    spec.check_keys()
    work = partial(rows_of, spec, limits=DEFAULT_LIMITS._replace(plugins=allow_plugins))
    indices = range(spec.combinations)
    if jobs == 1:
        draws = {index: work(index) for index in indices}
    else:
        with pool.local(jobs) as processes:
            draws = {index: rows or died(index, spec.values(index)) for index, rows in processes(work, indices)}
    return per_run(table_of(list(chain.from_iterable(draws[index] for index in indices))))
