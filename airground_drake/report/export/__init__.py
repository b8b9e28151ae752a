"""A run, or a report, as files for other programs: CSV tables and MCAP recordings."""
