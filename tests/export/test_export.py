"""What is exported is read back with the other program's own reader: every row, every column."""

import csv
import json
import math
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from opspace.errors import InputError, UnknownNameError
from opspace.export import FORMATS, export
from opspace.export.to_mcap import topics_of
from opspace.record import Column, Recorder, load

NAMES = {
    "t": "s",
    "q/joint 1": "rad",
    "q/left/elbow": "rad",
    "tau/joint-2": "N·m",
    "tool/x": "m",
    "tool/y": "m",
    "tool/z": "m",
    "tasks/position/activation": "1",
    "tasks/position/error/0": "m",
    "tasks/a, b/error/0": "rad",
    "levels/1.5/sigma/0": "1",
    "limits/joint1/upper": "1",
    "tasks/none": "1",
    "status": "1",
}
T = 1203


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Numbers of all sizes, some missing, some infinite, from a run that was stopped."""
    rng = np.random.default_rng(5)
    data = rng.normal(size=(T, len(NAMES))) * 10.0 ** rng.integers(-300, 300, (T, len(NAMES)))
    data[:, 0] = 0.001 * np.arange(T) + 1.0 / 3.0
    data[:, 4:7] = rng.normal(size=(T, 3))
    data[100:900, 7:10] = np.nan
    data[5, 3], data[6, 3], data[7, 4] = np.inf, -np.inf, np.nan
    data[8, 1], data[9, 1] = -0.0, 5e-324
    directory = tmp_path_factory.mktemp("runs") / "run"
    columns = [Column(name, unit, f"what {name} is") for name, unit in NAMES.items()]
    header = {"seed": 7, "scenario": {"robot": "puma560", "note": "für"}}
    with Recorder(directory, columns, header) as recorder:
        for row in data:
            recorder.append(row)
        recorder.close("stopped", "too fast")
    return load(directory)


def read_csv(path):
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    return head, np.array([[float(value) for value in row] for row in rows])


def read_mcap(path):
    """The names of columns, what the readers see of each row, and log times in seconds."""
    from mcap.reader import make_reader

    rows = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert message.publish_time == message.log_time
            values = rows.setdefault(message.sequence, {"log_time": message.log_time})
            values |= flat(channel.topic, json.loads(message.data, parse_constant=refuse))
    return [rows[i] for i in range(len(rows))]


def refuse(word):
    raise AssertionError(f"{word} is no JSON")


def flat(prefix, message):
    found = {}
    for key, value in message.items():
        name = f"{prefix}/{key}"
        found |= flat(name, value) if isinstance(value, dict) else {name: value}
    return found


def rrd_reader(path):
    # Versions for Python 3.10 write files, but have no such reader.
    return pytest.importorskip("rerun.chunk").RrdReader(path)


def read_rerun(path):
    """The scalars and times of each path, and the stores in the file."""
    reader = rrd_reader(path)
    reader.store()  # has an index: nothing is missing at the end
    times, values, static = {}, {}, {}
    for chunk in reader.stream():
        batch = chunk.to_record_batch()
        if chunk.is_static:
            static.setdefault(chunk.entity_path, {}).update(batch.to_pydict())
        elif "Scalars:scalars" in batch.schema.names:
            column = batch.column("Scalars:scalars").flatten().to_numpy()
            values.setdefault(chunk.entity_path, []).append(column)
            times.setdefault(chunk.entity_path, []).append(batch.column("t").cast("int64"))
    values = {path: np.concatenate(parts) for path, parts in values.items()}
    times = {path: np.concatenate(parts) for path, parts in times.items()}
    return times, values, static, reader


def same_bits(a, b):
    return np.asarray(a, dtype=float).tobytes() == np.asarray(b, dtype=float).tobytes()


def test_csv_holds_every_bit(run, tmp_path):
    head, data = read_csv(export(run, tmp_path / "new" / "run.csv"))
    assert head == [f"{name} [{unit}]" for name, unit in NAMES.items()]
    assert np.array_equal(np.isnan(data), np.isnan(run.data))
    kept = ~np.isnan(run.data)
    assert same_bits(data[kept], run.data[kept])


def test_mcap_holds_every_bit_of_what_json_can_say(run, tmp_path):
    rows = read_mcap(export(run, tmp_path / "run.mcap"))
    assert len(rows) == T
    for i, row in enumerate(rows):
        assert row.pop("log_time") == round(run.t[i] * 1e9)
        finite = [k for k in range(len(NAMES)) if math.isfinite(run.data[i, k])]
        names = [f"/{run.names[k]}" for k in finite]
        names = [f"/tick{name}" if name.count("/") == 1 else name for name in names]
        assert sorted(row) == sorted(names)
        assert same_bits([row[name] for name in names], run.data[i, finite])


def test_mcap_has_a_topic_per_group_whose_schema_says_units(run, tmp_path):
    from mcap.reader import make_reader

    with export(run, tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        (metadata,) = reader.iter_metadata()
    channels = {channel.topic: channel for channel in summary.channels.values()}
    assert set(channels) == {
        *("/tick", "/q", "/tau", "/tool", "/tasks/position", "/tasks/a, b", "/tasks"),
        *("/levels/1.5", "/limits"),
    }
    described = {}
    for channel in channels.values():
        assert channel.message_encoding == "json"
        assert summary.statistics.channel_message_counts[channel.id] == T
        schema = summary.schemas[channel.schema_id]
        assert schema.encoding == "jsonschema"
        content = json.loads(schema.data)
        assert (content["type"], content["title"]) == ("object", schema.name)
        described |= dict(leaves(content))
    assert set(described) == set(NAMES)
    for name, unit in NAMES.items():
        assert described[name] == f"what {name} is [{unit}]"
    assert metadata.name == "recording"
    found = metadata.metadata
    assert (found["ended"], found["reason"], found["seed"]) == ("stopped", "too fast", "7")
    assert json.loads(found["scenario"]) == run.header["scenario"]
    assert json.loads(found["versions"]) == run.header["versions"]


def leaves(schema):
    for part in schema["properties"].values():
        if part["type"] == "object":
            yield from leaves(part)
        else:
            assert part["type"] == "number"
            yield part["title"], part["description"]


def test_rerun_holds_every_bit(run, tmp_path):
    from opspace.export.to_rerun import entity

    times, values, static, reader = read_rerun(export(run, tmp_path / "run.rrd"))
    assert set(values) == {entity(name) for name in NAMES}
    for name, unit in NAMES.items():
        path = entity(name)
        assert same_bits(values[path], run[name])
        assert np.array_equal(times[path], np.rint(run.t * 1e9))
        assert static[path]["SeriesLines:names"] == [[f"{name} [{unit}]"]]
        assert static[path]["description"] == [[f"what {name} is"]]
    assert static["/__properties/opspace"]["ended"] == [["stopped"]]
    assert static["/__properties"]["RecordingInfo:name"] == [["run"]]
    assert len(reader.recordings()) == len(reader.blueprints()) == 1


def test_rerun_shows_the_way_of_the_tool(run, tmp_path):
    tool = run.group("tool")
    found = {}
    for chunk in rrd_reader(export(run, tmp_path / "run.rrd")).stream():
        for name, column in chunk.to_record_batch().to_pydict().items():
            found[chunk.entity_path, name] = column
    (strip,) = found["/world/path", "LineStrips3D:strips"]
    assert np.array_equal(strip[0], np.delete(tool, 7, axis=0).astype(np.float32))
    points = np.array(found["/world/tool", "Points3D:positions"])[:, 0]
    assert np.array_equal(points, tool.astype(np.float32), equal_nan=True)


@pytest.mark.parametrize("to", FORMATS)
def test_a_recording_without_a_tick_or_a_tool_is_exported(to, tmp_path):
    Recorder(tmp_path / "run", [Column("t", "s"), Column("x", "1")], {}).close()
    path = export(load(tmp_path / "run"), tmp_path / f"run{FORMATS[to]}")
    if to == "csv":
        assert path.read_text() == "t [s],x [1]\n"
    elif to == "mcap":
        assert read_mcap(path) == []
    else:
        assert len(read_rerun(path)[3].recordings()) == 1


@pytest.mark.parametrize("to", FORMATS)
def test_progress_ends_at_the_end(run, to, tmp_path):
    seen = []
    export(run, tmp_path / f"run{FORMATS[to]}", progress=lambda done, of: seen.append((done, of)))
    assert seen == sorted(seen)
    assert len(seen) > 1
    assert seen[-1][0] == seen[-1][1]


# -- whole or not at all --------------------------------------------------------------------------


@pytest.mark.parametrize("to", FORMATS)
def test_a_file_is_replaced_only_on_request(run, to, tmp_path):
    path = tmp_path / "other.name"
    path.write_text("mine")
    with pytest.raises(InputError, match=r"other\.name already exists"):
        export(run, path, to)
    assert path.read_text() == "mine"
    export(run, path, to, overwrite=True)
    assert path.stat().st_size > 10_000


@pytest.mark.parametrize("to", FORMATS)
def test_an_interrupted_export_leaves_what_was_there(run, to, tmp_path):
    path = tmp_path / "run.out"
    path.write_text("old")

    def interrupt(done, of):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(run, path, to, overwrite=True, progress=interrupt)
    assert [p.name for p in tmp_path.iterdir()] == ["run.out"]
    assert path.read_text() == "old"


def test_a_full_disk_leaves_no_half_file(run, tmp_path):
    """The limit on file size stands for the disk."""
    script = f"""
        import resource, signal, sys
        from pathlib import Path
        from opspace.errors import InputError
        from opspace.export import FORMATS, export
        from opspace.record import load
        import mcap, rerun
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        run = load({str(run.directory)!r})
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
        for ending in FORMATS.values():
            try:
                export(run, Path({str(tmp_path)!r}) / f"run{{ending}}")
            except InputError as error:
                print(error)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=True
    )
    for ending in FORMATS.values():
        assert f"run{ending} cannot be written: File too large" in done.stdout
    assert not list(tmp_path.iterdir())


def test_places_that_cannot_be_written_are_named(run, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file/run\.csv cannot be written"):
        export(run, tmp_path / "file" / "run.csv")
    with pytest.raises(InputError, match="is a directory"):
        export(run, tmp_path, "csv")


def test_unknown_formats_are_named(run, tmp_path):
    with pytest.raises(UnknownNameError, match=r"format 'mcp'; did you mean 'mcap'"):
        export(run, tmp_path / "run.mcap", "mcp")
    with pytest.raises(UnknownNameError, match=r"run\.bag '\.bag'.*valid: \.mcap, \.rrd, \.csv"):
        export(run, tmp_path / "run.bag")


@pytest.mark.parametrize("to", ["mcap", "rerun"])
@pytest.mark.parametrize("bad", [-0.001, np.nan, np.inf, 1e10])
def test_a_time_that_no_clock_shows_is_named(to, bad, tmp_path):
    with Recorder(tmp_path / "run", [Column("t", "s")], {}) as recorder:
        recorder.append([0.0])
        recorder.append([bad])
    with pytest.raises(InputError, match=rf"run: t = {bad} s in row 1".replace("+", r"\+")):
        export(load(tmp_path / "run"), tmp_path / "out", to)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("names", [("a/b", "a/b/c"), ("a/b/c", "a/b")])
def test_a_column_with_the_name_of_a_group_is_refused_by_json_only(names, tmp_path):
    columns = [Column("t", "s"), *(Column(name, "1") for name in names)]
    with Recorder(tmp_path / "run", columns, {}) as recorder:
        recorder.append([0.0, 1.0, 2.0])
    run = load(tmp_path / "run")
    with pytest.raises(InputError, match=r"column 'a/b.*' cannot be told from a group"):
        export(run, tmp_path / "run.mcap")
    _, values, _, _ = read_rerun(export(run, tmp_path / "run.rrd"))
    assert {name: values[f"/{name}"].tolist() for name in names} == dict(
        zip(names, ([1.0], [2.0]), strict=True)
    )


def test_every_column_is_in_one_topic():
    columns = [Column(name, unit) for name, unit in NAMES.items()]
    fields = [field for fields in topics_of(columns).values() for field in fields]
    assert sorted(field.number for field in fields) == list(range(len(NAMES)))


@pytest.mark.parametrize(("package", "to"), [("mcap", "mcap"), ("rerun", "rerun")])
def test_a_missing_package_is_named_with_its_extra(package, to, run, tmp_path, monkeypatch):
    from opspace.errors import MissingExtraError

    monkeypatch.delitem(sys.modules, f"opspace.export.to_{to}", raising=False)
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=r"pip install 'opspace\[export\]'"):
        export(run, tmp_path / f"run{FORMATS[to]}")
    assert not list(tmp_path.iterdir())
