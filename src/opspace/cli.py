"""The ``opspace`` command: thin functions that import what they need when they are called."""
# ruff: noqa: PLC0415 - nobody should wait for a simulator to read --help

from __future__ import annotations

import io
import json
import os
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opspace.errors import ModelWarning, OpspaceError

if TYPE_CHECKING:
    from opspace.runs.run import RunResult

BAD_INPUT = 2
INTERRUPTED = 130

_UNBROKEN = 10_000
_UNITS = {"orientation": "1/(kg·m²)", "position": "1/kg"}

# Typer brings its own copy of click or uses the installed one, depending on its version; the base
# of its BadParameter is the usage error of the one in use.
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]

app = typer.Typer(
    name="opspace",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Args:
        arguments: The words after ``opspace``; None takes those of the process.

    Raises:
        SystemExit: Always; 0 when the command did what was asked, 2 for bad input, 130 after
            Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A terminal that knows no "·" shows something else in its place.
            stream.reconfigure(errors="replace")
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        status = _status(arguments)
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader, such as head, has seen enough; the interpreter's own flush must not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(status)


def _status(arguments: Sequence[str] | None) -> int:
    try:
        status = app(arguments, prog_name="opspace", standalone_mode=False)
    except OpspaceError as error:
        return _refuse(str(error))
    except _UsageError as error:
        context = getattr(error, "ctx", None)
        command = context.command_path if context else "opspace"
        return _refuse(f"{_one_line(error)} (see {command} --help)")
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    if status == INTERRUPTED:
        print("opspace: interrupted", file=sys.stderr)
    return status if isinstance(status, int) else 0


def _warn(message: Warning | str, *_: object) -> None:
    print(f"opspace: warning: {' '.join(str(message).split())}", file=sys.stderr)


def _refuse(message: str) -> int:
    print(f"opspace: error: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT


def _one_line(error: Exception) -> str:
    words = error.format_message() if hasattr(error, "format_message") else str(error)  # pyright: ignore[reportAttributeAccessIssue]
    return words.rstrip(".")


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib import metadata

        print(f"opspace {metadata.version('opspace')}")
        raise typer.Exit


@app.callback(
    invoke_without_command=True,
    epilog="Example: opspace robots",
)
def _opspace(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Operational space control whose tasks come, go and change rank without a step in torque."""
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command(epilog="Example: opspace robots --json")
def robots(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """List the robots that have a name."""
    from opspace.robots.registry import available_robots

    found = available_robots()
    if as_json:
        print(json.dumps([asdict(robot) for robot in found], indent=1, ensure_ascii=False))
        return
    _print_table(
        ("name", "kind", "dof", "installed", "description"),
        [
            (
                robot.name,
                robot.kind,
                str(robot.dof),
                "yes" if robot.installed else f"no: needs {robot.package}",
                robot.description,
            )
            for robot in found
        ],
    )


Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one value; may be repeated."),
]


@app.command(epilog="Example: opspace run singularity --set tasks.position.kp=200 --out results/a")
def run(
    scenario: Annotated[
        str, typer.Argument(help="A scenario file (.yaml), or the name of one that is shipped.")
    ],
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory to write to. [default: results/NAME]")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a recording that is already there.")
    ] = False,
    requests: Annotated[
        Path | None,
        typer.Option(help="Ask for what was asked for in opspace view (RUN/requests.jsonl)."),
    ] = None,
) -> None:
    """Simulate a scenario, record it and measure it."""
    from opspace.runs.metrics import units_of
    from opspace.runs.progress import ProgressBar
    from opspace.runs.run import run_scenario
    from opspace.runs.tables import metrics_table, timeline_table
    from opspace.scenario import load_scenario

    loaded = load_scenario(scenario, overrides or ())
    out = out or Path("results") / Path(scenario).stem
    with ProgressBar() as progress:
        result = run_scenario(
            loaded,
            out,
            title=Path(scenario).stem,
            progress=progress,
            overwrite=overwrite,
            requests=requests,
        )
    if loaded.events:
        _print_table(*timeline_table(loaded.events, result.recording))
        print()
    _print_table(*metrics_table({"value": result.metrics}, units_of(result.recording)))
    if not result.outcome.completed:
        print(f"stopped at {result.outcome.t:.3f} s: {result.outcome.reason}")
    print(f"results: {out}")


class Which(str, Enum):
    """What can be reproduced."""

    SINGULARITY = "singularity"
    JOINT_LIMIT = "joint-limit"
    FORCES = "forces"
    STIFFNESS = "stiffness"
    COLLISIONS = "collisions"
    HUMANOID = "humanoid"
    ALL = "all"


@app.command(epilog="Example: opspace reproduce all --robot panda --out results/panda")
def reproduce(
    which: Annotated[Which, typer.Argument(help="The experiment.")] = Which.ALL,
    robot: Annotated[
        str | None,
        typer.Option(
            help="Name of a robot, or path of a .urdf or .xml file. [default: puma560]",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Directory to write to.")] = Path("results"),
) -> None:
    """Repeat the paper's experiments: without the method, with a hard switch, and with it.

    Four more are not part of all, and take minutes: forces touches a table in several ways and wipes
    it, stiffness presses on tables from 3e2 to 1e6 N/m, collisions are five scenes of a Panda that would
    touch something, in five ways, humanoid lifts a foot, reaches, leans, lands and presses.
    """
    if which is Which.HUMANOID:
        _reproduce_humanoid(robot, out / "humanoid")
        return
    if which is Which.COLLISIONS:
        _reproduce_collisions(robot, out)
        return
    robot = robot or "puma560"
    if which in (Which.FORCES, Which.STIFFNESS):
        _reproduce_touch(which, robot, out)
        return
    from opspace.runs.progress import ProgressBar
    from opspace.runs.reproduce import EXPERIMENTS, draw, reproduce
    from opspace.runs.tables import metrics_table

    wanted = EXPERIMENTS if which is Which.ALL else (which.value,)
    with ProgressBar() as progress:
        done = reproduce(wanted, robot, out, progress=progress)
    for found in done:
        print(f"\n{found.experiment.name}: {found.experiment.title}")
        _print_table(*metrics_table({name: run.metrics for name, run in found.runs.items()}))
    for problem in draw(done, out):
        print(problem, file=sys.stderr)
    print(f"results: {out}")


def _reproduce_touch(which: Which, robot: str, out: Path) -> None:
    from opspace.runs.reproduce_forces import (
        draw_touches,
        measured,
        numbers_table,
        run_ways,
        sweep_stiffness,
        write,
    )

    if which is Which.STIFFNESS:
        numbers = sweep_stiffness(robot)
        directory = write(out, which.value, numbers)
        _print_table(*numbers_table(numbers, "stiffness [N/m]"))
    else:
        runs = run_ways(robot)
        numbers = measured(runs)
        directory = write(out, which.value, numbers)
        _print_table(*numbers_table(numbers, "way"))
        draw_touches(runs, directory / "touch.png")
    print(f"results: {directory}")


def _reproduce_collisions(robot: str | None, out: Path) -> None:
    from opspace.compare.collision_experiment import (
        collisions_table,
        draw_collisions,
        reproduce_collisions,
    )
    from opspace.errors import InputError
    from opspace.runs.progress import ProgressBar

    if robot not in (None, "panda"):
        raise InputError(f"the scenes of collisions are those of a panda, not of {robot!r}")
    out = out / "collisions"
    with ProgressBar() as progress:
        done = reproduce_collisions(out, progress=progress)
    _print_table(*collisions_table(done))
    for problem in draw_collisions(done, out):
        print(problem, file=sys.stderr)
    print(f"results: {out}")


def _reproduce_humanoid(robot: str | None, out: Path) -> None:
    from opspace.compare.humanoid import VARIANTS, draw, measures, reproduce_humanoid, table
    from opspace.errors import InputError
    from opspace.runs.progress import ProgressBar, counter
    from opspace.scenario import load_scenario

    scenario = load_scenario("humanoid")
    if robot not in (None, scenario.robot):
        raise InputError(f"the humanoid is {scenario.robot!r}, whose soles and times it needs")
    with ProgressBar() as progress:
        runs = reproduce_humanoid(out, progress=progress)
    found = {name: measures(run.recording, scenario) for name, run in runs.items()}
    _print_table(*table(found))
    for name, run in runs.items():
        ended = "" if run.outcome.completed else f", stopped at {run.outcome.t:.2f} s"
        print(f"{name}: {VARIANTS[name].title}{ended}")
    for name, variant in VARIANTS.items():
        if name not in runs:
            print(f"{name} is left out, it needs: {variant.needs}", file=sys.stderr)
    with counter("film.gif") as pictures:
        for problem in draw(runs, out, progress=pictures):
            print(problem, file=sys.stderr)
    print(f"results: {out}")


@app.command(epilog="Example: opspace compare showpiece --method opspace --method switch")
def compare(
    scenario: Annotated[
        str, typer.Argument(help="A scenario file (.yaml), or the name of one that is shipped.")
    ],
    overrides: Overrides = None,
    methods: Annotated[
        list[str] | None,
        typer.Option(
            "--method", metavar="NAME", help="One method; may be repeated. [default: all]"
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory to write to. [default: results/compare/NAME]")
    ] = None,
) -> None:
    """Run a scenario under other ways to change tasks: one table and one figure."""
    from opspace.compare import METHODS, compare_scenario
    from opspace.runs.progress import ProgressBar
    from opspace.scenario import load_scenario

    out = out or Path("results") / "compare" / Path(scenario).stem
    loaded = load_scenario(scenario, overrides or ())
    with ProgressBar() as progress:
        found = compare_scenario(loaded, methods or (), out, progress=progress)
    _print_table(*found.table())
    print()
    for name in found.rows:
        print(f"{name}: {METHODS[name].title} ({METHODS[name].limits})")
    for name, why in found.left_out.items():
        print(f"left out: {name}, {why}")
    print(f"results: {out}")


@app.command(epilog="Example: opspace bench panda ur5 --core 0 --against results/bench/before.json")
def bench(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            help="Names of scenes; fleet times many robots in Warp. [default: all but fleet]",
            metavar="SCENE",
        ),
    ] = None,
    ticks: Annotated[int, typer.Option(help="Ticks of every subject; states of a batch.")] = 4000,
    core: Annotated[int | None, typer.Option(help="Stay on this core for single ticks.")] = None,
    readable: Annotated[
        bool, typer.Option("--readable", help="Time the readable form of the tick as well.")
    ] = False,
    in_c: Annotated[
        bool,
        typer.Option(
            "--in-c",
            help="Time exported controllers as well, with the kernels of all and with their own; "
            "needs a C compiler and some minutes for each scene.",
        ),
    ] = False,
    changes: Annotated[
        int, typer.Option(help="Time so many changes of a stack of each kind as well.", min=0)
    ] = 0,
    worst: Annotated[
        int,
        typer.Option(help="Try so many states of each scene for its slowest ticks as well.", min=0),
    ] = 0,
    against: Annotated[
        Path | None, typer.Option(help="JSON file of an earlier run to compare with.")
    ] = None,
    arch: Annotated[
        str | None,
        typer.Option(
            help="With fleet: compile it for this kind of graphics card, as sm_90, which need not "
            "be there, and tell what a robot takes of it."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Directory to write to.")] = Path("results/bench"),
) -> None:
    """Time the tick, in turns with the model's own calls and with other controllers."""
    from opspace.bench import (
        SCENES,
        Benchmark,
        changes_table,
        compare_runs,
        run_benchmark,
        worst_table,
    )
    from opspace.errors import InputError
    from opspace.export.timed_in_c import check_in_c, timed_in_c
    from opspace.plots import save
    from opspace.plots.benchmark import benchmark_figure

    before = None if against is None else Benchmark.load(against)
    if arch is not None and (not scenes or "fleet" not in scenes):
        raise InputError("--arch is for opspace bench fleet")
    if scenes and "fleet" in scenes:
        if arch is None:
            _bench_fleet(out)
        else:
            _fleet_on_card(arch)
        scenes = [name for name in scenes if name != "fleet"]
        if not scenes:
            return

    if in_c:
        check_in_c(scenes or SCENES)

    def announce(what: str) -> None:
        print(what, file=sys.stderr)

    found = run_benchmark(
        scenes or (),
        ticks,
        core,
        readable=readable,
        more=timed_in_c if in_c else lambda _: {},
        announce=announce,
    )
    _print_table(*found.table())
    print()
    _print_table(*found.batch_table())
    if changes:
        print()
        _print_table(*changes_table(changes))
    if worst:
        print()
        _print_table(*worst_table(scenes or (), worst, core))
    if before is not None:
        print()
        _print_table(*compare_runs(before, found))
    found.save(out / "bench.json")
    save(benchmark_figure(found.scenes), out / "bench.png")
    print(f"results: {out}")


def _bench_fleet(out: Path) -> None:
    """Time fleets, and say where and beside what."""
    from opspace.bench import FLEET_HEADS, fleet_steps, newton_is_installed

    print("fleets compile their kernels first, some ten seconds each", file=sys.stderr)
    rows = fleet_steps()
    _print_table(FLEET_HEADS, rows)
    print("cpu is one core; fleets compute the dynamics unless given, and keep joint limits")
    if not newton_is_installed():
        print("Newton is not installed (pip install newton): no controller was timed beside")
    out.mkdir(parents=True, exist_ok=True)
    content = [dict(zip(FLEET_HEADS, row, strict=True)) for row in rows]
    (out / "fleet.json").write_text(
        json.dumps(content, indent=1, ensure_ascii=False) + "\n", "utf-8"
    )
    print(f"results: {out}")


def _fleet_on_card(arch: str) -> None:
    """Tell what a robot of a fleet takes of a graphics card."""
    from opspace.bench import CARD_HEADS, fleet_on_card

    rows = fleet_on_card(arch)
    _print_table(CARD_HEADS, rows)
    if any("not known" in row for row in rows):
        print("a new ptxas tells what is spilled: pip install nvidia-cuda-nvcc")


@app.command(epilog="Example: opspace sweep showpiece --vary tasks.position.kp=20..200 --runs 50")
def sweep(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A scenario file (.yaml), the name of one that is shipped, or the word random: "
            "every run draws robot, tasks, targets, transitions, model errors and pushes."
        ),
    ],
    overrides: Overrides = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=VALUES",
            help="LOW..HIGH, log LOW..HIGH or [VALUE, ...]; may be repeated.",
        ),
    ] = None,
    runs: Annotated[
        int | None, typer.Option(help="Runs to draw. [default: every combination once]")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of everything that is drawn.")] = 0,
    jobs: Annotated[
        int | None, typer.Option(help="Runs at a time. [default: one per core]")
    ] = None,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Run on this Ray cluster instead.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds allowed to one run.")] = 120.0,
    out: Annotated[
        Path | None, typer.Option(help="Directory to write to. [default: results/sweep/NAME]")
    ] = None,
) -> None:
    """Run a scenario many times, in parallel; the same command again goes on where it was."""
    from opspace.errors import InputError
    from opspace.plots import save
    from opspace.plots.sweep import sweep_figure
    from opspace.runs.progress import counter
    from opspace.scenario import load_scenario
    from opspace.scenario.load import to_dict
    from opspace.sweep import SweepPlan, Variation, run_sweep
    from opspace.sweep.limit_measures import UNITS
    from opspace.sweep.sweep_plan import RANDOM

    drawn = scenario == RANDOM
    if drawn and overrides:
        raise InputError("opspace sweep random takes no --set; use --vary KEY=[VALUE]")
    base = None if drawn else to_dict(load_scenario(scenario, overrides or ()))
    plan = SweepPlan(base, [Variation.read(text) for text in vary or ()], runs, seed)
    out = out or Path("results") / "sweep" / Path(scenario).stem
    with counter("runs") as progress:
        found = run_sweep(plan, out, jobs=jobs, ray=ray, timeout=timeout, progress=progress)
    _print_table(*found.table())
    print(", ".join(f"{count} {how}" for how, count in found.endings().most_common()))
    for row in found.failed:
        print(f"run {row['index']} {row['ended']}: {row['reason']}\n  {found.command(row)}")
    save(sweep_figure(found.rows, UNITS), out / "sweep.png")
    print(f"results: {out}")


@app.command(epilog="Example: opspace check ur5")
def check(
    robot: Annotated[str, typer.Argument(help="Name of a robot, or path of a .urdf or .xml file.")],
    joints: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help='Joint to control, or pattern ("left_*"); repeatable.'),
    ] = None,
    locked: Annotated[
        list[str] | None,
        typer.Option(
            "--lock", metavar="NAME[=POSITION]", help="Joint to hold, rad or m; repeatable."
        ),
    ] = None,
    tool: Annotated[str | None, typer.Option(help="Default tool frame.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Tell what the controller will see of a robot."""
    from opspace.robots import load_robot
    from opspace.runs.check import check_robot, rounded, to_plain
    from opspace.runs.tables import joints_table

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)  # the report has them
        held = dict(_position(text) for text in locked or ())
        report = check_robot(load_robot(robot, joints=joints, locked=held, tool=tool))
    if as_json:
        print(json.dumps(to_plain(report), indent=1, ensure_ascii=False))
        return
    print(f"{report.robot}: {report.dof} degrees of freedom, tool {report.tool!r}")
    print(f"file: {report.source}")
    for joint, position in report.locked.items():
        print(f"held: {joint}" + ("" if position is None else f" at {position:g}"))
    for relation in report.coupled:
        print(f"follows: {relation}")
    if report.beside:
        print(f"not on the way to the tool: {', '.join(report.beside)}")
    print()
    _print_table(*joints_table(report.joints))
    for task, sigma in report.sigma.items():
        values = ", ".join(map(rounded, sigma))
        print(f"\n{task}: eigenvalues {values} at the reference posture", end="")
        print(f" (1 is what is usual in the workspace, {report.scale[task]:.3g} {_UNITS[task]})")
    lower, upper = report.buffer
    print(f"\nbuffer: a direction is absent below {lower:g} and fully active above {upper:g}")
    for warning in report.warnings:
        print(f"warning: {warning}")


@app.command(epilog="Example: opspace shapes panda --out panda-shapes.yaml")
def shapes(
    robot: Annotated[str, typer.Argument(help="Name of a robot, or path of a .urdf or .xml file.")],
    margin: Annotated[float, typer.Option(help="Distance that is to be kept, m.")] = 0.01,
    srdf: Annotated[
        Path | None, typer.Option(help="SRDF file with the pairs of links to leave out.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write, .yaml; CollisionAvoidance reads it back.")
    ] = None,
) -> None:
    """Fit capsules to the links of a robot, and tell which pairs are kept apart and why others not."""
    from opspace.robots import load_robot
    from opspace.robots.shape_file import write_shapes
    from opspace.runs.shapes_report import pairs_table, shapes_table
    from opspace.tasks import CollisionAvoidance

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)  # opspace check tells them
        found = load_robot(robot)
    guard = CollisionAvoidance(margin=margin, pairs="auto" if srdf is None else srdf)
    guard.bind(found)
    _print_table(*shapes_table(guard.shapes))
    print()
    _print_table(*pairs_table(guard))
    if out is not None:
        print(f"results: {write_shapes(out, found.name, margin, guard.shapes, guard.chosen)}")


@app.command(epilog="Example: opspace doctor --seconds 60 --core 1")
def doctor(
    seconds: Annotated[float, typer.Option(help="How long each kind of thread is measured.")] = 5.0,
    period: Annotated[float, typer.Option(help="Time between two wake-ups, s.")] = 1e-3,
    core: Annotated[int | None, typer.Option(help="Core that the second thread stays on.")] = None,
    priority: Annotated[int, typer.Option(help="Its priority, 1 to 99.")] = 80,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Measure how late this machine wakes a control loop up, and say what to set."""
    from opspace.loop import RealTime
    from opspace.loop.wake_up import PARTS, advice, wake_ups

    measured = {
        "ordinary": wake_ups(seconds, period, None),
        "real-time": wake_ups(seconds, period, RealTime(priority=priority, core=core)),
    }
    late = {kind: [one.percentile(p) for p in PARTS.values()] for kind, one in measured.items()}
    advised = [*measured["real-time"].refused, *advice()]
    if as_json:
        found = {kind: dict(zip(PARTS, values, strict=True)) for kind, values in late.items()}
        print(json.dumps({"late_us": found, "advice": advised}, indent=1, ensure_ascii=False))
        return
    print(f"late by, µs, waking up every {1e3 * period:g} ms for {seconds:g} s\n")
    rows = [(kind, *(f"{value:.0f}" for value in values)) for kind, values in late.items()]
    _print_table(("thread", *PARTS), rows)
    for sentence in advised:
        print(f"\n{sentence}", end="")
    print()


def _position(text: str) -> tuple[str, float | None]:
    """Read NAME or NAME=POSITION."""
    name, given, position = text.partition("=")
    try:
        return name, float(position) if given else None
    except ValueError:
        from opspace.errors import InputError

        raise InputError(f"--lock {text}: the position is no number") from None


@app.command(
    epilog="Example: opspace view showpiece-panda; then: opspace view results/view/showpiece-panda-1"
)
def view(
    what: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO|ROBOT|RUN",
            help="A scenario to run on the page, a robot (by name or file) to hold and drag there, "
            "or the directory of a recording to look at.",
        ),
    ],
    overrides: Overrides = None,
    host: Annotated[
        str, typer.Option(help="Address to listen at; 0.0.0.0 lets other machines in.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=1, max=65535, help="Port; the next free one if it is in use.")
    ] = 8080,
    speed: Annotated[float, typer.Option(help="Seconds of the run per second.")] = 1.0,
    duration: Annotated[
        float, typer.Option(help="Seconds after which the run ends; a minute takes some 100 MB.")
    ] = 600.0,
    start: Annotated[
        bool, typer.Option("--start", help="Begin at once, not when a browser opens the page.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Directory to record to. [default: results/view/NAME-1, -2, ...]"),
    ] = None,
) -> None:
    """Watch a run in a browser: live, with buttons to change it, or recorded; or just a robot."""
    from opspace.record.format import HEADER
    from opspace.runs.watch import next_directory, watch_scenario
    from opspace.scenario.of_robot import scenario_or_robot

    if Path(what).is_dir() or (Path(what) / HEADER).exists():
        _view_recording(Path(what), host, port)
        return
    loaded = scenario_or_robot(what, overrides or ())
    begins = "now" if start else "when the page is open"
    watch_scenario(
        loaded,
        out or next_directory(Path("results") / "view", Path(what).stem),
        host=host,
        port=port,
        duration=duration,
        speed=speed,
        wait=not start,
        opened=lambda address: print(
            f"open {address}  (the run begins {begins}; Ctrl-C ends it)", flush=True
        ),
        ended=_stay,
    )


def _view_recording(run: Path, host: str, port: int) -> None:
    from opspace.view.page import Page

    page = Page(run, host, port, None)
    try:
        print(f"open {page.address}  (Ctrl-C ends it)", flush=True)
        page.serve()
    except KeyboardInterrupt:
        page.close()


def _stay(result: RunResult) -> None:
    """Keep the page of a run that is over until somebody has seen enough."""
    if result.outcome.reason:
        print(f"ended at {result.outcome.t:.3f} s: {result.outcome.reason}")
    print(f"results: {result.directory}")
    if result.outcome.reason == "interrupted":
        return
    try:
        print("the page still shows the run; Ctrl-C closes it", flush=True)
        while True:
            time.sleep(1.0)
    except KeyboardInterrupt:
        return


@app.command(epilog="Example: opspace replay results/showpiece")
def replay(
    recording: Annotated[
        Path,
        typer.Argument(
            help="Directory of a recording of opspace run or a black box.", metavar="RUN"
        ),
    ],
) -> None:
    """Put the recorded states to a fresh controller and compare the torques."""
    from opspace.runs.replay_run import replay

    found = replay(recording)
    print(f"{found.ticks} ticks; how the recorded run ended: {found.ended}")
    gap = f"{found.gap:.3g} {found.unit}"
    print(f"largest difference of a torque: {gap} at t = {found.gap_at:.3f} s")
    print(f"last tick: {found.last}{', as recorded' if found.repeated else ', NOT as recorded'}")
    if found.seconds:
        rows = [
            (name, f"{seconds:.3f}", f"{found.first[name]:.3f}")
            for name, seconds in found.seconds.items()
        ]
        _print_table(("status", "held for [s]", "first at [s]"), rows)


@app.command(epilog="Example: opspace film results/showpiece --speed 2 --out showpiece.mp4")
def film(
    recording: Annotated[
        Path, typer.Argument(help="Directory of a recording of opspace run.", metavar="RUN")
    ],
    speed: Annotated[float, typer.Option(help="Seconds of the run per second of film.")] = 1.0,
    fps: Annotated[
        float | None, typer.Option(help="Pictures per second. [default: 10 (.gif), 30 (.mp4)]")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write (.gif or .mp4). [default: RUN/film.gif]")
    ] = None,
) -> None:
    """Draw a run as an animated GIF or as an MP4."""
    from opspace.pictures.film import film
    from opspace.record import load
    from opspace.runs.progress import counter
    from opspace.runs.run import SCENARIO
    from opspace.scenario import load_scenario
    from opspace.scenario.build import build_robot

    loaded = load(recording)
    path = out or loaded.directory / "film.gif"
    robot = build_robot(load_scenario(loaded.directory / SCENARIO))
    with counter(path.name) as progress:
        film(loaded, robot, path, fps=fps, speed=speed, progress=progress)
    print(f"results: {path}")


@app.command(epilog="Example: opspace export results/showpiece --to mcap")
def export(
    recording: Annotated[Path, typer.Argument(help="Directory of a recording.", metavar="RUN")],
    to: Annotated[
        str | None,
        typer.Option(
            metavar="FORMAT",
            help="mcap (Foxglove, PlotJuggler), rerun or csv. [default: what --out ends in]",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File to write. [default: RUN/run.mcap, RUN/run.rrd or RUN/run.csv]"),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that is already there.")
    ] = False,
) -> None:
    """Write a recording as a file that another program opens."""
    from opspace.errors import InputError, unknown_name
    from opspace.export import FORMATS, export
    from opspace.record import load
    from opspace.runs.progress import counter

    if to is None and out is None:
        raise InputError(f"name a format or a file: --to takes {', '.join(FORMATS)}")
    if to is not None and to not in FORMATS:
        raise unknown_name("format", to, FORMATS)
    loaded = load(recording)
    path = out or loaded.directory / f"run{FORMATS[str(to)]}"
    with counter(path.name) as progress:
        export(loaded, path, to, overwrite=overwrite, progress=progress)
    print(f"results: {path}")


@app.command("export-c", epilog="Example: opspace export-c my.yaml --out arm --absent guest")
def export_as_c(
    scenario: Annotated[str, typer.Argument(help="Name of a scenario, or path of a .yaml file.")],
    out: Annotated[Path, typer.Option(help="Directory to write to.")],
    name: Annotated[str, typer.Option(help="Name of the model in C.")] = "controller",
    absent: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Task or contact that is not there at first; repeatable."
        ),
    ] = None,
    levels: Annotated[
        list[float] | None,
        typer.Option(
            "--level",
            metavar="NUMBER",
            help="Level that tasks will move to, beside those there are; repeatable.",
        ),
    ] = None,
    moves: Annotated[
        int, typer.Option(help="How many moves and swaps can be on their way at once.")
    ] = 2,
    own_kernels: Annotated[
        bool,
        typer.Option(
            "--own-kernels",
            help="Compile kernels for this controller alone: faster, other last bits, takes a minute.",
        ),
    ] = False,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change one value; repeatable."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace files that are already there.")
    ] = False,
) -> None:
    """Write the controller of a scenario as a C library, for programs without Python."""
    from opspace.export.c_library import export_c
    from opspace.scenario import load_scenario
    from opspace.scenario.build import build

    controller = build(load_scenario(scenario, overrides or ())).controller
    export_c(
        controller,
        out,
        name,
        absent=absent or (),
        levels=levels or (),
        moves=moves,
        own_kernels=own_kernels,
        overwrite=overwrite,
    )
    print(f"results: {out}")


@app.command(epilog="Example: opspace plot results/a results/b tau tool/x --overlay")
def plot(
    words: Annotated[
        list[str],
        typer.Argument(
            help="Directories of recordings, then columns or groups of columns. A word after the "
            "first is a column where the first recording has it; ./NAME always is a directory. "
            "[default columns: q v tau tasks]",
            metavar="RUN|COLUMN",
        ),
    ],
    overlay: Annotated[
        bool, typer.Option("--overlay", help="A panel per column with a line per recording.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write (.png, .pdf, .svg). [default: FIRST RUN/plot.png; "
            "plot-COLUMN.png where columns are named]"
        ),
    ] = None,
) -> None:
    """Draw columns of recordings over time, side by side or over each other."""
    from opspace.plots import file_name, overlay_columns, plot_columns, save
    from opspace.record.selection import select

    recordings, columns = select(words)
    draw = overlay_columns if overlay else plot_columns
    first, *others = recordings
    name = file_name("plot", [*others, *columns, *(["overlay"] if overlay else [])])
    path = out or recordings[first].directory / f"{name}.png"
    save(draw(recordings, columns), path)
    print(f"results: {path}")


def _print_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from opspace.runs.fit_table import fit_table

    # A file or a pipe has no width, and what reads it should find whole rows.
    width = None if sys.stdout.isatty() else _UNBROKEN
    console = Console(width=width, markup=False, emoji=False, highlight=False)
    for number, part in enumerate(fit_table(heads, rows, console.width)):
        if number:
            print()
        table = Table(box=box.HORIZONTALS, show_edge=False, pad_edge=False)
        for head, columns in zip(part.heads, part.widths, strict=True):
            table.add_column(head, width=columns, overflow="fold")
        for row in part.rows:
            table.add_row(*row)
        console.print(table)
