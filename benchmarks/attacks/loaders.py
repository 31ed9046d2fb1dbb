# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Hostile files under every name that leads to a file: of a peer, of the command line, at start."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from rich.console import Console

from benchmarks.attacks import hostile_files
from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import Ran, command, parameter_of, victim
from focus_planner.io.bodies import body

# Seconds within which a parameter's setting is answered, and a command ends.
_ANSWERED, _COMMAND = 5.0, 20.0
# MiB: of a command that reads a good file, and of growth by one that is refused.
_MOST, _GROWTH = 1500.0, 150.0
_RIG = (
    "cameras:\n"
    "  - {name: a, position: [1.0, 0.0, 1.0], orientation: [-0.5, -0.5, 0.5, 0.5]}\n"
    "  - {name: b, position: [-1.0, 0.0, 1.0], orientation: [-0.5, 0.5, -0.5, 0.5]}\n"
)
_SURFACES = (
    "ply",
    "obj",
    "stl",
    "off",
    "glb",
    "gltf",
    "pcd",
    "xyz",
    "csv",
    "npy",
    "las",
    "laz",
    "e57",
)


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    readers = [
        Attack(
            f"as {reader}: each of {len(hostile_files.KINDS)} hostile files",
            f"status 2 and one line without their contents, within {_COMMAND:.0f} s and"
            f" {_MOST:.0f} MiB",
            partial(_read_by, reader),
        )
        for reader in READERS
    ]
    title = "4. One loader for every file that a name can lead to"
    return report(console, title, [tables_by_peer, folder_by_peer, *readers])


@attack(
    "a peer sets lens_tables to hostile files",
    f"an answer within {_ANSWERED:.0f} s, none of their contents in it, the same plan after it,"
    f" growth below {_GROWTH:.0f} MiB",
)
def tables_by_peer(folder: Path) -> Seen:
    """Set the parameter to every file, each on a node that has not seen another one hang it."""
    left, wrong = list(hostile_files.KINDS), []
    while left:
        wrong += _set_tables(left, folder)
    observed = "; ".join(wrong) or "all as asked"
    return Seen(observed, not wrong, len(hostile_files.KINDS))


@attack(
    "a peer sets record_directory: elsewhere, a FIFO, /proc, a file, ../..",
    "refused, or confined to a folder named at start: nothing is written elsewhere",
)
def folder_by_peer(folder: Path) -> Seen:
    """Have a peer choose where runs are written."""
    (folder / "start").mkdir()
    elsewhere = folder / "elsewhere"
    (folder / "file").write_text("")
    hostile_files.write("a FIFO", folder / "fifo")
    hostile_files.write("a private key", folder / "key")
    paths = [elsewhere, folder / "fifo", Path("/proc/1"), folder / "file", folder / "key"]
    paths += [folder / "start" / ".." / "elsewhere", Path("~none_such/x")]
    wrong, quick = [], True
    with victim(folder, record_directory=folder / "start", data_directories=folder / "data") as one:
        for path in paths:
            taken, reason, seconds = parameter_of(one.client, record_directory=str(path))
            quick = quick and seconds < _ANSWERED
            if taken:
                wrong.append(f"{path.name} was taken")
            if hostile_files.quotes_the_key(reason):
                wrong.append("the key is quoted")
            one.check_plan()
    if elsewhere.exists():
        wrong.append(f"{len(list(elsewhere.iterdir()))} runs were written elsewhere")
    return Seen("; ".join(wrong) or "all were refused", quick and not wrong, len(paths))


def _set_tables(left: list[str], folder: Path) -> list[str]:
    """Set kinds of files, and take them off the list, until one does harm; return what harm."""
    wrong, kind = [], "the start"
    try:
        with victim(folder) as one:
            one.check_plan()
            before = one.node.memory
            while left:
                kind = left.pop(0)
                path = hostile_files.write(kind, Path(tempfile.mkdtemp(dir=folder)) / "t.yaml")
                _, reason, seconds = parameter_of(one.client, lens_tables=str(path))
                one.client.set_parameters(lens_tables="")
                one.check_plan()
                if seconds > _ANSWERED:
                    wrong.append(f"{kind}: answered after {seconds:.1f} s")
                if hostile_files.quotes_the_key(reason + one.node.log):
                    wrong.append(f"{kind}: the key is quoted: {reason[:120]}")
            growth = one.node.memory - before
            if growth > _GROWTH:
                wrong.append(f"memory {growth:+.0f} MiB")
    except (AssertionError, TimeoutError) as error:
        wrong.append(f"{kind}: {error}")
    return wrong


def _read_by(reader: str, folder: Path) -> Seen:
    """Give every hostile file to one of the command line's readers."""
    with ThreadPoolExecutor(2) as pool:
        done = pool.map(lambda kind: _read_one(reader, kind, folder), hostile_files.KINDS)
        wrong = [each for each in done if each]
    observed = "; ".join(wrong) or "all were refused"
    return Seen(observed, not wrong, len(hostile_files.KINDS))


def _read_one(reader: str, kind: str, folder: Path) -> str:
    """Return what went wrong, "" if nothing did."""
    mine = Path(tempfile.mkdtemp(dir=folder))
    for ran in READERS[reader](kind, mine):
        if hostile_files.quotes_the_key(ran.err + ran.out):
            return f"{kind}: the key is quoted: {ran.err[-200:]}"
        if not ran.is_refusal and not (kind in hostile_files.MAY_BE_GOOD and _is_clean(ran)):
            return f"{kind}: {ran.told()}"
    return ""


def _is_clean(ran: Ran) -> bool:
    """Return whether a command did what it does with a good file, and nothing else."""
    quiet = not any(word in ran.err for word in ("Traceback", "Warning:", "\x1b"))
    return ran.status == 0 and quiet and "\x1b" not in ran.out


def _run(*argv: object) -> Ran:
    return command(*argv, seconds=_COMMAND, most=_MOST)


def _plan(folder: Path, *options: object, **given: Path) -> Ran:
    rig = given.get("rig")
    if rig is None:
        rig = folder / "good.yaml"
        rig.write_text(_RIG)
    surface = given.get("surface", body("arms_down"))
    quick = ("--quiet", "--method", "closest", "--samples", "50", "--fresh-samples", "50")
    return _run("plan", surface, "--rig", rig, *quick, *options)


def _surface(suffix: str, kind: str, folder: Path) -> Iterator[Ran]:
    yield _plan(folder, surface=hostile_files.write(kind, folder / f"s.{suffix}"))


def _option(option: str, name: str, kind: str, folder: Path) -> Iterator[Ran]:
    yield _plan(folder, option, hostile_files.write(kind, folder / name))


def _rig(kind: str, folder: Path) -> Iterator[Ran]:
    yield _plan(folder, rig=hostile_files.write(kind, folder / "rig.yaml"))


def _colmap(name: str, kind: str, folder: Path) -> Iterator[Ran]:
    suffix = name.rpartition(".")[2]
    for other in ("cameras", "images"):
        if f"{other}.{suffix}" != name:
            (folder / f"{other}.{suffix}").write_text("1 PINHOLE 100 100 50 50 50 50\n")
    hostile_files.write(kind, folder / name)
    yield _run("rig", "colmap", folder)


def _transform(kind: str, folder: Path) -> Iterator[Ran]:
    yield _run("rig", "colmap", folder, "--transform", hostile_files.write(kind, folder / "t.txt"))


def _transforms(kind: str, folder: Path) -> Iterator[Ran]:
    yield _run("rig", "transforms", hostile_files.write(kind, folder / "tf.yaml"))


def _of_program(program: str, name: str, kind: str, folder: Path) -> Iterator[Ran]:
    yield _run("rig", program, hostile_files.write(kind, folder / name))


def _camera_info(kind: str, folder: Path) -> Iterator[Ran]:
    (folder / "tf.txt").write_text("1 0 1 -0.5 -0.5 0.5 0.5 world a_optical\n")
    info = hostile_files.write(kind, folder / "info.yaml")
    yield _run("rig", "transforms", folder / "tf.txt", "--camera-info", info)


def _replay(kind: str, folder: Path) -> Iterator[Ran]:
    yield _run("replay", hostile_files.write(kind, folder / "x.mcap"), "--quiet")


def _metadata(kind: str, folder: Path) -> Iterator[Ran]:
    """Replay a folder of a run whose metadata is hostile and whose file is empty."""
    (folder / "x_0.mcap").write_bytes(b"")
    hostile_files.write(kind, folder / "metadata.yaml")
    yield _run("replay", folder, "--quiet")


def _parameters(kind: str, folder: Path) -> Iterator[Ran]:
    path = hostile_files.write(kind, folder / "params.yaml")
    yield _run("node", "--ros-args", "--params-file", path)


def _tables_at_start(program: str, kind: str, folder: Path) -> Iterator[Ran]:
    path = hostile_files.write(kind, folder / "t.yaml")
    cameras = ("-p", "cameras:=[a]") if program == "lens_adapter" else ()
    yield _run(program, "--ros-args", "-p", f"lens_tables:={path}", *cameras)


READERS: dict[str, Callable[[str, Path], Iterator[Ran]]] = {
    **{f"a surface .{suffix}": partial(_surface, suffix) for suffix in _SURFACES},
    "--rig": _rig,
    "--importance .txt": partial(_option, "--importance", "i.txt"),
    "--importance .npy": partial(_option, "--importance", "i.npy"),
    "--lens-tables": partial(_option, "--lens-tables", "t.yaml"),
    "COLMAP's cameras.txt": partial(_colmap, "cameras.txt"),
    "COLMAP's images.txt": partial(_colmap, "images.txt"),
    "COLMAP's cameras.bin": partial(_colmap, "cameras.bin"),
    "--transform": _transform,
    "tf2 transforms": _transforms,
    "nerfstudio's transforms.json": partial(_of_program, "nerfstudio", "transforms.json"),
    "Metashape's cameras.xml": partial(_of_program, "metashape", "cameras.xml"),
    "RealityScan's cameras.csv": partial(_of_program, "realitycapture", "cameras.csv"),
    "Kalibr's camchain.yaml": partial(_of_program, "kalibr", "camchain.yaml"),
    "--camera-info": _camera_info,
    "a run's MCAP file": _replay,
    "a run's metadata.yaml": _metadata,
    "a node's --params-file": _parameters,
    "lens_tables at the node's start": partial(_tables_at_start, "node"),
    "lens_tables at the adapter's start": partial(_tables_at_start, "lens_adapter"),
}
