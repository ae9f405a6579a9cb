"""Shape annotations of the mathematics are checked at run time, under test only."""

from hypothesis import HealthCheck, settings

from tests.another_python import ask_for
from tests.shapes import check_annotations

# The compiled form takes no annotations; it is tested against this one.
READABLE = (
    "activation",
    "blending",
    "hierarchy",
    "recursion",
    "singular_directions",
    "tasksets",
    "torque",
    "tree",
)
check_annotations([f"opspace.law.{name}" for name in READABLE])

settings.register_profile(
    "search", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
# The same sources get the same answer; what nobody has drawn yet is for `make test-search`.
settings.register_profile("gate", settings.get_profile("search"), derandomize=True, max_examples=40)
settings.load_profile("gate")


def pytest_configure(config):
    """Have the kernels ready before any test, once for all workers, and keep single ones."""
    from opspace.plan.entries import KERNELS

    ask_for(config.getoption("pythonwarnings"))
    keep_single_kernels()
    KERNELS.load()


def keep_single_kernels():
    """Have numba keep what tests call of the kernels' parts; users never compile a part alone."""
    from opspace.machine import jit
    from opspace.machine.sources import stamp

    compiled, contents = jit.jit, stamp()

    def kept(function):
        found = compiled(function)
        found.enable_caching()
        # By itself numba looks at the file of a function, not at those of the ones that it calls.
        found._cache._cache_file._source_stamp = contents
        return found

    jit.jit = kept
