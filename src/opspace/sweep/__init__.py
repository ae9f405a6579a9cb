"""Many runs of a scenario: grids and random campaigns, in parallel, resumable."""

from opspace.sweep.run_sweep import Sweep as Sweep
from opspace.sweep.run_sweep import run_sweep as run_sweep
from opspace.sweep.sweep_plan import SweepPlan as SweepPlan
from opspace.sweep.vary import Variation as Variation
