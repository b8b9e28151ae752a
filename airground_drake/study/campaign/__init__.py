"""Campaigns: many runs of a scenario with drawn keys, and conclusions from them.

    spec.yaml -> Spec -> draw(index) -> Scenario -> rows of verdicts -> Store -> evidence -> page

`distributions.py` and `course.py` are pure functions of a draw's number, so that each draw can be repeated alone.
`spec.py` reads the file, `work.py` does one draw, `pool.py` does many, on this machine or on a cluster. `store.py`
keeps finished draws even if processes are killed. `statistics.py` and `evidence.py` draw conclusions, which `page.py`
shows.
"""
