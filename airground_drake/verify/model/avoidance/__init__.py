"""SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST: set-based avoidance keeps the safe distance."""
