"""SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST: set-based avoidance keeps the safe distance. Begin with `safe_inv.py`."""
