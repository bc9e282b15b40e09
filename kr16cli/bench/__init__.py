"""Timings of the kernels on the user's own machine, beside the engines people use from Python."""
