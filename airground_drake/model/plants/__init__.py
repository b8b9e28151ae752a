"""Plants of robots: the body's motion between samples, and its cost in distance."""
