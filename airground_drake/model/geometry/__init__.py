"""Motions along polylines, convex obstacles, and shortest paths round them: pure maths, without Drake."""
