"""Shape annotations of the mathematics are checked at run time, under test only."""

from hypothesis import HealthCheck, settings
from jaxtyping import install_import_hook

from tests import shapes

install_import_hook("opspace.law", f"{shapes.__name__}.check")

settings.register_profile(
    "opspace", deadline=None, suppress_health_check=[HealthCheck.too_slow], print_blob=True
)
settings.load_profile("opspace")
