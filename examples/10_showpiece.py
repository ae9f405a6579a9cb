"""The first seconds of the show-piece from its scenario file, recorded and read back."""

import tempfile
from pathlib import Path

import numpy as np

import opspace as osc
from opspace.runs.run import run_scenario
from opspace.scenario import load_scenario

with tempfile.TemporaryDirectory() as folder:
    scenario = load_scenario("showpiece", ["duration=4.0"])
    result = run_scenario(scenario, Path(folder) / "run")
    recording = osc.load(Path(folder) / "run")
    tau = recording.group("tau")
    print(f"{len(tau)} ticks, {len(scenario.events)} events in the file")
    print(f"largest step of the torque: {np.abs(np.diff(tau, axis=0)).max():.3f} N·m per ms")
