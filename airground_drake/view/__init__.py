"""A scenario drawn in Meshcat: while a run is simulated (`live_view`), and as a background of its replay."""
