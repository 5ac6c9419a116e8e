# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Pipelines in several processes: fork, and multiprocessing's ways."""

import multiprocessing
import os
import time
import unittest

import piko
from support import TABLE, make_pipe


def run_table(program, offset):
    pipe = program.create((1, 1), offset=offset, values=[0, 0, 0], threads=2)
    pipe.feed("set", [0, 1, 2])
    pipe.run()
    return pipe["values"].tolist()


def draw(_):
    pipe = make_pipe()
    pipe.run()
    return pipe["image"].tobytes()


class Processes(unittest.TestCase):
    def in_child(self, function):
        """Whether a forked process returns true of a function."""
        child = os.fork()
        if child == 0:
            status = 1
            try:
                status = 0 if function() else 2
            finally:
                os._exit(status)
        self.assertEqual(os.waitpid(child, 0)[1], 0)

    def test_fork(self):
        """What was made before works in both, after a run of several threads."""
        pipe = make_pipe()
        pipe.run()
        expected = pipe["image"].tobytes()

        def use():
            pipe.run()
            return pipe["image"].tobytes() == expected

        self.in_child(use)
        pipe.run()
        self.assertEqual(pipe["image"].tobytes(), expected)

    def test_compile_after_fork(self):
        text = TABLE + f"// {time.time_ns()}"  # that is in no cache
        piko.compile(text)

        def use():
            program = piko.compile(text, tunables={"factor": 5})
            return run_table(program, 1) == [1, 6, 11]

        self.in_child(use)

    def test_pools(self):
        """A program is sent to processes, which find its code in the cache."""
        program = piko.compile(TABLE)
        for method in ("fork", "spawn"):
            context = multiprocessing.get_context(method)
            with context.Pool(2) as pool:
                work = [(program, 10 * i) for i in range(4)]
                found = pool.starmap(run_table, work)
                pictures = pool.map(draw, range(2))
            expected = [[10 * i, 10 * i + 3, 10 * i + 6] for i in range(4)]
            self.assertEqual(found, expected, method)
            self.assertEqual(pictures[0], pictures[1], method)


if __name__ == "__main__":
    unittest.main()
