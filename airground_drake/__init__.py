"""Event-triggered UAV-to-UGV intervention on Drake, with verification reports."""
