"""Plants of robots: where the body is between samples, and what that costs in distance."""
