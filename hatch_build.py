"""Put the compiled kernels into the wheel, so that nothing is compiled where it is installed."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CustomBuildHook(BuildHookInterface):
    """Compiles for all processors that are shipped, on whatever machine the wheel is made.

    The wheel stays one for every platform: an object is data that the package's own loader picks, and
    where none fits the kernels are compiled at the first start. An editable installation gets none,
    since its kernels may be edited.
    """

    _made: Path | None = None

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and have the files put beside the loader."""
        if version == "editable":
            return
        sys.path.insert(0, str(Path(self.root) / "src"))
        from opspace.plan.entries import KERNELS  # noqa: PLC0415 - the package is not installed

        made = self._made = Path(tempfile.mkdtemp())
        for name, content in KERNELS.to_ship().items():
            (made / name).write_bytes(content)
            build_data["force_include"][str(made / name)] = f"opspace/machine/objects/{name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Leave nothing behind."""
        if self._made is not None:
            shutil.rmtree(self._made)
