"""What compiled code may ask of the operating system: the time, and to sleep.

Both are calls that the compiler cannot look into, so what stands before one is read and written
before it, also where another program looks at the same memory.
"""

from __future__ import annotations

from typing import Any

from numba import types

clock_gettime: Any = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.intp))
"""Write the time of a clock, by its number, to an address: seconds and nanoseconds."""

nanosleep: Any = types.ExternalFunction("nanosleep", types.int32(types.intp, types.intp))
"""Sleep for the time at an address; the second one is 0."""
