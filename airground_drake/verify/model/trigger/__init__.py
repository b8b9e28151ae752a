"""ZENO-PROOF and ZENO-REFINE: the trigger's events neither accumulate nor multiply. Begin with `zeno_proof.py`."""
