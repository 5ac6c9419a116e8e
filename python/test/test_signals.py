# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Ctrl-C, and what is said while the compiler works."""

import os
import pty
import signal
import subprocess
import sys
import unittest

import piko
from support import DOTS, HERE, TABLE, run_python

# Each begins a line when it is about to do what takes long.
COMPILE = """
import piko, sys, time
text = open(sys.argv[1]).read()
try:
    print("begin", flush=True)
    while True: # a text that is in no cache
        piko.compile(text + f"// {time.time_ns()}", "Dots")
except KeyboardInterrupt:
    print("interrupted")
"""

# 2^40 hops: years.
RUN = """
import piko, sys
pipe = piko.Pipeline(sys.argv[1], "Countdown", domain=(1, 1), values=[0], threads=2)
pipe.set_loop_limit(1 << 40)
pipe.feed("count", [2000000000])
try:
    print("begin", flush=True)
    pipe.run()
except KeyboardInterrupt:
    print("interrupted")
pipe.feed("count", [3])
pipe.run()
print(pipe["values"].tolist())
"""

# A handler of the user's own is called, and the run goes on to its end.
HANDLED = """
import os, signal, piko, sys
heard = []
signal.signal(signal.SIGINT, lambda *rest: heard.append(rest[0]))
pipe = piko.Pipeline(sys.argv[1], "Countdown", domain=(1, 1), values=[0], threads=2)
pipe.feed("count", [100000])
os.kill(os.getpid(), signal.SIGINT)
pipe.run()
print(heard, pipe["values"].tolist())
"""


class Interrupts(unittest.TestCase):
    def interrupt(self, code):
        """What a program prints that gets SIGINT after its first line."""
        child = subprocess.Popen(
            [sys.executable, "-c", code, str(DOTS)],
            cwd=HERE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.assertEqual(child.stdout.readline(), "begin\n")
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=100)
        self.assertEqual((child.returncode, err), (0, ""))
        return out

    def test_compile(self):
        """At once, and the process ends well although the compiler works on."""
        self.assertEqual(self.interrupt(COMPILE), "interrupted\n")

    def test_run(self):
        self.assertEqual(self.interrupt(RUN), "interrupted\n[7]\n")

    def test_own_handler(self):
        done = run_python(HANDLED, DOTS)
        self.assertEqual((done.stdout, done.stderr), ("[2] [7]\n", ""))

    def test_in_another_thread(self):
        """A run in a thread is not stopped; nothing of the handler stays."""
        before = signal.getsignal(signal.SIGINT)
        pipe = piko.Pipeline(DOTS, "Countdown", domain=(1, 1), values=[0])
        pipe.feed("count", [3])
        pipe.run()
        self.assertIs(signal.getsignal(signal.SIGINT), before)


PROGRESS = """
import piko, sys, time
from piko import _jobs
_jobs.QUIET = 0
piko.compile(sys.stdin.read() + f"// {time.time_ns()}", name="table.piko.cpp")
"""


class Progress(unittest.TestCase):
    def run_with(self, stderr):
        return subprocess.run(
            [sys.executable, "-c", PROGRESS],
            input=TABLE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            timeout=100,
        )

    def test_terminal(self):
        ours, theirs = pty.openpty()
        try:
            self.assertEqual(self.run_with(theirs).returncode, 0)
            shown = os.read(ours, 10000).decode()
        finally:
            os.close(ours)
            os.close(theirs)
        self.assertRegex(shown, r"^\rpiko: compiling table.piko.cpp: \d+ s")
        self.assertTrue(shown.endswith("\r\x1b[K"))

    def test_no_terminal(self):
        self.assertEqual(self.run_with(subprocess.PIPE).stderr, "")


if __name__ == "__main__":
    unittest.main()
