"""A boundary-value problem as a case says it: what stands where, what is done to it, what is looked at."""
