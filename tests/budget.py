"""How many examples of a law are tried: some in every run of the suite, many in the campaign."""

import os

from hypothesis import settings

CAMPAIGN = "OPSPACE_CAMPAIGN"


def examples(count):
    """Try half of ``count``, and ten times ``count`` where the environment asks for the campaign."""
    return settings(max_examples=count * 10 if os.environ.get(CAMPAIGN) else (count + 1) // 2)
