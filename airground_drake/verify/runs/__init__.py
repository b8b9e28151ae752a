"""Claims about a run, decided from its trace alone; one claim, one file, named by its identifier."""
