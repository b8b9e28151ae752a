"""Campaigns: many runs of a scenario whose keys are drawn, and what can be concluded from them.

    spec.yaml -> Spec -> draw(index) -> Scenario -> rows of verdicts -> Store -> evidence -> page

`distributions.py` and `course.py` are pure functions of a draw's number, so that each draw can be made again alone;
`spec.py` reads what is drawn; `work.py` does one draw; `pool.py` many, on this machine or on a cluster; `store.py`
keeps finished draws through kills; `statistics.py` and `evidence.py` conclude; `page.py` shows.
"""
