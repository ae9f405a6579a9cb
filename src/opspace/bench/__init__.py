"""How long a tick takes, beside other controllers in the same run."""

from opspace.bench.fleet_steps import FLEET_HEADS as FLEET_HEADS
from opspace.bench.fleet_steps import fleet_steps as fleet_steps
from opspace.bench.run_benchmark import Benchmark as Benchmark
from opspace.bench.run_benchmark import compare_runs as compare_runs
from opspace.bench.run_benchmark import run_benchmark as run_benchmark
from opspace.bench.scenes import SCENES as SCENES
from opspace.bench.stack_changes import changes_table as changes_table
from opspace.bench.stack_changes import stack_changes as stack_changes
