"""A scenario drawn: from above by matplotlib (`plane`); in Meshcat (`draw`), live or as a background of its replay."""
