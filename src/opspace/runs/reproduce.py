"""Repeats the paper's experiments: runs, numbers, figures and pictures in one directory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from opspace.record import Recording
from opspace.record.format import write_json
from opspace.runs.experiments import (
    Experiment,
    fast_approaches,
    joint_limit,
    singularity,
)
from opspace.runs.progress import ProgressBar
from opspace.runs.run import METRICS, RunResult, first_return, run_scenario
from opspace.scenario.build import build_robot

SHOWN = "transition"
"""The variant that the pictures of the robot are taken from."""

EXPERIMENTS = ("singularity", "joint-limit")


@dataclass(frozen=True)
class Reproduced:
    """One experiment that has been run.

    Attributes:
        experiment: What was run.
        directory: Where it lies.
        runs: Result by variant.
    """

    experiment: Experiment
    directory: Path
    runs: Mapping[str, RunResult]

    @property
    def recordings(self) -> dict[str, Recording]:
        """The recordings by variant."""
        return {name: run.recording for name, run in self.runs.items()}


def reproduce(
    which: Sequence[str],
    robot: str,
    out: Path,
    *,
    progress: ProgressBar | None = None,
) -> list[Reproduced]:
    """Run experiments and write ``metrics.json`` for each.

    What an earlier call left in the same directories is replaced.

    Args:
        which: Some of `EXPERIMENTS`.
        robot: Name or absolute path of the robot.
        out: Directory to write to; each experiment gets one below it, each variant one below that.
        progress: Bar that gets a line for each run.

    Returns:
        The experiments in the order in which they ran.

    Raises:
        UnknownNameError: There is no such robot.
        InputError: The experiment cannot be done with this robot.
    """
    experiments: list[Experiment] = []
    if "singularity" in which:
        experiments.append(singularity(robot))
    if "joint-limit" in which:
        experiments += [joint_limit(robot), fast_approaches(robot)]
    return [_run(experiment, out / experiment.name, progress) for experiment in experiments]


def _run(experiment: Experiment, out: Path, progress: ProgressBar | None) -> Reproduced:
    runs = {
        variant: run_scenario(
            scenario,
            out / variant,
            title=f"{experiment.name} {variant}",
            progress=progress,
            overwrite=True,
        )
        for variant, scenario in experiment.runs.items()
    }
    write_json(out / METRICS, {name: run.metrics.to_json() for name, run in runs.items()})
    return Reproduced(experiment, out, runs)


def draw(done: Sequence[Reproduced], out: Path) -> list[str]:
    """Draw the figures of experiments and take pictures of the robot.

    Args:
        done: The experiments.
        out: Directory that holds them; what shows several experiments goes there.

    Returns:
        What could not be drawn, one line each.

    Raises:
        MissingExtraError: matplotlib or MuJoCo is not installed.
    """
    from opspace.plots import (  # noqa: PLC0415 - an extra, and slow to import
        joint_limit_figures,
        overview_figure,
        singularity_figures,
    )

    figures = {"singularity": singularity_figures, "joint-limit": joint_limit_figures}
    drawn = [found for found in done if found.experiment.name in figures]
    for found in drawn:
        figures[found.experiment.name](found.recordings, found.directory)
    images, problem = _pictures(drawn)
    compared = {found.experiment.title: found.recordings for found in drawn}
    overview_figure(compared, out / "overview.png", images=images)
    return [problem] if problem else []


def _pictures(done: Sequence[Reproduced]) -> tuple[list[np.ndarray], str]:
    """Write a strip of snapshots for each experiment.

    Returns:
        A picture of each at the moment before the return, and why there is none, if so.
    """
    from opspace.pictures.snapshots import (  # noqa: PLC0415 - an extra, and slow to import
        SnapshotUnavailableError,
        snapshot_strip,
        snapshots,
    )

    images = []
    for found in done:
        run, scenario = found.runs[SHOWN], found.experiment.runs[SHOWN]
        robot, recording = build_robot(scenario), run.recording
        far, end = first_return(scenario) or 0.0, float(recording.t[-1])
        times = [t for t in (0.0, 0.5 * far, far, end) if t <= end]
        try:
            snapshot_strip(recording, robot, times, found.directory / "snapshots.png")
            images += snapshots(recording, robot, [min(far, end)])
        except SnapshotUnavailableError as error:
            return [], str(error)
    return images, ""
