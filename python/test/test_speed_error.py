# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Speed against error: what is measured, which variants are on the front, what is
written and drawn."""

import csv
import importlib.util
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

import piko
from piko._tune import _find_tool
from support import DOTS, HERE, make_pipe

ROOT = HERE.parent.parent

# A picture that fewer steps give nearly, and half a sum of known error.
RAMP = """#include <piko.h>
constexpr int steps = piko::tunable("steps", 64, 4);
constexpr auto numbers = piko::tunable("numbers", piko::Precision::Strict,
                                       piko::Precision::Relaxed);
struct Pixel { glm::vec3 color{0}; int count = 0; };
struct Canvas { piko::Image<Pixel> image; float shift = 0; };
struct Draw : piko::Stage<8, 8, 64, int>, piko::Uses<Canvas> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId) { specifyPrecision(numbers); }
  void process(const int &) {
    parallelForPixels([&](glm::ivec2 at) {
      float sum = 0;
      for (int i = 0; i < steps; ++i)
        sum += piko::sqrt((float(at.x) + float(i) / float(steps)) / 32.0f);
      update(state().image, at, [&](Pixel &p) {
        p.color = glm::vec3(0.5f * sum / float(steps) + state().shift);
      });
    });
  }
};
struct Ramp : piko::Pipe<Canvas> { Draw draw; Ramp() { source(draw); } };
"""
SIZE = ("--width", "192", "--height", "144")
FAST = {"rounds": 1, "frames": 1, "seconds": 0.01}


def feed(pipe):
    pipe.feed("draw", [0])


def call(*command, **options):
    words = [str(word) for word in command]
    return subprocess.run(words, check=True, capture_output=True, text=True, **options).stdout


def measure(variants, **options):
    """Of pictures of 32 x 16 pixels."""
    options = {"picture": "image.color", "domain": (32, 16), "threads": 1, **options}
    return piko.speed_error(RAMP, variants, setup=feed, **FAST, **options)


class Measures(unittest.TestCase):
    def test_pictures(self):
        """0 for the text as it is; a shift is its own error; fewer steps are near."""
        chart = measure(
            {
                "exact": {},
                "relaxed": {"tunables": {"numbers": "Relaxed"}},
                "coarse": {"tunables": {"steps": 4}},
                "brighter": {"shift": 0.25},
            }
        )
        self.assertEqual((chart.pipeline, chart.metric), ("Ramp", "rms"))
        self.assertEqual([one.variant for one in chart.points],
                         ["exact", "relaxed", "coarse", "brighter"])
        zero = piko.Errors(0, 0, 0, 0, float("inf"), 0)
        self.assertEqual(chart["exact"].errors, zero)
        brighter = chart["brighter"].errors
        for value in (brighter.largest, brighter.mean, brighter.rms, brighter.p99):
            self.assertAlmostEqual(value, 0.25, places=6)
        self.assertAlmostEqual(brighter.psnr, 20 * np.log10(4), places=4)
        self.assertGreater(brighter.flip, 0.1)
        # Square roots within 4 ULP, and the midpoint rule.
        self.assertTrue(0 < chart["relaxed"].errors.rms < 1e-6, chart["relaxed"])
        self.assertTrue(1e-4 < chart["coarse"].errors.rms < 0.1, chart["coarse"])
        self.assertGreater(chart["exact"].ms, 0)
        self.assertEqual(len(chart["exact"].times), 1)

    def test_against_the_definition(self):
        """RMS, mean and largest as NumPy computes them of what two runs leave."""
        chart = measure({"coarse": {"tunables": {"steps": 4}}}, metric="max")
        self.assertEqual(chart.metric, "largest")
        pictures = []
        for steps in (64, 4):
            pipe = piko.Pipeline(RAMP, domain=(32, 16), tunables={"steps": steps})
            feed(pipe)
            pipe.run()
            pictures.append(pipe.read("image")["color"].astype("f8"))
        gaps = np.abs(pictures[0] - pictures[1])
        found = chart["coarse"].errors
        self.assertAlmostEqual(found.largest, gaps.max(), places=7)
        self.assertAlmostEqual(found.mean, gaps.mean(), places=7)
        self.assertAlmostEqual(found.rms, np.sqrt((gaps**2).mean()), places=7)

    def test_as_piko_diff(self):
        """What it says of the files that piko-render writes, of the same pictures."""
        lesson = ROOT / "examples" / "lessons" / "10-numbers"
        text, table = lesson / "numbers.piko.cpp", lesson / "julia.csv"
        bin = Path(_find_tool()).parent
        with tempfile.TemporaryDirectory() as folder:
            for number in (0, 1):
                tuned = f'PIKO_TUNED="numbers={number}"'
                out = ["--out", f"{folder}/{number}.png", "--frames", "1"]
                call(bin / "piko-render", text, table, "-D", tuned, *SIZE, *out)
            told = call(bin / "piko-diff", "0.png", "1.png", "--json", cwd=folder)
        rows = np.loadtxt(table, delimiter=",", skiprows=1)

        def feed_sets(pipe):
            sets = np.zeros(len(rows), pipe.source("iterate").dtype)
            sets["lo"], sets["hi"], sets["c"] = rows[:, :2], rows[:, 2:4], rows[:, 4:]
            pipe.feed("iterate", sets)

        def read_bytes(pipe):
            rgba = pipe["image"]["rgba"]
            return (np.clip(rgba, 0, 1) * np.float32(255) + np.float32(0.5)).astype("u1")

        chart = piko.speed_error(
            text, {"contracted": {"tunables": {"numbers": "Contracted"}}},
            setup=feed_sets, picture=read_bytes, domain=(192, 144), **FAST)
        expected, found = json.loads(told), vars(chart.points[0].errors)
        self.assertGreater(found["rms"], 0)
        for name, value in found.items():
            self.assertAlmostEqual(value, expected[name], places=9, msg=name)

    def test_numbers(self):
        """Without a picture all numbers count, over their field's largest; constants
        do not."""
        chart = measure({"exact": {}, "brighter": {"shift": 0.25}}, picture=None)
        self.assertEqual(chart["exact"].errors, piko.Errors(0, 0, 0, 0))
        pipe = piko.Pipeline(RAMP, domain=(32, 16))
        feed(pipe)
        pipe.run()
        largest = float(pipe.read("image")["color"].max())
        found = chart["brighter"].errors
        self.assertAlmostEqual(found.largest, 0.25 / largest, places=6)
        # A fourth of the numbers is the count, which is the same.
        self.assertAlmostEqual(found.mean, 0.75 * 0.25 / largest, places=6)

    def test_of_a_pipeline(self):
        """Variants get copies of what is bound, and keep its options."""
        pipe = make_pipe(opt_level=0, tunables={"tile": 16})
        before = pipe["weights"].copy()
        chart = piko.speed_error(
            pipe,
            {"as it is": {}, "tile 8": {"tunables": {"tile": 8}},
             "gained": {"style": {"gain": 2}}, "gpu": {"target": "gpu-on-cpu"}},
            picture=lambda one: one["image"]["color"] / 4,
            **FAST,
        )
        rms = [one.errors.rms for one in chart.points]
        self.assertEqual([rms[0], rms[1], rms[3]], [0, 0, 0])
        self.assertGreater(rms[2], 0.01)
        np.testing.assert_array_equal(pipe["weights"], before)
        self.assertEqual(pipe.program._options.setting("tunable"), "tile=16")

    def test_reference(self):
        """A variant, or what none is."""
        variants = {"exact": {}, "coarse": {"tunables": {"steps": 4}}}
        chart = measure(variants, reference="coarse")
        self.assertEqual(chart["coarse"].errors.rms, 0)
        self.assertGreater(chart["exact"].errors.rms, 1e-4)
        self.assertEqual(chart.reference, "'coarse'")
        chart = measure(variants, reference={"shift": 0.25})
        self.assertAlmostEqual(chart["exact"].errors.rms, 0.25, places=6)

    def test_errors(self):
        cases = [
            ({}, {}, ValueError, "variants: expected at least one"),
            ({"a": 3}, {}, TypeError, "expected a mapping of options for 'a', but got int"),
            ({"a": {}}, {"reference": "b"}, ValueError, "expected one of a, but got 'b'"),
            ({"a": {}}, {"metric": "psnr"}, ValueError, "metric: expected one of max, "),
            ({"a": {}}, {"rounds": 0}, ValueError, "rounds: expected at least 1, but got 0"),
            ({"a": {}}, {"picture": None, "metric": "flip"}, ValueError, "flip is of pictures"),
            ({"a": {"tunables": {"steps": 5}}}, {}, piko.VariantError, "variant 'a': .*steps"),
            ({"a": {"nothing": 5}}, {}, piko.VariantError,
             "variant 'a': pipeline 'Ramp' has no state 'nothing'; it has image, shift"),
            ({"a": {}}, {"picture": "image.x"}, piko.VariantError,
             "'image.x': there is no field 'x'; there are color, count"),
            ({"a": {}}, {"picture": lambda pipe: np.zeros(3)}, piko.VariantError,
             r"expected a picture of shape .*, but got \(3,\)"),
            ({"a": {"domain": (8, 8)}}, {}, piko.VariantError,
             "variant 'a': expected a picture of 32 x 16 pixels, .*, but got 8 x 8"),
        ]
        for variants, options, kind, text in cases:
            with self.subTest(text), self.assertRaisesRegex(kind, text):
                all_options = {**FAST, **options}
                options = {"picture": "image.color", "domain": (32, 16), **all_options}
                piko.speed_error(RAMP, variants, setup=feed, **options)
        with self.assertRaisesRegex(TypeError, "a path or a text, but got int"):
            piko.speed_error(3, {"a": {}})
        with self.assertRaises(piko.VariantError) as caught:
            piko.speed_error(DOTS, {"lost": {"pipe": "Lost"}}, reference={"pipe": "Dots"})
        self.assertEqual(caught.exception.variant, "reference")


class Front(unittest.TestCase):
    def test_front(self):
        """Fast and far, slow and near, and what others are better than."""
        points = [(1, 9), (2, 5), (2, 6), (3, 5), (4, 0), (5, 0), (2, 5), (0.5, 9.5)]
        ms, errors = zip(*points)
        on = [True, True, False, False, True, False, True, True]
        self.assertEqual(piko.pareto_front(ms, errors), on)
        order = [7, 2, 4, 0, 6, 1, 3, 5]
        self.assertEqual(
            piko.pareto_front([ms[i] for i in order], [errors[i] for i in order]),
            [on[i] for i in order],
        )
        with self.assertRaisesRegex(ValueError, "expected 2 errors, but got 1"):
            piko.pareto_front([1, 2], [3])

    def make(self):
        rows = [("slow", 4.0, 0.0, True), ("mid", 2.0, 0.01, True),
                ("bad", 3.0, 0.02, False), ("quick", 1.0, 0.04, True)]
        points = [
            piko.SpeedErrorPoint(name, ms, (ms - 0.5, ms, ms + 1),
                                 piko.Errors(e, e, e, e, None, None), on)
            for name, ms, e, on in rows
        ]
        return piko.SpeedError("Ramp", "rms", "the reference", tuple(points))

    def test_data(self):
        chart = self.make()
        self.assertEqual([one.variant for one in chart.front], ["quick", "mid", "slow"])
        array = chart.to_array()
        self.assertEqual(array["variant"].tolist(), ["slow", "mid", "bad", "quick"])
        self.assertEqual(array["least_ms"].tolist(), [3.5, 1.5, 2.5, 0.5])
        self.assertEqual(array["front"].tolist(), [True, True, False, True])
        self.assertTrue(np.isnan(array["psnr"]).all())
        with self.assertRaisesRegex(KeyError, "no variant 'x'; there are slow, mid"):
            chart["x"]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "points.csv"
            chart.write_csv(path)
            with open(path, newline="") as file:
                rows = list(csv.DictReader(file))
        self.assertEqual([row["front"] for row in rows], ["1", "1", "0", "1"])
        self.assertEqual(rows[1]["most ms"], "3")
        self.assertEqual((rows[2]["rms"], rows[2]["flip"]), ("0.02", ""))

    def test_without_matplotlib(self):
        with mock.patch.dict(sys.modules, {"matplotlib": None, "matplotlib.figure": None}):
            with self.assertRaisesRegex(ImportError, "expected matplotlib .*python3-matplotlib"):
                self.make().draw()

    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "there is no matplotlib")
    def test_drawing(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "chart.svg"
            figure = self.make().draw(path)
            self.assertIn("<svg", path.read_text())
        (axes,) = figure.axes
        line = axes.lines[0].get_xydata().tolist()
        self.assertEqual(line, [[0.04, 1], [0.01, 2], [0.001, 4]])
        self.assertEqual({one.get_text() for one in axes.texts},
                         {"slow", "mid", "bad", "quick"})


if __name__ == "__main__":
    unittest.main()
