"""Relative thresholds of corner forces and gaps, below which values are zero."""

EPS_TERM = 1e-14  # of the terms of a sum, which are products with a flexibility
EPS_SUM = 1e-13  # of a load that is a sum of forces; of a corner's own response, in factors
EPS_PIVOT = 1e-12  # of values and pivots that many exchanges have changed
