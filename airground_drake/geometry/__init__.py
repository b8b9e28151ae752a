"""Motions along polylines and shortest paths round discs: pure maths, without Drake."""
