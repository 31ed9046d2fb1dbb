# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command line without what only POSIX has, as on Windows, as far as that can be played here.

There are no modules and names of POSIX, locks are those of Windows, folders cannot be opened, and
no file that is open can be renamed or deleted, nor a folder with one in it. Libraries are left
alone: they have been imported before. Argument: commands as JSON, lists of words, of which RUN is
the run that was recorded.
"""

from __future__ import annotations

import errno
import fcntl
import importlib
import json
import os
import pathlib
import re
import shutil
import signal
import stat
import sys
import tempfile
import types
import warnings
from contextlib import suppress
from pathlib import Path

LIBRARIES = (
    *("numba", "numba.np.ufunc.parallel", "numpy", "open3d", "scipy.spatial", "scipy.sparse"),
    *("argcomplete", "lz4.frame", "mapbox_earcut", "mcap.reader", "mcap.writer", "PIL.Image"),
    *("rich.live", "rich.table", "rosbags.typesys", "yaml", "zstandard", "concurrent.futures"),
    *("matplotlib.pyplot", "multiprocessing.connection", "scipy.optimize", "uuid", "webbrowser"),
    *("importlib.metadata", "platform", "tempfile", "matplotlib.backends.backend_agg"),
)
MODULES = ("fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty")
OF_OS = re.findall(
    r"\w+",
    """
    O_NONBLOCK O_NOCTTY O_DIRECTORY O_CLOEXEC O_NOFOLLOW fork forkpty geteuid getuid getegid getgid
    fchmod chown fchown lchown mkfifo mknod openpty posix_spawn statvfs fstatvfs sysconf uname
    getpgid killpg setsid wait waitid WNOHANG pidfd_open sched_getaffinity pread pwrite sendfile
    fdatasync sync getloadavg nice
    """,
)
OF_SIGNAL = re.findall(
    r"\w+",
    """
    SIGALRM SIGHUP SIGCHLD SIGKILL SIGPIPE SIGUSR1 SIGUSR2 SIGSTOP pthread_sigmask pthread_kill
    sigwait sigtimedwait alarm setitimer siginterrupt pidfd_send_signal SIG_BLOCK SIG_UNBLOCK
    """,
)
BYTE = 1 << 40  # where the package locks

renamed = []


def denied(path):
    return PermissionError(errno.EACCES, "it is open in a process", str(path))


def open_files():
    for descriptor in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # the one that lists them
            yield descriptor.readlink()


def check_closed(path):
    path = Path(os.path.realpath(path))
    if any(file == path or path in file.parents for file in open_files()):
        raise denied(path)


def locking(descriptor, how, count):
    assert (os.lseek(descriptor, 0, os.SEEK_CUR), count) == (BYTE, 1)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if how == msvcrt.LK_LOCK else fcntl.LOCK_NB))
    except BlockingIOError:
        raise denied(descriptor) from None


def take_away():
    for module in MODULES:
        sys.modules[module] = None
    for owner, names in ((os, OF_OS), (signal, OF_SIGNAL)):
        for name in names:
            vars(owner).pop(name, None)
    os.O_BINARY, os.O_NOINHERIT = 0, 0


def play_files():
    os_open, rename, replace, unlink = os.open, os.rename, os.replace, os.unlink

    def open_(path, flags, *rest, **more):
        if not flags & os.O_CREAT and stat.S_ISDIR(Path(path).stat().st_mode):
            raise denied(path)
        return os_open(path, flags, *rest, **more)

    def rename_(source, target):
        renamed.append(str(target))
        if os.path.lexists(target):
            raise FileExistsError(errno.EEXIST, "it is there", str(target))
        check_closed(source)
        rename(source, target)

    def replace_(source, target):
        check_closed(source)
        check_closed(target)
        replace(source, target)

    def unlink_(path):
        check_closed(path)
        unlink(path)

    shutil._use_fd_functions = False
    tempfile.TemporaryFile = tempfile.NamedTemporaryFile
    os.open, os.rename, os.replace = open_, rename_, replace_
    os.unlink = os.remove = unlink_
    # Before Python 3.11, pathlib took them when it was imported.
    accessor = getattr(pathlib, "_NormalAccessor", None)
    if accessor is not None:
        accessor.rename, accessor.replace = staticmethod(rename_), staticmethod(replace_)
        accessor.unlink = staticmethod(unlink_)


for library in LIBRARIES:
    importlib.import_module(library)
msvcrt = types.SimpleNamespace(LK_LOCK=1, LK_NBLCK=2, locking=locking)
sys.modules["msvcrt"] = msvcrt
take_away()
play_files()
warnings.filterwarnings("error", category=EncodingWarning, module=r"focus_planner\..*")
sys.platform = "win32"

from focus_planner.cli.main import main  # noqa: E402 - with all that in place

for command in json.loads(sys.argv[1]):
    # Those that read a run read the one that was recorded.
    words = [str(next(Path("runs").iterdir())) if word == "RUN" else word for word in command]
    if status := main(words):
        sys.exit(f"{command[0]}: status {status}")
assert [name for name in renamed if "runs" in Path(name).parts], renamed
