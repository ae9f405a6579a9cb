"""What runs compiled: from scalars to the tick, dynamics included; jitted code only.

Plain loops on arrays that the caller owns: nothing is allocated, nothing is raised. The readable
form in `opspace.law` and `opspace.controller.reference` is the oracle; both agree to 1e-9.
"""
