# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Ctrl-C, and what a terminal shows of what takes long."""

import os
import pty
import signal
import subprocess
import sys
import unittest

import piko
from support import DOTS, HERE, run_python

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

# A kernel that ends when it is told to. Once it runs, a thread is Ctrl-C: a signal that
# is raised is handled before raise_signal returns.
ENDLESS = r"""
import piko, signal, sys, threading
import numpy as np
TEXT = '''
#include <piko.h>
struct Flags { piko::Buffer<int> flags; };
struct Wait : piko::Stage<0, 0, 64, int>, piko::Uses<Flags> {
  void schedule(piko::BinId) { specifyOrder(piko::Unordered); }
  void process(const int &) {
    piko::atomicAdd(state().flags[0], 1);
    while (piko::atomicAddFetch(state().flags[1], 0) == 0) {}
  }
};
struct Waiting : piko::Pipe<Flags> {
  Wait wait;
  Waiting() { source(wait); }
};
'''
flags = np.zeros(2, "i4")
pipe = piko.Pipeline(TEXT, domain=(1, 1), flags=flags, threads=1)
pipe.feed("wait", [0])
def ask():
    while not flags[0]:
        pass
    for _ in range(int(sys.argv[1])):
        signal.raise_signal(signal.SIGINT)
    flags[1] = 1
threading.Thread(target=ask).start()
try:
    pipe.run()
except KeyboardInterrupt:
    print("interrupted")
pipe.run()
print("end")
"""
CANNOT = (
    "\npiko: the run ends when its kernel has ended, and a kernel cannot be stopped;"
    " Ctrl-\\ ends the process\n"
)


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

    def test_endless_kernel(self):
        """The second Ctrl-C is answered, once."""
        for count, said in ((1, ""), (2, CANNOT), (3, CANNOT)):
            done = run_python(ENDLESS, count)
            self.assertEqual((done.stdout, done.stderr), ("interrupted\nend\n", said))

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


# What takes long, or would.
WORKS = {
    "compile": "piko.compile(TABLE + f'// {time.time_ns()}', name='table.piko.cpp')",
    "run": "make().run()",
    "compare": "piko.compare(make(), against='gpu-on-cpu')",
    "capture": "make().capture('/dev/null')",
    "tune": "piko.tune(make(), space=['schedules'], budget=64)",
    "chart": "piko.speed_error(make(), {'a': {}, 'b': {'threads': 1}}, rounds=1)",
}
PROGRESS = """
import piko, sys, time
from support import TABLE
def make():
    pipe = piko.Pipeline(TABLE, domain=(1, 1), values=[0] * 9, name="table.piko.cpp")
    pipe.feed("set", list(range(9)))
    return pipe
"""
# That of the whole, of which compiling and running are parts.
SHOWN = {
    "compile": r"compiling table\.piko\.cpp \.\.\. 0 s",
    "run": r"running Table \.\.\. 0 s",
    "compare": r"comparing Table with gpu-on-cpu \.\.\. 0 s",
    "capture": r"writing /dev/null \.\.\. 0 s",
    "tune": r"tuning Table \.\.\. 0 s",
    "chart": r"measuring 2 variants \[#{20}\.{20}\] 50%",
}


class Progress(unittest.TestCase):
    def run_with(self, work, stderr, after="0"):
        return subprocess.run(
            [sys.executable, "-c", PROGRESS + WORKS[work]],
            cwd=HERE,
            env={**os.environ, "PIKO_PROGRESS_AFTER": after},
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            timeout=100,
        )

    def run_on_terminal(self, work, after="0"):
        ours, theirs = pty.openpty()
        try:
            done = self.run_with(work, theirs, after)
            os.write(theirs, b"end")  # so that there is something to read
            shown = os.read(ours, 100000).decode()
        finally:
            os.close(ours)
            os.close(theirs)
        self.assertEqual((done.returncode, done.stdout), (0, ""), shown)
        return shown.removesuffix("end")

    def test_terminal(self):
        for work, pattern in SHOWN.items():
            with self.subTest(work):
                shown = self.run_on_terminal(work)
                self.assertRegex(shown, r"\r" + pattern + r"\x1b\[K")
                self.assertTrue(shown.endswith("\r\x1b[K"), shown)
                self.assertNotIn("\n", shown)

    def test_before(self):
        """Nothing of what does not take as long as is asked for."""
        self.assertEqual(self.run_on_terminal("run", after="1000"), "")

    def test_no_terminal(self):
        for work in WORKS:
            with self.subTest(work):
                done = self.run_with(work, subprocess.PIPE)
                self.assertEqual((done.returncode, done.stderr, done.stdout), (0, "", ""))


if __name__ == "__main__":
    unittest.main()
