"""Limits of names, counts and texts in a scenario file, separate so that their users need not import pydantic."""

MAX_UGVS, MAX_SEED, MAX_STAGES = 100, 2**31 - 1, 1000
MAX_NAME, MAX_TEXT = 64, 10_000  # characters
MAX_CORNERS = 1000  # of a polygon or wall
MAX_RECTANGLES = 50_000  # of a map
