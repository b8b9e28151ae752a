"""What proves and computes, and knows no claim: solvers, obligations, exact arithmetic, segments."""
