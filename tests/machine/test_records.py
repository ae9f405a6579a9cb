"""Records follow from their tables: memory, handles, what is shared, what a report keeps, the page."""

import importlib
import re
from pathlib import Path

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.kernels.columns import OPTION_SIZE
from opspace.machine.field_table import LIVES, WRITERS
from opspace.machine.jit import UNCOUNTED
from opspace.machine.lanes import LANES
from opspace.plan.memory import Reported, Sizes, make_tick
from opspace.plan.records import BOUNDS, INERTIA, SIZES, SPACE, TABLES, TICK
from opspace.robots import load_robot
from opspace.robots.motor_range import MotorRange

DOCS = Path(__file__).parents[2] / "docs"
MOTORS = MotorRange(np.ones(6), np.zeros(6))
NUMBERS = {name: i for i, name in enumerate(SIZES, start=2)}
by_table = pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)


def made(table, sizes=NUMBERS):
    return table.make(sizes, {f.name: made(f.of, sizes) for f in table.fields if f.of})


def arrays_of(table, record):
    return [(f, getattr(record, f.name)) for f in table.fields if f.of is None]


def compiled_exchange(table):
    """A compiled function that reads the last number of each array, and overwrites the first."""
    lines = ["def exchange(record, last):"]
    for i, field in enumerate(f for f in table.fields if f.of is None):
        end, begin = (", ".join([x] * len(field.shape)) for x in ("-1", "0"))
        lines.append(f"    last[{i}] = record.{field.name}[{end}]")
        lines.append(f"    record.{field.name}[{begin}] = -{i} - 1")
    space = {}
    exec("\n".join(lines), space)
    return numba.njit(**UNCOUNTED)(space["exchange"])


@by_table
def test_compiled_code_reads_and_writes_every_field(table):
    record = made(table)
    fields = arrays_of(table, record)
    for i, (_, array) in enumerate(fields):
        array[...] = 0
        array.flat[-1] = i + 1
    handle, last = record.handle(), np.zeros(len(fields))
    compiled_exchange(table)(handle, last)
    for i, (field, array) in enumerate(fields):
        expected = np.zeros(array.shape)
        expected.flat[-1] = i + 1
        expected.flat[0] = -i - 1
        read = last[i] if array.size > 1 else i + 1
        assert (field.name, read) == (field.name, i + 1)
        np.testing.assert_array_equal(array, expected, err_msg=field.name)


def extent(size, sizes):
    """What a size in a shape comes to."""
    found = eval(re.sub(r"(\d) ", r"\1 * ", size.removeprefix("whole ")), {}, sizes)
    return -(-found // LANES) * LANES if size.startswith("whole ") else found


@by_table
@given(numbers=st.lists(st.integers(0, 5), min_size=len(SIZES), max_size=len(SIZES)))
@settings(max_examples=20)
def test_arrays_have_the_shape_type_and_start_of_their_fields(table, numbers):
    sizes = dict(zip(SIZES, numbers, strict=True))
    for field, array in arrays_of(table, made(table, sizes)):
        shape = [extent(str(size), sizes) for size in field.shape]
        assert (array.shape, array.dtype) == (tuple(shape), field.dtype), field.name
        assert (array == field.start).all(), field.name


@by_table
def test_a_table_says_everything(table):
    names = [field.name for field in table.fields]
    assert len(set(names)) == len(names)
    for field in table.fields:
        assert field.of is not None or field.meaning
        assert set(field.writer.split(", ")) <= WRITERS.keys(), field.name
        assert field.lives in LIVES, field.name
        words = re.findall(r"[a-z_]+", " ".join(map(str, field.shape)))
        assert set(words) <= SIZES.keys(), field.name


def test_every_record_within_a_record_is_a_table_of_its_own():
    assert {f.of.name for table in TABLES for f in table.fields if f.of} < {t.name for t in TABLES}


def test_what_is_given_is_shared_and_tells_the_sizes_that_are_not_said():
    L = np.ones((4, 8))
    record = INERTIA.make({}, {"end": np.ones(4, np.int64), "L": L})
    assert record.L is L
    assert record.before.shape == record.end.shape == (4,)
    assert record.white.shape == (4, 8)


@pytest.mark.parametrize(
    ("given_", "offender"),
    [
        ({"V": np.zeros((3, 3))}, "'V'.*L, white, spare, product, before, start, end"),
        ({"L": np.zeros((3, 3))}, r"Inertia\.L"),
        ({"L": np.zeros(3)}, r"Inertia\.L"),
        ({"end": np.zeros(3)}, r"Inertia\.end.*float64"),
        ({"end": np.zeros(2, np.int64)}, r"Inertia\.end"),
        ({"end": made(BOUNDS)}, r"Inertia\.end is Bounds"),
    ],
)
def test_what_does_not_belong_is_refused_by_name(given_, offender):
    with pytest.raises(ValueError, match=offender):
        INERTIA.make({"n": 3}, given_)


def test_a_record_or_size_that_is_missing_is_named():
    with pytest.raises(ValueError, match=r"Space\.inertia.*Inertia"):
        SPACE.make(NUMBERS)
    with pytest.raises(ValueError, match=r"'n'.*rows"):
        INERTIA.make({"rows": 1})
    with pytest.raises(ValueError, match=r"Space\.inertia.*float64"):
        SPACE.make(NUMBERS, {"inertia": np.zeros(3)})


sizes = st.integers(0, 3)


@given(sizes, sizes, sizes, sizes, sizes, sizes)
@settings(max_examples=20)
def test_one_copy_keeps_all_that_is_reported_and_nothing_else(tasks, rows, more, levels, limits, v):
    size = Sizes(
        n=6, tasks=tasks, rows=rows, slot_rows=rows + more, slots=tasks + more, levels=levels,
        variables=tasks + v, limits=limits, corners=2,
    )  # fmt: skip
    axes = load_robot("puma560").motion_axes()
    tick, memory = make_tick(size, axes, MOTORS, np.zeros(OPTION_SIZE))
    memory[:] = np.arange(memory.size)
    found = Reported(size, memory.tobytes())
    kept = 0
    for table, record in ((TICK, tick), (SPACE, tick.space)):
        for field, array in arrays_of(table, record):
            inside = np.shares_memory(array, memory)
            assert inside == (field.lives == "reported" and array.size > 0), field.name
            if field.lives == "reported":
                np.testing.assert_array_equal(found[field.name], array)
                assert found.numbers(field.name) == tuple(array.reshape(-1).tolist())
                kept += array.size
    assert kept == memory.size


def test_a_tick_shares_with_its_walk_and_its_robot():
    axes = load_robot("puma560").motion_axes()
    size = Sizes(6, *[1] * 8)
    option = np.zeros(OPTION_SIZE)
    tick, _ = make_tick(size, axes, MOTORS, option)
    assert tick.torque_limit is tick.space.limit
    assert not np.shares_memory(tick.torque_limit, MOTORS.limit)
    assert tick.inertia is tick.space.inertia
    assert tick.option is option
    for name in ("q", "v", "M", "bias", "axes", "placement", "bodies", "dynamics"):
        assert getattr(tick, name) is getattr(axes, name)


def test_a_record_shows_its_fields_and_has_no_others():
    record = made(INERTIA)
    assert repr(record) == "Inertia(L, white, spare, product, before, start, end)"
    assert [x is getattr(record, f.name) for x, f in zip(record, INERTIA.fields, strict=True)]
    with pytest.raises(AttributeError):
        record.inverted


def test_the_page_is_what_the_tables_say(monkeypatch):
    monkeypatch.syspath_prepend(DOCS / "evidence")
    page = importlib.import_module("records").page()
    assert (DOCS / "reference" / "records.md").read_text("utf-8") == page, (
        "python docs/evidence/records.py writes it"
    )
    for table in TABLES:
        assert all(f"| `{field.name}` |" in page for field in table.fields)
