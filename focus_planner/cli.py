"""The command line: ``focus_planner rig | plan | node | demo``.

Results go to stdout, everything else to stderr. Exit status 2 and one line say what was wrong
with the input.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

from focus_planner.core.checks import InputError

if TYPE_CHECKING:
    from focus_planner.core.plans import PlanRequest, SolvedPlan
    from focus_planner.core.scene import Scene
    from focus_planner.core.solvers import Progress
    from focus_planner.core.types import Rig

Tell = Callable[[str], None]

_BAD_INPUT, _INTERRUPTED, _PIPE_CLOSED = 2, 130, 141

_LENS_OPTIONS: dict[str, dict[str, Any]] = {
    "focal_length": {"help": "F, metres (0.05)"},
    "hyperfocal_distance": {"help": "H = F² / (f-number · circle of confusion), metres (10)"},
    "f_number": {"help": "with --circle-of-confusion, instead of --hyperfocal-distance"},
    "circle_of_confusion": {"help": "the largest spot that counts as sharp on the sensor, metres"},
    "min_focus": {"help": "nearest distance that the lens can be set to, metres"},
    "max_focus": {"help": "farthest distance that the lens can be set to, metres"},
    "focus_distances": {"nargs": "+", "help": "the only distances that it can be set to, metres"},
    "focus_steps": {
        "type": int,
        "metavar": "N",
        "help": "positions from --min-focus to --max-focus, equally spaced in dioptres, instead",
    },
}
_REQUEST_OPTIONS = (
    *("method", "samples", "seed", "k", "scope", "tuples", "time_budget"),
    *("shots", "depth_tolerance"),
    *("fresh_samples", "standard_error"),
    *("bound", "gap"),
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        0: done; 2: bad input, told in one line on stderr; 130: interrupted; 141: the reader of
        stdout has gone.
    """
    try:
        status = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except InputError as error:
        return _fail(str(error))
    except MemoryError as error:
        return _fail(f"not enough memory; plan on fewer samples ({error})")
    except SystemExit as exit_:  # argparse's, which has told why
        return exit_.code if isinstance(exit_.code, int) else 0
    except KeyboardInterrupt:
        return _INTERRUPTED
    except BrokenPipeError:
        # Python flushes stdout once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _PIPE_CLOSED
    return status


def _run(argv: list[str]) -> int:
    if argv[:1] == ["node"] and argv[1:] not in (["-h"], ["--help"]):
        return _node(argv[1:])
    options = _parser().parse_args(argv)
    command: Callable[[argparse.Namespace], int] = options.command
    return command(options)


def _fail(message: str) -> int:
    print("focus_planner: error:", " ".join(message.split()), file=sys.stderr)
    return _BAD_INPUT


# --- commands ----------------------------------------------------------------------------------


def _rig_cylinder(options: argparse.Namespace) -> int:
    from focus_planner.core.rig import cylinder_rig
    from focus_planner.io.rigs import lens_of, rig_to_yaml

    given = {name: getattr(options, name) for name in _LENS_OPTIONS}
    rig = cylinder_rig(
        options.rows,
        options.columns,
        options.radius,
        options.bottom,
        options.top,
        lens=lens_of("lens", {name: value for name, value in given.items() if value is not None}),
        frame_id=options.frame_id,
    )
    sys.stdout.write(rig_to_yaml(rig))
    return 0


def _plan(options: argparse.Namespace) -> int:
    from focus_planner.io.files import check_writable

    paths = [p for p in (options.output, options.problem, options.picture) if p is not None]
    for path in paths:
        check_writable(path)
    if len({path.resolve() for path in paths}) < len(paths):
        raise InputError("--output, --problem, --picture", "different files", "the same twice")
    read = {p.resolve() for p in (options.surface, options.rig, options.importance) if p}
    for path in paths:
        if path.resolve() in read:
            raise InputError(str(path), "a file to write that is not read as well", "one of both")
    with _progress(options.quiet) as tell:
        scene, rig, request = _read(options, tell)
        plan = _solve(scene, rig, request, tell)
        _write(options, scene, rig, plan, tell)
    _show(options, plan)
    return 0


def _node(arguments: list[str]) -> int:
    try:
        from focus_planner.ros.node import main as node_main
    except ImportError as error:
        return _fail(f"the node needs ROS 2 (rclpy) and focus_planner_msgs: {error}")
    return node_main(arguments) or 0


def _demo(options: argparse.Namespace) -> int:
    try:
        from focus_planner.demo import run
    except ImportError as error:
        return _fail(f"the demo needs ROS 2 (rclpy) and focus_planner_msgs: {error}")
    return run(options.output) or 0


# --- planning ----------------------------------------------------------------------------------


def _read(options: argparse.Namespace, tell: Tell) -> tuple[Scene, Rig, PlanRequest]:
    tell("loading the planner")
    from focus_planner.core.plans import PlanRequest
    from focus_planner.core.scene import Scene
    from focus_planner.io.rigs import load_rig
    from focus_planner.io.surfaces import load_surface

    given = {name: getattr(options, name) for name in _REQUEST_OPTIONS}
    request = PlanRequest(**{name: value for name, value in given.items() if value is not None})
    tell(f"reading {options.rig}")
    rig = load_rig(options.rig)
    tell(f"reading {options.surface}")
    return Scene(load_surface(options.surface, options.importance)), rig, request


def _solve(scene: Scene, rig: Rig, request: PlanRequest, tell: Tell) -> SolvedPlan:
    from focus_planner.core.planning import plan_focus

    interrupted = False

    def interrupt(signum: int, frame: Any) -> None:
        nonlocal interrupted
        interrupted = True
        signal.default_int_handler(signum, frame)

    def watch(progress: Progress) -> bool:
        tell(f"{progress.stage}: step {progress.iteration}, cost {progress.cost:.2f}")
        return not interrupted

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, interrupt)
    tell(f"finding what {len(rig)} cameras see")
    plan = plan_focus(scene, rig, request, watch=watch)
    if interrupted:  # a library may have swallowed what it raised
        raise KeyboardInterrupt
    return plan


def _write(
    options: argparse.Namespace, scene: Scene, rig: Rig, plan: SolvedPlan, tell: Tell
) -> None:
    from focus_planner.io.plans import save_plan
    from focus_planner.io.problems import save_problem

    if options.output is not None:
        save_plan(plan, options.output)
    if options.problem is not None:
        tell(f"writing {options.problem}")
        save_problem(plan.problem, options.problem)
    if options.picture is not None:
        tell(f"drawing {options.picture}")
        from focus_planner.io.picture import draw_plans

        draw_plans(scene, rig, {plan.method: plan}, options.picture)


def _show(options: argparse.Namespace, plan: SolvedPlan) -> None:
    """Show a person the summary, and a program on stdout the plan that is in no file."""
    stream: TextIO = sys.stdout if options.output is None else sys.stderr
    if stream.isatty() and not options.quiet:
        _print_summary(plan, stream)
    elif options.output is None:
        from focus_planner.io.plans import plan_to_json

        sys.stdout.write(plan_to_json(plan))


def _print_summary(plan: SolvedPlan, stream: TextIO) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{plan.method}, {len(plan.cameras)} cameras", show_header=False)
    table.add_column()
    table.add_column(justify="right")
    table.add_column()
    for name, value, note in _summary(plan):
        table.add_row(name, value, note)
    Console(file=stream).print(table)


def _summary(plan: SolvedPlan) -> Iterator[tuple[str, str, str]]:
    """Yield rows: what, how much, a note."""
    from collections import Counter

    def area(part: float) -> str:
        return f"{part:.3f} m²"

    def share(part: float) -> str:
        return f"{part / plan.surface_area:.1%} of the surface"

    yield "cost", f"{plan.cost:.2f}", f"of 1000, on {plan.samples} samples of seed {plan.seed}"
    if plan.lower_bound is not None and plan.gap is not None:
        note = f"no plan costs less on those: within {100 * plan.gap:.3g} % of the best"
        yield "lower bound", f"{plan.lower_bound:.2f}", note
    fresh = f"{plan.fresh_cost:.2f} ± {plan.fresh_standard_error:.2f}"
    yield "fresh cost", fresh, f"on {plan.fresh_samples} samples that the solver did not see"
    yield "surface", area(plan.surface_area), ""
    yield "seen", area(plan.covered_area), share(plan.covered_area)
    in_focus = f"{plan.in_focus_area:.3f} ± {area(plan.in_focus_standard_error)}"
    yield "in focus", in_focus, share(plan.in_focus_area)
    yield "solved in", f"{plan.solve_seconds:.3f} s", "" if plan.converged else "ended early"
    yield "all in", f"{plan.total_seconds:.3f} s", ""
    if plan.shots > 1:
        used = sum(shot.assigned_samples > 0 for camera in plan.cameras for shot in camera.shots)
        yield "shots", str(plan.shots * len(plan.cameras)), f"{used} of use"
    for status, count in sorted(Counter(c.status for c in plan.cameras).items()):
        yield "cameras", str(count), status.name.lower().replace("_", " ")


@contextmanager
def _progress(quiet: bool) -> Iterator[Tell]:
    """Show a person what is being done; yield what to tell it with."""
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status("") as status:
        yield status.update


# --- options -----------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Says in one line what is wrong."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        self.exit(_fail(f"{message} (see {self.prog} --help)"))


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print("focus_planner", version("focus_planner"))
        except PackageNotFoundError:
            print("focus_planner, not installed")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="focus_planner",
        description="Plan the focus distance of every camera of a multi-view capture rig.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_rig(commands)
    _add_plan(commands)
    _add_node(commands)
    _add_demo(commands)
    return parser


def _add_rig(commands: Any) -> None:
    rig = commands.add_parser(
        "rig", help="make a rig.yaml by rule", description="Print a rig.yaml made by rule."
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND", required=True)
    cylinder = kinds.add_parser(
        "cylinder",
        help="cameras on a cylinder that look at its axis",
        description="Print the rig.yaml of cameras on a cylinder about the z axis, looking"
        " horizontally at it; column j stands at the angle 2πj/columns from +x, row by row from"
        " the bottom. The values in brackets, the paper's, hold where none is given.",
    )
    cylinder.set_defaults(command=_rig_cylinder)
    add = cylinder.add_argument
    add("--rows", type=int, default=7, metavar="N", help="(7)")
    add("--columns", type=int, default=24, metavar="N", help="(24)")
    add("--radius", type=float, default=0.75, metavar="M", help="metres (0.75)")
    add("--bottom", type=float, default=0.1, metavar="M", help="z of the lowest row, metres (0.1)")
    add("--top", type=float, default=1.7, metavar="M", help="z of the highest row, metres (1.7)")
    add("--frame-id", default="world", metavar="NAME", help="the frame of the poses (world)")
    lens = cylinder.add_argument_group("lens")
    for name, settings in _LENS_OPTIONS.items():
        option = f"--{name.replace('_', '-')}"
        lens.add_argument(option, **{"type": float, "metavar": "X"} | settings)


def _add_plan(commands: Any) -> None:
    plan = commands.add_parser(
        "plan",
        help="plan focus distances for a surface and a rig",
        description="Plan the focus distances of all cameras. Prints a summary on a terminal, and"
        " plan.json where the output is piped.",
    )
    plan.set_defaults(command=_plan)
    add = plan.add_argument
    add("surface", type=Path, metavar="SURFACE", help="a mesh or point-cloud file, in metres")
    add("--rig", type=Path, required=True, metavar="RIG.YAML", help="the cameras")
    add(
        "--importance",
        type=Path,
        metavar="FILE",
        help="how much each vertex or point counts: a text, one number a line, or a .npy;"
        " instead of the property importance, or weight, of SURFACE",
    )
    add("--quiet", action="store_true", help="no progress, no summary")
    how = plan.add_argument_group("how to plan")
    add = how.add_argument
    add("--method", metavar="NAME", help="closest, average, em, k_view or optimal (k_view)")
    add("--k", type=int, metavar="N", help="cameras that k_view moves together, 2 or 3 (2)")
    add(
        "--scope",
        metavar="NAME",
        help="samples that a k_view step may re-assign: all that its cameras see, or those"
        " assigned to them (all)",
    )
    add(
        "--tuples",
        metavar="NAME",
        help="k_view's tuples: overlap, of cameras that see the same, or grid, of neighbours on"
        " the rig's grid (overlap)",
    )
    add(
        "--samples",
        type=int,
        metavar="N",
        help="how many to plan on; 0 takes a cloud's points themselves, and on a mesh as many as"
        " --standard-error asks for (4096)",
    )
    add("--seed", type=int, metavar="N", help="the same seed gives the same plan (0)")
    add("--shots", type=int, metavar="N", help="pictures that each camera takes (1)")
    add(
        "--depth-tolerance",
        type=float,
        metavar="M",
        help="how far depths may be off either way, metres: what is then still in focus counts (0)",
    )
    add(
        "--time-budget",
        type=float,
        metavar="S",
        help="end after S seconds with the best plan so far and its bound; samples that half of"
        " them do not suffice for are left out (none)",
    )
    add(
        "--fresh-samples",
        type=int,
        metavar="N",
        help="how many to judge the plan on, which the solver does not see (4096)",
    )
    add(
        "--standard-error",
        type=float,
        metavar="X",
        help="with --samples 0 on a mesh, the standard error that the cost is to have; both"
        " numbers of samples are then chosen for it (2)",
    )
    add(
        "--bound",
        metavar="NAME",
        help="what to spend on proving how near the plan is to the best: none, quick or tight;"
        " optimal always proves it (quick)",
    )
    add(
        "--gap",
        type=float,
        metavar="X",
        help="how near the best is near enough for optimal, and for a tight bound, as a part of"
        " the cost (1e-4)",
    )
    what = plan.add_argument_group("what to write")
    add = what.add_argument
    add("--output", type=Path, metavar="PLAN.JSON", help="the plan")
    add("--problem", type=Path, metavar="PROBLEM.NPZ", help="the discrete problem, to check it")
    add("--picture", type=Path, metavar="PLAN.PNG", help="what the plan costs on the surface")


def _add_node(commands: Any) -> None:
    commands.add_parser(
        "node",
        help="run the ROS 2 node; --ros-args and all that follows go to it",
        usage="%(prog)s [--ros-args ...]",
        description="Run the ROS 2 node, the same as planner_node. What follows goes to it.",
    )


def _add_demo(commands: Any) -> None:
    demo = commands.add_parser(
        "demo",
        help="plan for a human body through ROS and show the plan beside the baselines",
        description="Start the node, publish a body and a rig, call the service, and compare the"
        " plan with the baselines.",
    )
    demo.set_defaults(command=_demo)
    demo.add_argument(
        "--output",
        type=Path,
        default=Path("demo_output"),
        metavar="DIR",
        help="where pictures and plans go (demo_output)",
    )
