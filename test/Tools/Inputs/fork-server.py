#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Asks of a tool what would differ if a fork server did not give it all that it
has as a process of its own.

  fork-server.py TOOL    (a tool that reads MLIR, by its name)
"""

import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

tool = sys.argv[1]


def run(*arguments, **options):
    options.setdefault("stdin", subprocess.DEVNULL)
    return subprocess.run(
        [tool, *arguments], capture_output=True, text=True, timeout=60, **options
    )


def find_waiting(pipe):
    """What the system says of the tool's process that has the pipe open: its limits
    and what its parent runs; nothing without such a process."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            files = [os.readlink(file) for file in (process / "fd").iterdir()]
            if pipe in files and os.readlink(process / "exe").endswith("/" + tool):
                parent = re.search(r"PPid:\t(\d+)", (process / "status").read_text())
                runs = os.readlink(f"/proc/{parent[1]}/exe")
                return (process / "limits").read_text(), runs
        except OSError:
            pass
    return "", ""


def prepare():
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_NOFILE, (77, 77))


def interrupt(folder, number):
    """How a tool ends that waits for its input."""
    pipe = os.path.join(folder, "pipe")
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDWR)
    process = subprocess.Popen(
        [tool, "-"], stdin=reader, stdout=subprocess.PIPE, preexec_fn=prepare
    )
    os.close(reader)
    # It has them soon after its files.
    while not re.search(r"Max open files +77 +77 ", (waiting := find_waiting(pipe))[0]):
        time.sleep(0.01)
    process.send_signal(number)
    process.wait(timeout=60)
    while any(find_waiting(pipe)):
        time.sleep(0.01)
    os.remove(pipe)
    is_forked = waiting[1].endswith("/" + tool)
    return process.returncode, is_forked


def main():
    assert run("--version").returncode == 0
    wrong = run("--no-such-option")
    assert wrong.returncode == 1 and tool in wrong.stderr, wrong
    assert run("-", input="module {", stdin=None).returncode == 1
    assert run("-", input="module {}", stdin=None).stdout.startswith("module")
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "empty.mlir").write_text("module {}")
        assert run("empty.mlir", "-o", "out", cwd=folder).returncode == 0
        output = pathlib.Path(folder, "out")
        assert output.read_text().startswith("module")
        assert output.stat().st_mode & 0o777 == 0o666 & ~os.umask(0o077)
        output.unlink()
        assert run("empty.mlir", "-o", "out", cwd=folder).returncode == 0
        assert output.stat().st_mode & 0o777 == 0o600
        # An open file by its number, and one that is closed.
        file = os.open(os.path.join(folder, "empty.mlir"), os.O_RDONLY)
        assert run(f"/proc/self/fd/{file}", pass_fds=[file]).returncode == 0
        assert run(f"/proc/self/fd/{file}").returncode == 1
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            code, is_forked = interrupt(folder, number)
            assert code == -number
    print("a fork" if is_forked else "a process of its own")


if __name__ == "__main__":
    main()
