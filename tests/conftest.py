"""Shape annotations of the mathematics are checked at run time, under test only."""

from hypothesis import HealthCheck, settings
from jaxtyping import install_import_hook

from tests import shapes

# The compiled form takes no annotations; it is tested against this one.
READABLE = (
    "activation",
    "blending",
    "hierarchy",
    "recursion",
    "singularity",
    "tasksets",
    "torque",
    "tree",
)
install_import_hook([f"opspace.law.{name}" for name in READABLE], f"{shapes.__name__}.check")

settings.register_profile(
    "opspace", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.load_profile("opspace")


def pytest_configure(config):
    """Have the tick ready before any test, and in every worker.

    Compiled once for all workers, and linked before a test of one of its parts brings another copy of
    that part: what runs here is what runs in every other process, to the last bit.
    """
    del config
    from opspace.controller.warm_up import compiled_tick

    compiled_tick()
