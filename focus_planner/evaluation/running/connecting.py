# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Workers of Dask: those of this machine, or of a scheduler somewhere."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import dask
from dask.system import CPU_COUNT
from distributed import Client, LocalCluster
from distributed.comm.addressing import parse_address, parse_host_port
from distributed.utils import LoopRunner
from distributed.versions import VersionMismatchWarning

from focus_planner.core.validation import InputError, check_whole
from focus_planner.evaluation.running.cluster import Cluster

_SECONDS_TO_CONNECT = 10.0
_SECONDS_TO_END = 0.2
_SECONDS_TO_CLOSE = 5.0
_SCHEMES = ("tcp", "tls")
_LAST_PORT = 65_535
_QUIET = logging.CRITICAL + 1
_THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
# Arrays come from memory that the process has: what Dask sets would page each of them in anew.
_MEMORY = {
    "MALLOC_ARENA_MAX": 1,
    "MALLOC_MMAP_THRESHOLD_": 2**25,
    "MALLOC_TRIM_THRESHOLD_": 2**29,
}
_SETTINGS: dict[str, Any] = {
    # A task whose worker died is tried again by itself, so that none is blamed for another.
    "distributed.scheduler.allowed-failures": 0,
    # A kernel that is compiled lets no sign of life through.
    "distributed.scheduler.worker-ttl": None,
    # It takes subjects away from workers between two of their tasks.
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {**dict.fromkeys(_THREADS, 1), **_MEMORY},
    # One that is killed is started again; on a busy machine that may take its time.
    "distributed.deploy.lost-worker-timeout": "1h",
}


@contextmanager
def local_cluster(workers: int | None = None) -> Iterator[Cluster]:
    """Start workers on this machine, on the loopback interface only; they end with the block.

    Parameters
    ----------
    workers : int, optional
        How many, each a process with one thread; by default as many as there are cores for this
        process.

    Raises
    ------
    InputError
        If the number is not at least 1.
    """
    count = check_whole("workers", CPU_COUNT if workers is None else workers, at_least=1)
    _be_quiet()
    with _own_environment(), dask.config.set(_SETTINGS), _loop() as loop:
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            memory_limit=None,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # or 8787 is taken in any case
            silence_logs=_QUIET,
            loop=loop,
        )
        try:
            with _client(cluster, loop) as client:
                yield Cluster(client)
        finally:
            _end(cluster)


@contextmanager
def connected(address: str) -> Iterator[Cluster]:
    """Use the workers of a scheduler, which goes on without this process.

    Parameters
    ----------
    address : str
        ``host:port``, or with the protocol before it, ``tcp://`` or ``tls://``.

    Raises
    ------
    InputError
        If that is no address, no scheduler answers there, or its workers run another program.
    """
    _check_address(address)
    _be_quiet()
    with _loop() as loop, _client(address, loop) as client:
        yield Cluster(client)


@contextmanager
def _client(where: LocalCluster | str, loop: Any) -> Iterator[Client]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VersionMismatchWarning)  # all versions are compared
            client = Client(where, loop=loop, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ImportError, ValueError) as error:
        raise InputError(
            "--scheduler",
            "the address of a Dask scheduler that answers",
            f"{where}, where none does ({type(error).__name__})",
            "start one by: dask scheduler",
        ) from None
    try:
        yield client
    finally:
        with suppress(TimeoutError, OSError):  # of a scheduler that is gone
            client.close(timeout=_SECONDS_TO_CLOSE)


def _check_address(address: str) -> None:
    try:
        scheme, place = parse_address(address)
        host, port = parse_host_port(place)
        is_one = scheme in _SCHEMES and bool(host) and 0 < int(port or 0) <= _LAST_PORT
    except ValueError:
        is_one = False
    if not is_one:
        raise InputError("--scheduler", "an address such as tcp://192.0.2.1:8786", repr(address))


def _be_quiet() -> None:
    """Keep what Dask logs off the terminal of a command."""
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(_QUIET)
    for name in list(logging.Logger.manager.loggerDict):
        if name.startswith(("distributed.", "tornado.")):
            logging.getLogger(name).setLevel(_QUIET)


@contextmanager
def _loop() -> Iterator[Any]:
    """Run an event loop in a thread.

    Workers inherit that Ctrl-C is blocked there: it is typed for all processes of a terminal, but
    only the one that waits for them is to act on it.
    """
    runner = LoopRunner()
    with _blocked_interrupts():
        runner.start()
    try:
        yield runner.loop
    finally:
        runner.stop()


@contextmanager
def _blocked_interrupts() -> Iterator[None]:
    if sys.platform == "win32":
        yield
    else:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _own_environment() -> Iterator[None]:
    """Undo what Dask sets in the environment of this process for those that it starts."""
    before = dict(os.environ)
    os.environ["DASK_LOGGING__DISTRIBUTED"] = "critical"
    try:
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


def _end(cluster: LocalCluster) -> None:
    """End workers without waiting for what they do."""

    async def kill() -> None:
        await asyncio.gather(
            *(each.close(timeout=_SECONDS_TO_END) for each in cluster.workers.values())
        )

    with suppress(TimeoutError, OSError):
        cluster.sync(kill)
    cluster.close(timeout=_SECONDS_TO_CLOSE)
