"""A recording gives back what was put in, whatever happened to the process."""

import json
import resource
import signal
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from opspace.errors import InputError, MissingExtraError, RecordingError, UnknownNameError
from opspace.record import Column, Recorder, load

COLUMNS = (
    Column("t", "s", "time"),
    Column("q/joint1", "rad"),
    Column("q/joint2", "rad"),
    Column("tau/joint1", "N·m", "commanded torque"),
    Column("tasks/position/error/0", "m"),
)


def write(directory, rows, header=None, **options):
    with Recorder(directory, COLUMNS, header or {}, **options) as recorder:
        for row in rows:
            recorder.append(row)


def rows_of(count):
    return np.random.default_rng(3).normal(size=(count, len(COLUMNS)))


@settings(max_examples=30)  # each writes files
@given(hnp.arrays(np.float64, st.tuples(st.integers(0, 8), st.just(len(COLUMNS)))))
def test_every_bit_comes_back(rows):
    """Also infinities and every payload of NaN."""
    with tempfile.TemporaryDirectory() as directory:
        write(directory, rows)
        recording = load(directory)
    assert recording.data.tobytes() == rows.tobytes()
    assert len(recording) == len(rows)
    assert recording.ended.how == "completed"


def test_columns_are_found_by_name_and_group(tmp_path):
    rows = rows_of(5)
    write(tmp_path, rows)
    recording = load(tmp_path)
    assert tuple(recording) == recording.names == tuple(column.name for column in COLUMNS)
    assert recording.columns == COLUMNS
    assert recording.units["tau/joint1"] == "N·m"
    assert np.array_equal(recording.t, rows[:, 0])
    assert np.array_equal(recording["tau/joint1"], rows[:, 3])
    assert np.array_equal(recording.group("q"), rows[:, 1:3])
    assert recording.members("tasks/position") == ("tasks/position/error/0",)
    assert "q/joint1" in recording
    assert "q" not in recording


def test_a_recording_cannot_be_changed_by_accident(tmp_path):
    write(tmp_path, rows_of(2))
    recording = load(tmp_path)
    with pytest.raises(ValueError, match="read-only"):
        recording["t"][0] = 1.0
    with pytest.raises(TypeError):
        recording.header["seed"] = 1


@pytest.mark.parametrize(("name", "near"), [("q/joint3", "q/joint1"), ("tua/joint1", "tau/joint1")])
def test_an_unknown_column_names_near_ones(tmp_path, name, near):
    write(tmp_path, rows_of(1))
    with pytest.raises(UnknownNameError, match=f"(?s){name}.*did you mean.*{near}"):
        load(tmp_path)[name]


def test_an_unknown_group_names_the_groups(tmp_path):
    write(tmp_path, rows_of(1))
    with pytest.raises(UnknownNameError, match=r"valid: q, tau, tasks, tasks/position"):
        load(tmp_path).group("v")


def test_the_header_holds_what_was_put_in_and_the_versions(tmp_path):
    scenario = {"robot": "puma560", "tasks": {"position": {"kp": 100.0}}}
    write(tmp_path, rows_of(1), {"scenario": scenario, "seed": 7})
    header = load(tmp_path).header
    assert header["scenario"] == scenario
    assert header["seed"] == 7
    assert header["versions"]["numpy"] == np.__version__
    assert set(header["versions"]) >= {"opspace", "python", "mujoco", "pinocchio"}


def test_the_same_run_gives_the_same_bytes(tmp_path):
    for name in ("first", "second"):
        write(tmp_path / name, rows_of(4), {"scenario": {"b": 1, "a": 2}})
    for name in ("header.json", "data.f64", "end.json"):
        first, second = (tmp_path / run / name for run in ("first", "second"))
        assert first.read_bytes() == second.read_bytes()


# -- how a run can end ----------------------------------------------------------------------------

ENDLESS = """
    import signal
    import sys
    import numpy as np
    from opspace.record import Column, Recorder
    # Whoever runs the tests in the background has it ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    columns = [Column("t", "s")] + [Column(f"x/{i}", "1") for i in range(40)]
    with Recorder(sys.argv[1], columns, {}) as recorder:
        k = 0
        while True:
            recorder.append(np.full(41, float(k)) + np.arange(41))
            k += 1
            if k == 200:
                print("ready", flush=True)
"""


@pytest.mark.parametrize(
    ("sent", "how"), [(signal.SIGKILL, "unfinished"), (signal.SIGINT, "interrupted")]
)
def test_a_killed_process_loses_nothing(tmp_path, sent, how):
    run = tmp_path / "run"
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(ENDLESS), str(run)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as process:
        assert process.stdout.readline() == b"ready\n"
        process.send_signal(sent)
        try:
            process.wait(10)
        finally:
            process.kill()
    recording = load(run)
    assert recording.ended.how == how
    assert len(recording) >= 200
    assert np.array_equal(
        recording.data, np.arange(len(recording))[:, None] + np.arange(41.0)[None, :]
    )


def test_a_row_cut_short_is_dropped(tmp_path):
    rows = rows_of(6)
    recorder = Recorder(tmp_path, COLUMNS, {})
    for row in rows:
        recorder.append(row)
    content = (tmp_path / "data.f64").read_bytes()
    for cut in range(1, 8 * len(COLUMNS)):
        (tmp_path / "data.f64").write_bytes(content[:-cut])
        recording = load(tmp_path)
        assert np.array_equal(recording.data, rows[:-1])
        assert recording.ended.how == "unfinished"
    recorder.close()


@pytest.mark.parametrize(
    ("error", "how", "reason"),
    [
        (KeyboardInterrupt(), "interrupted", ""),
        (ZeroDivisionError("by zero"), "crashed", "ZeroDivisionError: by zero"),
    ],
)
def test_an_exception_is_recorded_and_passed_on(tmp_path, error, how, reason):
    rows = rows_of(3)

    def crash():
        with Recorder(tmp_path, COLUMNS, {}) as recorder:
            for row in rows:
                recorder.append(row)
            raise error

    with pytest.raises(type(error)):
        crash()
    recording = load(tmp_path)
    assert (recording.ended.how, recording.ended.reason, recording.ended.rows) == (how, reason, 3)
    assert np.array_equal(recording.data, rows)


def test_the_first_word_on_the_end_stands(tmp_path):
    with Recorder(tmp_path, COLUMNS, {}) as recorder:
        recorder.append(rows_of(1)[0])
        recorder.close("stopped", "joint3 faster than 20 rad/s")
    assert load(tmp_path).ended.how == "stopped"
    assert load(tmp_path).ended.reason == "joint3 faster than 20 rad/s"
    with pytest.raises(RecordingError, match="closed"):
        recorder.append(rows_of(1)[0])


def test_a_full_disk_keeps_every_whole_row(tmp_path):
    """The limit on file size falls in the middle of a row."""
    rows = rows_of(100)
    limit = 8 * len(COLUMNS) * 20 + 12
    script = f"""
        import resource, signal, sys
        import numpy as np
        from opspace.errors import RecordingError
        from opspace.record import Column, Recorder
        columns = [Column(f"x/{{i}}", "1") for i in range({len(COLUMNS)})]
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        with Recorder(sys.argv[1], columns, {{}}) as recorder:
            resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {resource.RLIM_INFINITY}))
            rows = np.random.default_rng(3).normal(size=(100, {len(COLUMNS)}))
            try:
                for row in rows:
                    recorder.append(row)
            except RecordingError as error:
                print(error)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script), str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "data.f64 cannot be written" in done.stdout
    recording = load(tmp_path)
    assert np.array_equal(recording.data, rows[:20])
    assert recording.ended.how == "crashed"


# -- what is refused ------------------------------------------------------------------------------


def test_a_recording_is_not_overwritten_unless_asked(tmp_path):
    write(tmp_path, rows_of(3))
    with pytest.raises(RecordingError, match=r"already holds a recording"):
        write(tmp_path, rows_of(1))
    assert len(load(tmp_path)) == 3
    write(tmp_path, rows_of(1), overwrite=True)
    assert len(load(tmp_path)) == 1


def test_a_file_in_the_way_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    for place in ("file", "file/below"):
        with pytest.raises(RecordingError, match=str(tmp_path / place)):
            write(tmp_path / place, rows_of(1))


@pytest.mark.parametrize("row", [np.zeros(4), np.zeros((1, 5)), 1.0, ["a"] * 5, [None, []]])
def test_a_row_that_does_not_fit_is_refused(tmp_path, row):
    recorder = Recorder(tmp_path, COLUMNS, {})
    with pytest.raises(InputError, match="a row of"):
        recorder.append(row)
    recorder.close()
    assert len(load(tmp_path)) == 0


@pytest.mark.parametrize(
    ("columns", "header", "message"),
    [
        ([], {}, "at least one column"),
        ([Column("t", "s"), Column("t", "s")], {}, "'t' is given twice"),
        ([Column("t", "s")], {"columns": []}, "'columns' is written by the recorder"),
        ([Column("t", "s")], {"scenario": {"x": float("nan")}}, "header.json"),
        ([Column("t", "s")], {"scenario": object()}, "header.json"),
    ],
)
def test_a_description_that_cannot_be_kept_is_refused_and_leaves_no_recording(
    tmp_path, columns, header, message
):
    with pytest.raises(InputError, match=message):
        Recorder(tmp_path, columns, header)
    write(tmp_path, rows_of(1))


@pytest.mark.parametrize(
    ("name", "unit"), [("", "s"), ("/1", "rad"), ("q/", "rad"), ("q/\n", "rad"), ("q", " ")]
)
def test_a_column_needs_a_name_and_a_unit(name, unit):
    with pytest.raises(InputError, match=r"column"):
        Column(name, unit)


def damage_json(path, **changes):
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, **changes}))


DAMAGE = {
    "header cut": ("header.json", lambda p: p.write_text(p.read_text()[:-20])),
    "header binary": ("header.json", lambda p: p.write_bytes(b"\xff\x00")),
    "header a list": ("header.json", lambda p: p.write_text("[]")),
    "another format": ("header.json", lambda p: damage_json(p, format="else")),
    "another version": ("header.json", lambda p: damage_json(p, format_version=99)),
    "bad columns": ("header.json", lambda p: damage_json(p, columns=[{"name": "t"}])),
    "no columns": ("header.json", lambda p: damage_json(p, columns=[])),
    "no data": ("data.f64", Path.unlink),
    "data lost": ("data.f64", lambda p: p.write_bytes(p.read_bytes()[:-1])),
    "end cut": ("end.json", lambda p: p.write_text("{")),
    "end unknown": ("end.json", lambda p: damage_json(p, ended="well")),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damage_is_reported_with_the_file(tmp_path, kind):
    write(tmp_path, rows_of(3))
    name, damage = DAMAGE[kind]
    damage(tmp_path / name)
    with pytest.raises(RecordingError, match=str(tmp_path / name)):
        load(tmp_path)


# -- where a recording is looked for --------------------------------------------------------------


@pytest.mark.parametrize("ending", ["", "/", "/.", "/data.f64", "/header.json", "/end.json"])
@pytest.mark.parametrize("kind", [str, Path])
def test_a_recording_is_found_however_it_is_named(tmp_path, ending, kind):
    write(tmp_path / "run", rows_of(2))
    found = load(kind(f"{tmp_path}/run{ending}"))
    assert np.array_equal(found.data, rows_of(2))
    assert found.directory == tmp_path / "run"


def test_what_is_no_recording_is_named_and_near_ones_are_told(tmp_path):
    write(tmp_path / "results" / "a", rows_of(1))
    (tmp_path / "results" / "notes.txt").write_text("")
    with pytest.raises(RecordingError, match=r"absent: there is no such directory"):
        load(tmp_path / "absent")
    with pytest.raises(RecordingError, match=r"notes\.txt is not a recording"):
        load(tmp_path / "results" / "notes.txt")
    with pytest.raises(RecordingError, match=rf"recordings below it: {tmp_path}/results/a$"):
        load(tmp_path / "results")


# -- pandas ---------------------------------------------------------------------------------------


def test_pandas_gets_every_number_with_time_and_units(tmp_path):
    rows = rows_of(4)
    rows[1, 2], rows[2, 3] = np.nan, np.inf
    write(tmp_path, rows)
    frame = load(tmp_path).to_pandas()
    assert frame.index.name == "t [s]"
    assert np.array_equal(frame.index.to_numpy(), rows[:, 0])
    assert list(frame.columns) == [column.name for column in COLUMNS[1:]]
    assert frame.to_numpy().tobytes() == rows[:, 1:].tobytes()
    assert frame.attrs["units"] == {column.name: column.unit for column in COLUMNS[1:]}
    frame["q/joint1"] *= 2.0  # it is a copy
    assert np.array_equal(load(tmp_path).data[:, 1], rows[:, 1])


def test_pandas_is_named_with_its_extra_where_it_is_missing(tmp_path, monkeypatch):
    write(tmp_path, rows_of(1))
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"pandas .* 'opspace\[export\]'"):
        load(tmp_path).to_pandas()
