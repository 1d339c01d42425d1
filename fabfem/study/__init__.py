"""Many runs of one case: sweeps, studies of error against time, calibrations, and what a run will cost."""
