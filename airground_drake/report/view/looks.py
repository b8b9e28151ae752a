"""Colours and marks of a replay. A mark or a dash repeats what a colour says."""

STATE_COLORS = ("#0060a8", "#d98200", "#00705a")
STATE_MARKS = ("", "▲", "◉")  # by index of `stage.STATES`; the marks stand beside a robot's name

# Of proposals; the line is solid if accepted, else dashed.
OUTCOME_COLORS = {"asked": "#d98200", "accepted": "#00705a", "refused": "#b00020"}

UAV_COLOR, PATH_COLOR, SAFE_COLOR = "#404040", "#8899aa", "#b03a2e"
# Of an obstacle on the UAV's map, and of one that is missing on it or exists only there.
OBSTACLE_COLOR, UNSEEN_COLOR = "#5a5a5a", "#a0a0a0"


def rgb(color: str) -> list[float]:
    """Red, green and blue, from 0 to 1, of a colour #rrggbb."""
    return [int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
