"""The law compiled: the same results as the readable form, for a loop of a thousand ticks a second.

Plain loops on arrays that the caller owns: nothing is allocated, nothing is raised. The readable
form in `opspace.law` is the oracle; both agree to 1e-9.
"""
