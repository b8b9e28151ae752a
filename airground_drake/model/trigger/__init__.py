"""The decision layer: drift-diffusion model, Bayes-risk threshold, trigger automaton (pure maths)."""
