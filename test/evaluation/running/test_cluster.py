# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Workers of Dask: on this machine, and of a scheduler in a process of its own."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from distributed import LocalCluster

from focus_planner.core.validation import InputError
from focus_planner.evaluation.results.store import opened
from focus_planner.evaluation.running import cluster as cluster_module
from focus_planner.evaluation.running import connecting
from focus_planner.evaluation.running.connecting import connected, local_cluster
from focus_planner.evaluation.running.here import Here
from focus_planner.evaluation.running.program import program
from focus_planner.evaluation.running.running import WorkersLostError, run
from testing import evaluating, experiments
from testing.experiments import CONDITIONS, LEVELS, PAIRS, SLOW, TROUBLED, Box, boxes

pytestmark = pytest.mark.processes
ROOT = Path(__file__).parents[3]
DASK = (sys.executable, "-m", "dask")


def evaluate(folder, where, experiment, sources, on_progress=lambda _: None):
    with opened(folder, CONDITIONS, sources) as store:
        return run(experiment, sources, CONDITIONS, store, where, on_progress)


def rows(folder, experiment):
    return (folder / experiment.name / "results.csv").read_bytes()


def rows_here(folder, experiment, sources):
    evaluate(folder / "here", Here(), experiment, sources)
    return rows(folder / "here", experiment)


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Let slow tasks be slow on workers only, which are other processes."""
    monkeypatch.setattr(experiments, "SECONDS", 0.0)


def wait_for(happened):
    while not happened():
        time.sleep(0.05)


@pytest.fixture(scope="module")
def two_workers():
    with local_cluster(2) as where:
        yield where


@contextmanager
def started(*command):
    """Start a program of Dask, which ends with the block, whatever state it is in."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, env=environment) as process:
        try:
            yield process
        finally:
            process.kill()


def worker(address):
    return started(*DASK, "worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny")


@contextmanager
def scheduler(folder):
    """Start a scheduler in a process of its own; yield it and its address."""
    note = folder / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", note)
    with started(*DASK, "scheduler", *map(str, options)) as process:
        wait_for(lambda: note.exists() and "}" in note.read_text())
        yield process, note.read_text().split('"address": "')[1].split('"')[0]


# --- on this machine -----------------------------------------------------------------------------


@pytest.mark.parametrize("experiment", [LEVELS, PAIRS], ids=lambda each: each.name)
def test_workers_find_what_one_process_finds(tmp_path, two_workers, experiment):
    outcome = evaluate(tmp_path / "there", two_workers, experiment, boxes(4))
    assert outcome.done == outcome.total
    assert rows(tmp_path / "there", experiment) == rows_here(tmp_path, experiment, boxes(4))


def test_a_subject_is_unpacked_once_not_for_every_task(tmp_path, two_workers):
    log = tmp_path / "log"
    evaluate(tmp_path / "there", two_workers, LEVELS, boxes(4, log=log))
    unpacked = Counter(line.split()[0] for line in log.read_text().splitlines())
    assert unpacked == {f"box{number}": 1 for number in range(4)}


def test_a_killed_worker_loses_nothing(tmp_path, two_workers):
    pids = list(two_workers._client.run(os.getpid).values())

    def kill_one(standing):
        if standing.done >= 2 and pids:
            os.kill(pids.pop(), signal.SIGKILL)
            pids.clear()

    outcome = evaluate(tmp_path / "there", two_workers, SLOW, boxes(3), kill_one)
    assert not pids
    assert (outcome.done, outcome.failures) == (12, ())
    assert rows(tmp_path / "there", SLOW) == rows_here(tmp_path, SLOW, boxes(3))


def test_what_kills_its_worker_is_told_and_the_others_go_on(tmp_path, two_workers):
    outcome = evaluate(tmp_path, two_workers, TROUBLED, [Box("good")])
    assert outcome.done == 1
    reasons = dict(outcome.failures)
    assert set(reasons) == {f"good (trouble {each})" for each in ("refuse", "raise", "kill")}
    assert "died whenever it was tried" in reasons["good (trouble kill)"]
    assert reasons["good (trouble raise)"] == "internal error: ZeroDivisionError: by nothing"


def test_a_subject_that_kills_its_worker_is_told_and_the_others_go_on(tmp_path, two_workers):
    sources = [Box("good"), Box("deadly", trouble="kill")]
    outcome = evaluate(tmp_path, two_workers, LEVELS, sources)
    assert outcome.done == 4
    assert [name for name, _ in sorted(outcome.failures)] == [
        f"deadly (level {level})" for level in range(4)
    ]
    assert all("died whenever it was tried" in why for _, why in outcome.failures)


def test_what_the_caller_raises_ends_the_run(tmp_path, two_workers):
    def interrupt(standing):
        if standing.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate(tmp_path / "there", two_workers, SLOW, boxes(3), interrupt)
    outcome = evaluate(tmp_path / "there", two_workers, SLOW, boxes(3))
    assert outcome.resumed >= 1
    assert rows(tmp_path / "there", SLOW) == rows_here(tmp_path, SLOW, boxes(3))


@pytest.mark.parametrize(("how", "status"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_an_evaluation_that_is_ended_leaves_no_process_and_resumes(tmp_path, how, status):
    folder = tmp_path / "there"
    seconds = folder / "slow" / "seconds.csv"
    command = (sys.executable, evaluating.__file__, str(folder), "8")
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    ) as process:
        wait_for(lambda: seconds.exists() and seconds.read_bytes().count(b"\n") > 2)
        if how == signal.SIGINT:  # as typed, for all processes of a terminal
            os.killpg(process.pid, how)
        else:
            process.kill()
        # Its workers hold the pipe too: this ends when all have ended.
        said = process.communicate()[0]
        if how == signal.SIGINT:
            assert said == b""
        assert b"Traceback" not in said
        assert process.returncode == status
    assert evaluate(folder, Here(), SLOW, boxes(8)).resumed >= 2
    assert rows(folder, SLOW) == rows_here(tmp_path, SLOW, boxes(8))


def test_a_cluster_has_workers():
    with pytest.raises(InputError, match="workers: expected a whole number of at least 1"):
        local_cluster(0).__enter__()


# --- of a scheduler ------------------------------------------------------------------------------


def test_any_number_of_workers_finds_the_same_and_a_lost_scheduler_is_told(tmp_path):
    expected = rows_here(tmp_path, SLOW, boxes(4))
    with ExitStack() as stack:
        process, address = stack.enter_context(scheduler(tmp_path))
        where = stack.enter_context(connected(address))
        assert where.count == 0
        workers = [stack.enter_context(worker(address)) for _ in range(3)]
        for count in (3, 2, 1):
            wait_for(lambda count=count: where.count == count)
            folder = tmp_path / f"with {count}"
            assert evaluate(folder, where, SLOW, boxes(4)).failures == ()
            assert rows(folder, SLOW) == expected
            if count > 1:
                workers.pop().kill()

        def kill_it(standing):
            if standing.done >= 2:
                process.kill()

        folder = tmp_path / "lost"
        with pytest.raises(WorkersLostError, match=r"is gone; what was done is kept"):
            evaluate(folder, where, SLOW, boxes(4), kill_it)
    assert evaluate(folder, Here(), SLOW, boxes(4)).resumed >= 2
    assert rows(folder, SLOW) == expected


@pytest.fixture(scope="module")
def threads():
    """A scheduler and a worker in this process, which runs two tasks at once."""
    with LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=False,
        protocol="tcp://",
        host="127.0.0.1",
        dashboard_address=None,
        scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
    ) as cluster:
        yield cluster.scheduler_address


def test_workers_that_run_several_tasks_at_once_are_refused(threads):
    with pytest.raises(InputError, match=r"threads 1, got threads 2; .*--nthreads 1"):
        connected(threads).__enter__()


@pytest.mark.parametrize("name", ["focus_planner", "sources", "python", "numba"])
def test_workers_of_another_program_are_refused(threads, monkeypatch, name):
    theirs = program()
    monkeypatch.setattr(cluster_module, "program", lambda: {**theirs, name: "other"})
    with pytest.raises(InputError, match=f"expected {name} other, .*got {name} {theirs[name]}"):
        connected(threads).__enter__()


def test_workers_that_come_later_are_compared_too(tmp_path, two_workers, monkeypatch):
    monkeypatch.setitem(two_workers._program, "sources", "other")
    with pytest.raises(InputError, match="expected sources other, got sources"):
        evaluate(tmp_path, two_workers, LEVELS, boxes(1))


@pytest.mark.parametrize("address", ["", "here", "http://127.0.0.1:80", "127.0.0.1:99999", ":8786"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(InputError, match="--scheduler: expected an address such as"):
        connected(address).__enter__()


def test_a_scheduler_that_does_not_answer_is_told(monkeypatch):
    monkeypatch.setattr(connecting, "_SECONDS_TO_CONNECT", 0.2)
    with pytest.raises(InputError, match=r"127\.0\.0\.1:9, where none does"):
        connected("127.0.0.1:9").__enter__()
