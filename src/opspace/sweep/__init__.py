"""Many runs of a scenario: grids and random campaigns, in parallel, resumable."""

from opspace.sweep.plan import SweepPlan as SweepPlan
from opspace.sweep.run import Sweep as Sweep
from opspace.sweep.run import run_sweep as run_sweep
from opspace.sweep.vary import Variation as Variation
