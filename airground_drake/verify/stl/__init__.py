"""Claims about a run again, in Signal Temporal Logic."""
