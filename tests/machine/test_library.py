"""Every process loads the same compiled object; one of them compiles it, once."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from opspace.machine import kept_object, processor
from opspace.machine.processor import SHIPPED, host
from opspace.machine.sources import stamp
from opspace.plan import entries
from opspace.plan.entries import ENTRIES
from opspace.record import load

SMALL = """
import numpy as np
from opspace.machine.kernel_entry import KernelEntry
from opspace.machine.field_table import Field, RecordTable
from opspace.machine.library import Library

NUMBERS = RecordTable(
    "Numbers", "", Field("x", ("n",), "some numbers"), Field("total", (1,), "their sum")
)
ENTRIES = (
    KernelEntry("small_kernels", "add", (float, NUMBERS, int), gives=int),
    KernelEntry("small_kernels", "clear", (NUMBERS,), releases=True),
)
LIBRARY = Library("small", ENTRIES)
"""
KERNELS = """
from opspace.machine.jit import jit

@jit
def add(more, work, times):
    for i in range(work.x.shape[0]):
        work.total[0] += times * work.x[i] + more
    return work.x.shape[0]

@jit
def clear(work):
    work.total[0] = 0.0
"""
START = """
import sys
import small
sys.executable = {python!r}
numbers = small.NUMBERS.make({{}}, {{"x": small.np.arange(4.0)}})
address = numbers.handle().address
count = small.LIBRARY["add"](0.5, address, 10)
before = numbers.total[0]
small.LIBRARY["clear"](address)
print(count, before, numbers.total[0], "numba" in sys.modules)
"""
PROGRAM = START.format(python=sys.executable)
LOADED, COMPILED_HERE = ["4", "62.0", "0.0", "False"], ["4", "62.0", "0.0", "True"]
RUN = "from opspace.cli import main; main()"


@pytest.fixture
def empty(tmp_path):
    """Run a program that finds nothing compiled in its first call, what the first left in the next."""
    (tmp_path / "small.py").write_text(SMALL)
    (tmp_path / "small_kernels.py").write_text(KERNELS)
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "kept"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]),
    }

    def start(*words, **more):
        return subprocess.run(
            [sys.executable, *words],
            env=environment | more,
            capture_output=True,
            text=True,
            check=True,
        )

    return start


def objects(place):
    return sorted(place.rglob("*.o"))


def test_one_process_compiles_and_every_other_loads_that_without_a_compiler(empty, tmp_path):
    first, second = (empty("-c", PROGRAM) for _ in range(2))
    assert first.stdout.split() == second.stdout.split() == LOADED
    assert "compiled the control tick" in first.stderr
    assert "it is kept" in first.stderr
    assert not second.stderr
    assert len(objects(tmp_path)) == 1


def test_two_compiles_give_the_same_object(empty, tmp_path):
    for name in ("one", "other"):
        empty("-c", PROGRAM, NUMBA_CACHE_DIR=str(tmp_path / name))
    one, other = (path.read_bytes() for path in objects(tmp_path))
    assert one == other


def test_two_processes_may_compile_at_once(empty, tmp_path):
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda _: empty("-c", PROGRAM), range(2)))
    assert [one.stdout.split() for one in both] == [LOADED, LOADED]
    assert len(objects(tmp_path)) == len(list((tmp_path / "kept").iterdir())) == 1
    assert not empty("-c", PROGRAM).stderr


def test_paths_may_be_anything_and_settings_of_numba_are_for_the_users_functions(empty):
    own = "import pathlib, sys; sys.path.append(pathlib.Path('somewhere'))\n"
    assert empty("-c", own + PROGRAM, NUMBA_DISABLE_JIT="1").stdout.split() == LOADED


def test_what_the_other_process_says_is_of_no_importance(empty, tmp_path):
    noise = "import sys; sys.stderr.buffer.write(bytes([0xE9])); print('noise', flush=True)\n"
    (tmp_path / "small_kernels.py").write_text(noise + KERNELS)
    program = "import io, sys; sys.stderr = io.TextIOWrapper(io.BytesIO())\n" + PROGRAM
    assert empty("-c", program).stdout.split() == LOADED


@pytest.mark.parametrize("python", ["", "/opt/somewhere/robot-studio", "/nowhere/python3"])
def test_without_another_process_it_compiles_by_itself(empty, python):
    assert empty("-c", START.format(python=python)).stdout.split() == COMPILED_HERE
    assert empty("-c", START.format(python=python)).stdout.split() == LOADED


FROZEN = """
import ctypes
import small
from llvmlite import binding as llvm
from opspace.machine.freeze import Frozen
from opspace.machine.processor import host
from opspace.plan.image import image
numbers = small.NUMBERS.make({}, {"x": small.np.arange(4.0)})
found = image(numbers.handle())
constants = ((found.first["x"], 4),)
roots = {"Numbers": found.handle}
frozen = Frozen(("add",), found.words, found.addresses, found.handles, roots, constants, True)
content = small.LIBRARY.object_for(frozen)
llvm.initialize_native_target()
llvm.initialize_native_asmprinter()
engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), host().machine())
engine.add_object_file(llvm.ObjectFileRef.from_data(content))
engine.finalize_object()
add = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_int64)(
    engine.get_function_address("opspace_add")
)
count = [add(0.5, None, 10) for _ in range(2)][0]
place = engine.get_global_value_address("opspace_memory")
memory = (ctypes.c_double * found.words.size).from_address(place)
said = ctypes.string_at(engine.get_global_value_address("opspace_stamp")).decode()
assert said == f"{small.LIBRARY.stamp}-{frozen.stamp}"
assert engine.get_function_address("opspace_clear") == 0
print(count, memory[found.first["total"]], memory[found.first["x"] + 1], numbers.total[0])
"""


def test_functions_for_one_record_alone_have_its_memory_and_know_its_numbers(empty):
    assert empty("-c", FROZEN).stdout.split() == ["4", "124.0", "0.0", "0.0"]


MAKE_TO_SHIP = """
import pathlib, sys
import small
place = pathlib.Path(sys.argv[1], "machine", "objects")
place.mkdir(parents=True)
for name, content in small.LIBRARY.to_ship().items():
    (place / name).write_bytes(content)
"""
USE_SHIPPED = """
import pathlib, sys
from opspace.machine import kept_object
kept_object.PACKAGE = pathlib.Path(sys.argv[1])
{program}
assert small.LIBRARY.came == "shipped"
"""
ELF_MACHINES = {"x86_64": 62, "aarch64": 183}


def test_what_is_shipped_is_loaded_and_nothing_is_compiled_or_kept(empty, tmp_path):
    empty("-c", MAKE_TO_SHIP, str(tmp_path))
    files = objects(tmp_path)
    assert len(files) == len(SHIPPED)
    for path in files:
        content = path.read_bytes()[kept_object.SUM :]
        set_ = path.name.split("-")[1]
        assert content[:4] == b"\x7fELF"
        assert int.from_bytes(content[18:20], "little") == ELF_MACHINES[set_]
    if host() not in SHIPPED:
        pytest.skip(f"nothing is shipped for {host().triple}, {host().cpu}")
    done = empty("-c", USE_SHIPPED.format(program=PROGRAM), str(tmp_path))
    assert done.stdout.split() == LOADED
    assert not done.stderr
    assert not (tmp_path / "kept").exists()


def test_a_damaged_object_of_the_package_is_not_loaded(monkeypatch, tmp_path):
    monkeypatch.setattr(kept_object, "PACKAGE", tmp_path)
    place = tmp_path / "machine" / "objects"
    place.mkdir(parents=True)
    assert kept_object.read_shipped("one.o") is None
    (place / "one.o").write_bytes(kept_object.sealed(b"content"))
    assert kept_object.read_shipped("one.o") == b"content"
    (place / "one.o").write_bytes(kept_object.sealed(b"content")[:-1])
    assert kept_object.read_shipped("one.o") is None


LINUX, MAC = "x86_64-pc-linux-gnu", "arm64-apple-darwin24.6.0"
OLD, NEW = ("+" + ",+".join(sorted(able)) for able in (processor.V2, processor.V2 | processor.V3))


@pytest.mark.parametrize(
    ("triple", "features", "expected"),
    [
        (LINUX, NEW + ",+avx512f", "x86-64-v3"),
        (LINUX, NEW.replace("+avx2", "-avx2"), "x86-64-v2"),
        (LINUX, OLD, "x86-64-v2"),
        (LINUX, "", "own"),
        ("x86_64-apple-darwin23.1.0", NEW, "own"),
        (MAC, "+neon", "own"),
        ("aarch64-unknown-linux-gnu", "+neon,+sve", "generic"),
        ("aarch64_be-unknown-linux-gnu", "+neon", "own"),
    ],
)
def test_a_machine_runs_the_best_object_that_it_can(monkeypatch, triple, features, expected):
    own = processor.Processor(triple, "own", features)
    monkeypatch.setattr(processor, "exactly", lambda: own)
    assert host().cpu == expected
    assert (host() in SHIPPED) == (expected != "own")


def test_a_kernel_that_asks_for_what_nobody_has_is_refused_by_name(empty, tmp_path):
    gamma = "import math\n" + KERNELS.replace("times * work.x[i]", "math.gamma(work.x[i])")
    (tmp_path / "small_kernels.py").write_text(gamma)
    with pytest.raises(subprocess.CalledProcessError) as failed:
        empty("-c", PROGRAM)
    assert "compiled kernels ask for" in failed.value.stderr


def test_a_damaged_object_is_made_again(empty, tmp_path):
    empty("-c", PROGRAM)
    (path,) = objects(tmp_path)
    whole = path.read_bytes()
    for damaged in (b"", whole[:-1] + b"x"):
        path.write_bytes(damaged)
        assert empty("-c", PROGRAM).stdout.split() == LOADED
        assert path.read_bytes() == whole


UNWRITABLE = """
import tempfile
def refused(*args, **options):
    raise {error}
tempfile.TemporaryFile = tempfile.mkstemp = refused
"""
FULL = """
import errno, tempfile
def full(*args, **options):
    raise OSError(errno.ENOSPC, "no space")
tempfile.mkstemp = full
"""


@pytest.mark.parametrize("error", ["PermissionError()", "OSError(30, 'read-only')"])
def test_who_may_only_read_starts_from_what_others_compiled(empty, error):
    empty("-c", PROGRAM)
    again = empty("-c", UNWRITABLE.format(error=error) + PROGRAM)
    assert again.stdout.split() == LOADED
    assert not again.stderr


def test_where_nothing_can_be_kept_one_line_says_what_to_do(empty):
    program = UNWRITABLE.format(error="PermissionError()") + PROGRAM
    for _ in range(2):
        done = empty("-c", program)
        assert done.stdout.split() == LOADED
        assert "every start" in done.stderr
        assert done.stderr.count("NUMBA_CACHE_DIR") == 1
        assert "it is kept" not in done.stderr


def test_a_full_disk_stops_nothing(empty):
    done = empty("-c", FULL + PROGRAM)
    assert done.stdout.split() == LOADED
    assert "compiled the control tick" in done.stderr
    assert "it is kept" not in done.stderr


def test_what_is_kept_lies_beside_the_source_or_else_in_the_users_cache(monkeypatch, tmp_path):
    beside, users = tmp_path / "opspace" / "kernels" / "__pycache__", tmp_path / "cache" / "opspace"
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(kept_object, "PACKAGE", tmp_path / "opspace")
    monkeypatch.setattr(kept_object, "_user_cache", lambda: tmp_path / "cache")
    assert kept_object.places() == [beside, users]
    (tmp_path / "opspace").write_text("a file, where nobody can make a directory")
    assert kept_object.writable() == users
    assert kept_object.keep("kernels-a-1.o", b"one")
    assert kept_object.read("kernels-a-1.o") == b"one"
    assert kept_object.read("kernels-a-2.o") is None
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "chosen"))
    assert kept_object.read("kernels-a-1.o") is None


def test_old_objects_of_a_processor_go_and_those_of_others_stay(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert kept_object.keep("kernels-other-0.o", b"other")
    for k in range(kept_object.MOST + 3):
        assert kept_object.keep(f"kernels-a-{k}.o", b"content")
        os.utime(tmp_path / f"kernels-a-{k}.o", (k, k))
    names = {path.name for path in objects(tmp_path)}
    kept = {f"kernels-a-{k}.o" for k in range(3, kept_object.MOST + 3)}
    assert names == {"kernels-other-0.o"} | kept


def test_a_field_that_moves_makes_what_is_kept_old():
    tick = next(entry for entry in ENTRIES if entry.name == "tick")
    layout = tick.layout
    assert "q: float641, v: float641, M: float642" in layout
    moved = layout.replace("q: float641, v: float641", "v: float641, q: float641")
    assert moved != layout
    assert stamp(layout) != stamp(moved)
    table = tick.takes[1]
    swapped = type(table)(table.name, table.meaning, *table.fields[1::-1], *table.fields[2:])
    assert tick._replace(takes=(float, swapped)).layout == tick.layout.replace(layout, moved)


STEPS = """
import sys
import numpy as np
import opspace as osc
robot = osc.load_robot("puma560")
controller = osc.Controller(
    robot, osc.Stack([osc.PositionTask(), osc.PostureTask()], limits=osc.JointLimits())
)
assert controller.warm_up() > 0.0
assert controller.warm_up() == 0.0
rng = np.random.default_rng(0)
Q, V = robot.q_reference + rng.normal(size=(20, 6)), rng.normal(size=(20, 6))
commands = [controller.step(0.001 * k, q, v) for k, (q, v) in enumerate(zip(Q, V))]
found = [command.tau for command in commands]
found += [level.sigma for command in commands for level in command.levels]
found.append(controller.torque_batch(Q, V).ravel())
sys.stdout.write(np.concatenate(found).tobytes().hex())
assert "numba" not in sys.modules
"""


def test_a_controller_starts_without_a_compiler_and_every_process_gives_the_same_bits():
    first, second = (
        subprocess.run([sys.executable, "-c", STEPS], capture_output=True, text=True, check=True)
        for _ in range(2)
    )
    assert first.stdout == second.stdout
    assert np.isfinite(np.frombuffer(bytes.fromhex(first.stdout))).all()
    assert not first.stderr


@pytest.mark.slow
def test_the_first_run_ever_gives_the_numbers_of_every_later_one(empty, tmp_path):
    for name in ("first", "second"):
        empty("-c", RUN, "run", "singularity", "--out", str(tmp_path / name))
    first, second = (load(tmp_path / name).data for name in ("first", "second"))
    np.testing.assert_array_equal(first, second)


def test_no_kernel_raises():
    """Nobody would hear of it: the C functions have no place for an error."""
    for path in (Path(__file__).parents[2] / "src" / "opspace" / "kernels").glob("*.py"):
        assert "raise " not in path.read_text("utf-8"), path


TRAPPED = """
from llvmlite import ir
from numba.cpython import slicing
from opspace.machine import kept_object
from opspace.machine.processor import host
from opspace.machine.translate import translate_only

def trapped(builder, index, size):
    with builder.if_then(builder.icmp_signed("<", index, index.type(0)), likely=False):
        kind = ir.FunctionType(ir.VoidType(), ())
        builder.call(builder.module.declare_intrinsic("llvm.trap", (), kind), ())
    return index

translate_only()
slicing.fix_index = trapped
from opspace.machine.compile_object import compile_objects
from opspace.plan.entries import ENTRIES, KERNELS
assert kept_object.keep(KERNELS.file_name(host()), *compile_objects(ENTRIES, [host()]))
"""


def test_the_object_carries_its_stamp_and_no_path_of_who_made_it():
    """Python's own errors would bring it, with the file that they come from."""
    content = entries.KERNELS.object()
    assert entries.KERNELS.stamp.encode() in content
    assert b"builtins" not in content
    assert b".py" not in content


@pytest.mark.slow
def test_no_index_counts_from_the_end(empty):
    """What is compiled for users takes that for granted; here, a trap ends the process."""
    empty("-c", TRAPPED)
    tests = Path(__file__).parents[1]
    chosen = [tests / "controller" / f"test_{name}.py" for name in ("compiled", "batch", "bounds")]
    done = empty("-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *map(str, chosen))
    assert "compiling" not in done.stdout + done.stderr
