"""Colours and marks of a replay: what is told by a colour is told by a mark or a dash, too."""

from __future__ import annotations

STATE_COLORS = ("#0060a8", "#d98200", "#00705a")
STATE_MARKS = ("", "▲", "◉")
"""Of `scene.STATES`; the marks stand beside a robot's name."""

OUTCOME_COLORS = {"asked": "#d98200", "accepted": "#00705a", "refused": "#b00020"}
"""Of proposals: a line in full if accepted, else dashed."""

UAV_COLOR, PATH_COLOR, SAFE_COLOR = "#404040", "#8899aa", "#b03a2e"
OBSTACLE_COLOR, UNSEEN_COLOR = "#5a5a5a", "#a0a0a0"
"""Of an obstacle on the UAV's map, and of one that is not there, or only there."""
