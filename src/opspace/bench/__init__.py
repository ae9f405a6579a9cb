"""How long a tick takes, beside other controllers in the same run."""

from opspace.bench.fleet_on_card import CARD_HEADS as CARD_HEADS
from opspace.bench.fleet_on_card import fleet_on_card as fleet_on_card
from opspace.bench.fleet_steps import FLEET_HEADS as FLEET_HEADS
from opspace.bench.fleet_steps import fleet_steps as fleet_steps
from opspace.bench.newton_steps import newton_is_installed as newton_is_installed
from opspace.bench.run_benchmark import Benchmark as Benchmark
from opspace.bench.run_benchmark import compare_runs as compare_runs
from opspace.bench.run_benchmark import run_benchmark as run_benchmark
from opspace.bench.scenes import SCENES as SCENES
from opspace.bench.stack_changes import changes_table as changes_table
from opspace.bench.stack_changes import stack_changes as stack_changes
from opspace.bench.worst_case import Sampler as Sampler
from opspace.bench.worst_case import slowest as slowest
from opspace.bench.worst_case import worst_table as worst_table
