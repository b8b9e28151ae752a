"""Claims, one file each, named after the claim: about a run, or about the model."""
