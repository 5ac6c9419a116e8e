# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Comparing with the reference executor, and tuning."""

import os
import tempfile
import unittest
from pathlib import Path

import numpy as np

import piko
from support import DOTS, make_pipe

# With a square root that need not be exact, and values that are none.
ROOTS = """#include <piko.h>
constexpr int steps = piko::tunable("steps", 400, 4);
struct State { piko::Buffer<glm::vec2> roots; };
struct Root : piko::Stage<0, 0, 64, float>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyPrecision(piko::Precision::Relaxed); }
  void process(const float &x) {
    float sum = 0;
    for (int i = 0; i < steps; ++i)
      sum += piko::sqrt(x + float(i % 4));
    state().roots[piko::toInt(x)] = glm::vec2(x / (x + 3.0f), sum / float(steps));
  }
};
struct Roots : piko::Pipe<State> {
  Root root;
  Roots() { source(root); }
};
"""


class Compare(unittest.TestCase):
    def test_equal(self):
        pipe = make_pipe(opt_level=0)
        before = pipe["weights"].copy()
        found = piko.compare(pipe)
        self.assertTrue(found, str(found))
        self.assertEqual(str(found), "cpu against reference: equal")
        np.testing.assert_array_equal(pipe["weights"], before)
        self.assertTrue(piko.compare(pipe, against="gpu-on-cpu"))

    def test_different(self):
        roots = np.zeros((64, 2), "f4")
        pipe = piko.Pipeline(ROOTS, domain=(1, 1), roots=roots, opt_level=0)
        pipe.feed("root", np.arange(64, dtype="f4"))
        found = piko.compare(pipe)
        self.assertFalse(found)
        (first, *_) = found.differences
        self.assertEqual((first.state, first.field), ("roots", ""))
        self.assertEqual(len(first.index), 1)
        self.assertNotEqual(first.expected, first.actual)
        self.assertGreater(first.count, 0)
        self.assertLess(first.largest, 1e-4)
        self.assertRegex(str(found), r"roots\[\d+\]: expected \[.*\], but got \[.*\]; ")
        self.assertTrue(piko.compare(pipe, tolerance=1e-4))
        self.assertEqual(pipe["roots"].tolist(), [[0, 0]] * 64)
        with self.assertRaises(ValueError):
            piko.compare(pipe, tolerance=-1)
        for function in (piko.compare, piko.tune):
            with self.assertRaisesRegex(TypeError, "expected a pipeline, but got int"):
                function(3)

    def test_errors(self):
        """Both end alike, or that is the difference."""
        pipe = piko.Pipeline(DOTS, "Outside", domain=(1, 1), values=[0], opt_level=0)
        pipe.feed("store", [3])
        found = piko.compare(pipe, against="gpu-on-cpu")
        self.assertTrue(found, str(found))
        self.assertIn("stage 'store'", found.actual_error)
        # The reference executor names the stage's class, and the pipeline.
        found = piko.compare(pipe)
        self.assertTrue(found, str(found))
        said = "bin 0: expected an index into 'values' in [0, 1), but got 3"
        self.assertEqual(
            str(found),
            "cpu against reference: both failed\n"
            f"  reference: pipeline 'Outside': stage 'Store', {said}\n"
            f"  cpu: stage 'store', {said}",
        )
        other = piko.Comparison("cpu", "reference", (), None, found.actual_error)
        self.assertFalse(other)
        self.assertEqual(
            str(other),
            "cpu against reference: different\n"
            f"  reference: no error\n  cpu: stage 'store', {said}",
        )
        other = piko.Comparison("cpu", "reference", (), said, said.replace("3", "4"))
        self.assertFalse(other)

    def test_shapes(self):
        """What was bound with another shape, or as plain numbers of records."""
        pipe = make_pipe(opt_level=0)
        pipe["tints"] = np.full((4, 5, 5, 3), 0.25, "f4")
        pipe["weights"] = np.linspace(0, 1, 100, dtype="f4").reshape(4, 25)
        self.assertTrue(piko.compare(pipe))
        pipe = piko.Pipeline(ROOTS, domain=(1, 1), roots=np.zeros((8, 8, 2), "f4"))
        pipe.feed("root", np.arange(64, dtype="f4").reshape(2, 4, 8))
        (first,) = piko.compare(pipe).differences
        self.assertEqual(len(first.index), 2)
        self.assertLessEqual(first.count, 64)


class Tune(unittest.TestCase):
    def make(self):
        pipe = piko.Pipeline(ROOTS, domain=(3, 2), roots=np.zeros((4096, 2), "f4"))
        pipe.feed("root", np.arange(4096, dtype="f4"))
        pipe.threads = 1
        return pipe

    def test_tunables(self):
        """A hundredth of the steps gives nearly the same."""
        tuned = piko.tune(
            self.make(), error=0.5, space=["tunables"], budget=40, clock="cpu"
        )
        self.assertEqual((tuned.pipeline, tuned.tunables), ("Roots", {"steps": 4}))
        self.assertEqual(tuned.report["chosen"], "Roots steps=4")
        self.assertIn("ms", tuned.measured)
        # Of a pipeline's own domain, which is no scene's.
        size = (tuned.measured["width"], tuned.measured["height"])
        self.assertEqual(size, (3, 2))
        self.assertNotIn("lights", tuned.measured)
        self.assertRegex(
            repr(tuned), r"^<piko.Tuned Roots steps=4: [\d.]+ ms, the text's [\d.]+ ms>$"
        )
        self.assertRegex(
            str(tuned),
            r"^Roots steps=4: .* ms, .* times as fast as Roots \(.*\)\n"
            r"error \(max\): .*, of 0.5\n(.*\n)*\d+ runs of 2 settings, .*$",
        )
        program = piko.compile(ROOTS, tuned=tuned)
        self.assertEqual(
            program.code_hash, piko.compile(ROOTS, tunables={"steps": 4}).code_hash
        )
        with tempfile.TemporaryDirectory() as folder:
            tuned.save(Path(folder) / "tuned.json")
            again = piko.compile(ROOTS, tuned=os.path.join(folder, "tuned.json"))
            self.assertEqual(again.code_hash, program.code_hash)

    def test_budget(self):
        """Of what is not tried there is a warning, from the caller's line."""
        with self.assertWarnsRegex(
            UserWarning,
            r"^the budget of 6 is too small for \d+ changes of one value; budget=\d+ is"
            " enough$",
        ) as caught:
            tuned = piko.tune(self.make(), budget=6, space=["passes"], clock="cpu")
        self.assertEqual(caught.filename, __file__)
        needed = tuned.report["needed_budget"]
        self.assertEqual(f"; budget={needed} is enough" in str(tuned), True)
        self.assertNotIn("--", str(tuned))

    def test_errors(self):
        with self.assertRaisesRegex(piko.TuneError, "cannot run piko-tune"):
            piko.tune(self.make(), tool="/nonexistent/piko-tune")
        with tempfile.TemporaryDirectory() as folder:
            tool = Path(folder) / "piko-tune"
            tool.write_text("#!/bin/sh\necho no such library >&2\nexit 127\n")
            tool.chmod(0o755)
            with self.assertRaisesRegex(piko.TuneError, r"no such library \(on Debian"):
                piko.tune(self.make(), tool=tool)
        pipe = piko.Pipeline(ROOTS, tunables={"steps": 4})
        with self.assertRaisesRegex(ValueError, "takes no program with tunable"):
            pipe.domain = (1, 1)
            pipe.allocate("roots", 1)
            piko.tune(pipe)


if __name__ == "__main__":
    unittest.main()
