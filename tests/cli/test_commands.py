"""What each command does, prints and refuses."""

import json

import pytest
from tests.cli.test_cli import run
from tests.plots import synthetic
from tests.scenario.short import short

from opspace.export import FORMATS
from opspace.record import load
from opspace.scenario import dump_scenario

VARIANTS = ("without", "transition")
KP = "tasks.position.kp"


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text(dump_scenario(short()), encoding="utf-8")
    return path


def refused(capsys, *words):
    """The one line about bad input."""
    status, out, err = run(capsys, *words)
    assert (status, out) == (2, "")
    assert err.startswith("opspace: error: ")
    assert err.count("\n") == 1
    return err


# -- export-c --------------------------------------------------------------------------------------

HOLD = """
robot: puma560
start: home
duration: 1.0
tasks:
  orientation: {type: orientation, level: 0, target: [1.0, 0.0, 0.0, 0.0]}
  posture: {type: posture, level: 1, target: home}
"""


def test_export_c_writes_a_library(capsys, tmp_path):
    (tmp_path / "hold.yaml").write_text(HOLD)
    words = ["export-c", str(tmp_path / "hold.yaml"), "--out", str(tmp_path / "arm")]
    status, printed, err = run(capsys, *words, "--name", "arm", "--absent", "posture")
    assert (status, err) == (0, "")
    assert printed == f"results: {tmp_path / 'arm'}\n"
    assert "ARM_TASK_posture = 1" in (tmp_path / "arm" / "arm.h").read_text()
    assert "hnad" in refused(capsys, *words, "--absent", "hnad", "--overwrite")


# -- run -------------------------------------------------------------------------------------------


def test_run_writes_what_it_prints(capsys, tmp_path, scenario):
    out = tmp_path / "out"
    status, printed, err = run(
        capsys, "run", str(scenario), "--set", f"{KP}=200", "--out", str(out)
    )
    assert (status, err) == (0, "")
    assert printed.endswith(f"results: {out}\n")
    found = load(out)
    assert found.ended.how == "completed"
    assert found.header["scenario"]["tasks"]["position"]["kp"] == 200
    numbers = json.loads((out / "metrics.json").read_text())
    assert f"{numbers['max_joint_speed']:.3g}" in printed


def test_run_says_why_it_stopped(capsys, tmp_path, scenario):
    stop = ["--set", "stop.max_joint_speed=0.001"]
    status, printed, _ = run(capsys, "run", str(scenario), *stop, "--out", str(tmp_path / "out"))
    assert status == 0
    assert "stopped at 0.0" in printed


def test_run_replaces_a_recording_only_on_request(capsys, tmp_path, scenario):
    words = ["run", str(scenario), "--out", str(tmp_path / "out")]
    assert run(capsys, *words)[0] == 0
    assert "already holds a recording" in refused(capsys, *words)
    assert run(capsys, *words, "--overwrite")[0] == 0


def test_an_interrupted_run_keeps_its_rows(capsys, monkeypatch, tmp_path, scenario):
    def interrupt(self, q, v, command):
        if command.t > 0.02:
            raise KeyboardInterrupt

    monkeypatch.setattr("opspace.runs.progress.ProgressLine.observe", interrupt)
    out = tmp_path / "out"
    status, _, err = run(capsys, "run", str(scenario), "--out", str(out))
    assert (status, err) == (130, "opspace: interrupted\n")
    assert load(out).ended.how == "interrupted"
    assert len(load(out)) == 22


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("tasks.position.frame=toll", ["tasks.position.frame", "did you mean 'tool'"]),
        ("tasks.posture.joints=[joint7]", ["tasks.posture.joints[0]", "valid: joint1, joint2"]),
        ("joint_limits.joints.join1=[-1, 1]", ["joint_limits.joints", "did you mean 'joint1'"]),
        ("tasks.position.kpp=1", ["tasks.position.kpp", "did you mean 'kp'"]),
        (f"{KP}=-1", [KP, "at least 0 [1/s²], not -1"]),
        ("start=[.nan, 0, 0, 0, 0, 0]", ["start[0]", "not .nan"]),
        ("start=[0, 0]", ["start", "must have 6 numbers"]),
        ("robot=puma650", ["robot", "did you mean 'puma560'"]),
    ],
)
def test_a_wrong_value_is_named(capsys, tmp_path, scenario, override, words):
    out = tmp_path / "out"
    err = refused(capsys, "run", str(scenario), "--set", override, "--out", str(out))
    assert str(scenario) in err
    for word in words:
        assert word in err
    assert not out.exists()


@pytest.mark.parametrize("name", ["broken.urdf", "broken.xml"])
@pytest.mark.parametrize("command", ["check", "run", "reproduce"])
def test_a_robot_file_that_does_not_parse_is_named(capsys, tmp_path, scenario, name, command):
    path = tmp_path / name
    path.write_text("<robot name='arm'><link name='base'>")
    words = {
        "check": ["check", str(path)],
        "run": ["run", str(scenario), "--set", f"robot={path}"],
        "reproduce": ["reproduce", "--robot", str(path)],
    }[command]
    out = [] if command == "check" else ["--out", str(tmp_path / "out")]
    assert name in refused(capsys, *words, *out)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["run", "singularty"], "did you mean 'singularity'"),
        (["run", "nowhere.yaml"], "nowhere.yaml"),
        (
            ["reproduce", "everything"],
            "'stiffness', 'collisions', 'humanoid', 'all'",
        ),
        (["reproduce", "--robot", "ur55"], "did you mean 'ur5'"),
        (["check", "pumma"], "did you mean 'puma560'"),
        (["plot", "nowhere"], "nowhere"),
    ],
)
def test_a_wrong_name_is_named(capsys, tmp_path, monkeypatch, words, named):
    monkeypatch.chdir(tmp_path)
    assert named in refused(capsys, *words)
    assert not list(tmp_path.iterdir())


# -- plot and check --------------------------------------------------------------------------------


def test_plot_draws_columns_of_a_run(capsys, tmp_path, scenario):
    out = tmp_path / "out"
    run(capsys, "run", str(scenario), "--out", str(out))
    status, printed, err = run(capsys, "plot", str(out), "tau", "tool/x")
    assert (status, err) == (0, "")
    assert printed == f"results: {out / 'plot-tau-tool-x.png'}\n"
    assert (out / "plot-tau-tool-x.png").stat().st_size > 10_000
    assert "did you mean 'tau'" in refused(capsys, "plot", str(out), "tauu")


@pytest.mark.parametrize("overlay", [[], ["--overlay"]])
def test_plot_draws_runs_together(capsys, tmp_path, overlay):
    runs = [
        str(synthetic.write_run(tmp_path / n, "singularity", n, 0.1).directory) for n in VARIANTS
    ]
    path = tmp_path / "new" / "both.png"
    words = [runs[0], "tau", *runs[1:], "tool/x", *overlay, "--out", str(path)]
    assert run(capsys, "plot", *words) == (0, f"results: {path}\n", "")
    assert path.stat().st_size > 10_000
    assert "given twice" in refused(capsys, "plot", runs[0], runs[0])


@pytest.mark.parametrize("to", FORMATS)
def test_export_writes_beside_the_recording_once(capsys, tmp_path, to):
    directory = synthetic.write_run(tmp_path / "a", "singularity", "switch", 0.1).directory
    path = directory / f"run{FORMATS[to]}"
    words = ["export", f"{directory}/", "--to", to]
    assert run(capsys, *words) == (0, f"results: {path}\n", "")
    written = path.stat().st_size
    assert written > 10_000
    assert f"{path} already exists" in refused(capsys, *words)
    assert run(capsys, *words, "--overwrite")[0] == 0
    other = tmp_path / "new" / path.name
    assert run(capsys, "export", str(directory), "--out", str(other))[0] == 0
    assert other.stat().st_size == pytest.approx(written, rel=0.01)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ([], "--to takes mcap, rerun, csv"),
        (["--to", "mcp"], "did you mean 'mcap'"),
        (["--out", "run.bag"], "valid: .mcap, .rrd, .csv"),
        (["--to", "csv", "--out", "file/run.csv"], "file/run.csv cannot be written"),
    ],
)
def test_a_wrong_export_is_named(capsys, tmp_path, monkeypatch, words, named):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    directory = synthetic.write_run(tmp_path / "a", "singularity", "switch", 0.5).directory
    assert named in refused(capsys, "export", str(directory), *words)
    assert "there is no such directory" in refused(capsys, "export", "absent", "--to", "csv")


def test_film_writes_what_the_ending_says(capsys, tmp_path, scenario, monkeypatch):
    out = tmp_path / "out"
    run(capsys, "run", str(scenario), "--out", str(out))
    drawn = []

    def draw(recording, robot, path, **options):
        drawn.append((len(recording), robot.name, path, options["fps"], options["speed"]))

    monkeypatch.setattr("opspace.pictures.film.film", draw)
    assert run(capsys, "film", str(out)) == (0, f"results: {out / 'film.gif'}\n", "")
    words = ["film", str(out), "--out", str(tmp_path / "x.mp4"), "--speed", "2", "--fps", "5"]
    assert run(capsys, *words)[0] == 0
    ticks = len(load(out))
    assert drawn == [
        (ticks, "puma560", out / "film.gif", None, 1.0),
        (ticks, "puma560", tmp_path / "x.mp4", 5.0, 2.0),
    ]


def test_check_is_the_same_in_tables_and_json(capsys):
    found = json.loads(run(capsys, "check", "puma560", "--json")[1])
    status, printed, err = run(capsys, "check", "puma560")
    assert (status, err) == (0, "")
    for joint in found["joints"]:
        row = next(line.split() for line in printed.splitlines() if line.startswith(joint["name"]))
        assert row[2] == f"{joint['lower']:.3g}"
    for values in found["sigma"].values():
        assert ", ".join(f"{value:.3g}" for value in values) in printed
    assert f"{found['buffer'][0]:g}" in printed


def test_reproduce_prints_a_table_for_each_experiment(capsys, monkeypatch, tmp_path):
    from opspace.runs import reproduce
    from opspace.runs.experiments import VARIANTS, Experiment

    runs = {name: short(method=method) for name, method in VARIANTS.items()}
    quick = Experiment("singularity", "a moment", runs)
    monkeypatch.setattr(reproduce, "singularity", lambda robot: quick)
    monkeypatch.setenv("MUJOCO_GL", "off")
    status, printed, err = run(capsys, "reproduce", "singularity", "--out", str(tmp_path))
    assert status == 0
    assert "singularity: a moment" in printed
    assert all(name in printed for name in runs)
    assert printed.endswith(f"results: {tmp_path}\n")
    assert err.count("\n") == 1
    assert "MUJOCO_GL" in err
