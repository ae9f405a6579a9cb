"""Run scenes, tell what was measured, keep it, and compare two runs."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

import numpy as np

from opspace.bench.scenes import SCENES, Scene
from opspace.bench.states_per_second import states_per_second
from opspace.bench.subjects import LIBRARY, MODEL, PLACO, Tick, subjects
from opspace.bench.timing import TimesItself, interleaved, pinned, slowest_state
from opspace.errors import InputError, unknown_name

PACKAGES = ("opspace", "numba", "numpy", "pin", "mujoco", "placo")
BATCH_HEADS = ("scene", "threads", "states/s", "µs a state")
HEADS = (
    "scene", "subject", "p50 [µs]", "p99 [µs]", "max [µs]", "slowest state [µs]", "of placo",
    "of model calls",
)  # fmt: skip


@dataclass
class Benchmark:
    """What was measured.

    Attributes:
        scenes: By scene and subject: ``p50``, ``p99``, ``p999``, ``max``, ``mean`` in µs, ``ticks``, and
            ``slowest``, µs: the quickest tick of the state whose quickest tick is the slowest. It is
            what the computation takes at most, where ``p99`` is also what the machine does meanwhile.
        machine: What it was measured on.
        batches: By scene and number of threads: states per second of `Controller.torque_batch`.
    """

    scenes: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    machine: dict[str, str] = field(default_factory=dict)
    batches: dict[str, dict[str, float]] = field(default_factory=dict)

    def ratio(self, scene: str, subject: str, to: str) -> float | None:
        """Median of a subject over that of another one in the same scene, None where it is not."""
        found = self.scenes[scene]
        return None if to not in found else found[subject]["p50"] / found[to]["p50"]

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heads and rows for a person."""
        rows: list[tuple[str, ...]] = []
        for scene, found in self.scenes.items():
            for subject, times in found.items():
                ratios = (self.ratio(scene, subject, to) for to in (PLACO, MODEL))
                rows.append(
                    (
                        scene,
                        subject,
                        *(f"{times[key]:.3g}" for key in ("p50", "p99", "max", "slowest")),
                        *("-" if r is None else f"{r:.2f}" for r in ratios),
                    )
                )
        return HEADS, rows

    def batch_table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heads and rows of the batches for a person."""
        rows = [
            (scene, threads, f"{rate:,.0f}", f"{1e6 / rate:.3g}")
            for scene, found in self.batches.items()
            for threads, rate in found.items()
        ]
        return BATCH_HEADS, rows

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        path.parent.mkdir(parents=True, exist_ok=True)
        content = {"machine": self.machine, "scenes": self.scenes, "batches": self.batches}
        path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    @staticmethod
    def load(path: Path) -> Benchmark:
        """Read what `save` wrote.

        Raises:
            InputError: The file is no benchmark.
        """
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            return Benchmark(content["scenes"], content["machine"], content.get("batches", {}))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: not a benchmark of opspace: {error}") from None


def run_benchmark(
    names: Sequence[str] = (),
    ticks: int = 4000,
    core: int | None = None,
    *,
    readable: bool = False,
    more: Callable[[Scene], Mapping[str, TimesItself]] = lambda _: {},
    announce: Callable[[str], None] = lambda _: None,
) -> Benchmark:
    """Time scenes.

    Args:
        names: Scenes; none is all of them whose robot is installed.
        ticks: Ticks of every subject, and states of a batch.
        core: Core to stay on for single ticks; None leaves it to the system.
        readable: Time the readable form of the tick as well.
        more: Gives what else is to be timed in a scene, by name.
        announce: Told what is timed next.

    Returns:
        What was measured.

    Raises:
        InputError: There is no such core, or too few ticks.
        UnknownNameError: There is no such scene.
        MissingExtraError: A robot that was asked for is not installed.
    """
    if ticks < 1:
        raise InputError(f"a benchmark needs at least one tick, got {ticks}")
    for name in names:
        if name not in SCENES:
            raise unknown_name("scene", name, SCENES)
    found = Benchmark(machine=_machine(core))
    with pinned(core):
        for name in names or SCENES:
            announce(f"{name}: {SCENES[name].title}")
            scene = SCENES[name]
            timed: dict[str, Tick | TimesItself] = {**subjects(scene, readable), **more(scene)}
            q, v = scene.states(scene.robot())
            times = interleaved(timed, q, v, ticks)
            found.scenes[name] = {subject: _summary(x, len(q)) for subject, x in times.items()}
    for name in names or SCENES:
        announce(f"{name}, many states at once")
        found.batches[name] = states_per_second(SCENES[name], ticks)
    return found


def compare_runs(
    before: Benchmark, after: Benchmark
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Put two runs side by side, by what does not depend on the machine's clock.

    Returns:
        Heads and rows: the library's median over that of the model's own calls, before and after.
    """
    rows: list[tuple[str, ...]] = []
    for scene in after.scenes:
        if scene in before.scenes:
            a, b = (run.ratio(scene, LIBRARY, MODEL) for run in (before, after))
            if a is not None and b is not None:
                rows.append((scene, f"{a:.2f}", f"{b:.2f}", f"{b / a:.2f}"))
    return ("scene", "before [model calls]", "after [model calls]", "after / before"), rows


def _summary(times: np.ndarray, states: int) -> dict[str, float]:
    p50, p99, p999 = np.percentile(times, (50, 99, 99.9)).tolist()
    return {
        "p50": p50,
        "p99": p99,
        "p999": p999,
        "max": float(times.max()),
        "slowest": slowest_state(times, states),
        "mean": float(times.mean()),
        "ticks": times.size,
    }


def _machine(core: int | None) -> dict[str, str]:
    versions: dict[str, str] = {}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions[package] = "not installed"
    return {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "core": "any" if core is None else str(core),
        **versions,
    }
