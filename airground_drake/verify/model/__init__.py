"""Claims about the model and its constants, whatever the run."""
