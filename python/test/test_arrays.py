# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What sources and buffers take."""

import os
import unittest

import numpy as np

import piko
from support import make_dots, make_pipe, run_python

SUMS = """#include <piko.h>
struct State {
  piko::Buffer<glm::vec4> rows;
  piko::Buffer<float> sums;
  float bias = 0;
};
struct Add : piko::Stage<0, 0, 64, glm::vec4>, piko::Uses<State> {
  void process(const glm::vec4 &v) {
    state().sums[piko::toInt(v.w)] = v.x + v.y + v.z + state().rows[0].x +
                                       state().bias;
  }
};
struct Sums : piko::Pipe<State> {
  Add add;
  Sums() { source(add); }
};
"""


class OnlyDLPack:
    """An array of a library that knows DLPack and nothing else."""

    def __init__(self, array, device=None):
        self.array, self.device = array, device

    def __dlpack__(self, stream=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.device or self.array.__dlpack_device__()


class Arrays(unittest.TestCase):
    def setUp(self):
        rows = np.ones((1, 4), "f4")
        self.sums = np.zeros(3, "f4")
        self.pipe = piko.Pipeline(SUMS, domain=(1, 1), rows=rows, sums=self.sums)
        self.points = np.array([[1, 2, 3, 0], [4, 5, 6, 1], [7, 8, 9, 2]], "f4")

    def check(self):
        self.pipe.run()
        self.assertEqual(self.sums.tolist(), [7, 16, 25])
        self.sums[:] = 0

    def test_plain_numbers(self):
        self.pipe.feed("add", self.points)
        self.check()
        self.points += 1  # in place
        self.points[:, 3] -= 1
        self.pipe.run()
        self.assertEqual(self.sums.tolist(), [10, 19, 28])

    def test_structured(self):
        dtype = np.dtype([("at", "f4", 3), ("where", "f4")])
        with self.assertRaisesRegex(ValueError, r"expected \(4,\) of float32, but got \(at"):
            self.pipe.feed("add", np.zeros(3, dtype))
        # Of a record of structs they are named.
        pipe = make_pipe()
        dots = make_dots(pipe.source("plot").dtype)
        pipe.feed("plot", dots)
        wrong = np.dtype([("position", "f4", 2), ("color", "f8", 3), ("id", "i4")])
        with self.assertRaisesRegex(
            ValueError,
            r"source 'plot': field 'color': expected \(3,\) of float32, but got \(3,\)"
            " of float64",
        ):
            pipe.feed("plot", np.zeros(3, wrong))
        with self.assertRaisesRegex(ValueError, "expected records with fields "):
            pipe.feed("plot", np.zeros((3, 6), "f4"))
        with self.assertRaisesRegex(ValueError, "expected one dimension"):
            pipe.feed("plot", dots.reshape(10, 10))

    def test_sequences(self):
        self.pipe.feed("add", self.points.tolist())
        self.check()
        self.pipe.feed(0, [tuple(row) for row in self.points])
        self.check()
        pipe = make_pipe()
        pipe.feed("plot", [((1, 2), (3, 4, 5), 6), ((7, 8), (9, 0, 1), 2)])
        self.assertEqual(pipe.source("plot").count, 2)
        for value in ([(1, 2)], ["a"], 3):
            with self.assertRaisesRegex(ValueError, "source 'plot': "):
                pipe.feed("plot", value)

    def test_shapes(self):
        for value, text in (
            (np.zeros((3, 3), "f4"), r"expected shape \(N, 4\), .* got \(3, 3\)"),
            (np.zeros(4, "f4"), r"expected shape \(N, 4\)"),
            (np.zeros((3, 4), "f8"), "expected float32, but got float64"),
            (np.zeros((3, 4), ">f4"), "expected float32, but got >f4"),
            (np.zeros((3, 8), "f4")[:, ::2], "expected a contiguous array"),
        ):
            with self.assertRaisesRegex(ValueError, "source 'add': .*" + text):
                self.pipe.feed("add", value)
        # A number for each record may have any shape, and so may rows of them.
        volume = np.zeros((1, 3, 1), "f4")
        self.pipe["sums"] = volume
        self.assertIs(self.pipe["sums"], volume)
        self.pipe.feed("add", self.points.reshape(3, 1, 4))
        self.pipe.run()
        self.assertEqual(volume.tolist(), [[[7], [16], [25]]])
        with self.assertRaisesRegex(ValueError, "'sums': expected a contiguous array"):
            self.pipe["sums"] = np.zeros((3, 4), "f4")[:, :2]
        with self.assertRaisesRegex(ValueError, r"expected shape \(N,\), .* got \(\)"):
            self.pipe["sums"] = np.array(1, "f4")
        self.pipe["sums"] = self.sums
        self.pipe.feed("add", np.zeros((0, 4), "f4"))
        self.pipe.run()
        self.assertEqual(self.sums.tolist(), [0, 0, 0])

    def test_read_only(self):
        fixed = self.points.copy()
        fixed.flags.writeable = False
        self.pipe.feed("add", fixed)
        self.check()
        with self.assertRaisesRegex(ValueError, "buffer 'rows': .* may be written"):
            self.pipe["rows"] = fixed

    def test_written_memory_is_apart(self):
        both = np.zeros((3, 4), "f4")
        self.pipe.feed("add", both)
        self.pipe["sums"] = both.reshape(-1)[:3]
        with self.assertRaisesRegex(piko.RunError, "share memory"):
            self.pipe.run()

    def test_dlpack(self):
        self.pipe.feed("add", OnlyDLPack(self.points))
        self.check()
        self.pipe["rows"] = OnlyDLPack(np.zeros((2, 4), "f4"))
        self.pipe.run()
        self.assertEqual(self.sums.tolist(), [6, 15, 24])
        self.assertEqual(self.pipe["rows"].shape, (2, 4))
        for value, text in (
            (OnlyDLPack(self.points.astype("f8")), "expected float32, but got float64"),
            (OnlyDLPack(np.zeros((3, 8), "f4")[:, ::2]), "expected a contiguous array"),
            (OnlyDLPack(np.zeros((3, 4), "c8")), "DLPack's type 5"),
            (OnlyDLPack(self.points, (7, 0)), "but got DLPack's device 7"),
        ):
            with self.assertRaisesRegex(ValueError, "source 'add': .*" + text):
                self.pipe.feed("add", value)
        for interface in ({}, {"data": (0, False)}, {"data": 3}):
            other = type("Other", (), {"__cuda_array_interface__": interface})()
            with self.assertRaisesRegex(ValueError, "source 'add': no __cuda_array"):
                self.pipe.feed("add", other)
        # Of a device that the pipeline is not on.
        with self.assertRaisesRegex(piko.RunError, "expected memory of the host"):
            self.pipe.feed("add", OnlyDLPack(self.points, (2, 0)))


class Devices(unittest.TestCase):
    def test_memory_of_a_device(self):
        driver = os.environ["PIKO_TEST_DRIVER"]
        # In a process of its own: the driver is loaded once.
        code = "import on_device; on_device.main()"
        done = run_python(code, driver, PIKO_CUDA_DRIVER=driver)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, "done\n")

    def test_no_device(self):
        program = piko.compile(SUMS, target="cuda", opt_level=0)
        with self.assertRaises(piko.RunError) as caught:
            program.create()
        self.assertEqual(caught.exception.status, piko.Status.NO_DEVICE)


if __name__ == "__main__":
    unittest.main()
