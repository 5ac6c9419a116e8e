# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The manual's blocks run, in their order, and so do the example and the notebook."""

import csv
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from support import HERE

ROOT = HERE.parent.parent
MANUAL = ROOT / "docs" / "Python.md"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```", re.S | re.M)


class Documents(unittest.TestCase):
    def run_program(self, *arguments, folder):
        done = subprocess.run(
            [sys.executable, *map(str, arguments)],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=100,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_manual(self):
        text = MANUAL.read_text()
        program = ""
        with tempfile.TemporaryDirectory() as folder:
            for fence in FENCE.finditer(text):
                kind, body = fence.groups()
                if kind == "cpp":
                    before = text[: fence.start()]
                    name = re.findall(r"`([\w.]+\.piko\.cpp)`", before)[-1]
                    (Path(folder) / name).write_text(body)
                elif kind == "python":
                    line = text[: fence.start()].count("\n") + 1
                    program += "\n" * (line - program.count("\n")) + body
            self.assertGreater(program.count("\n"), 100)
            path = Path(folder) / "manual.py"  # with the manual's lines
            path.write_text(program)
            self.run_program("-W", "error", path, folder=folder)

    def test_example(self):
        with tempfile.TemporaryDirectory() as folder:
            tour = ROOT / "examples" / "python" / "tour.py"
            out = self.run_program(tour, "dots.ppm", folder=folder).splitlines()
            picture = (Path(folder) / "dots.ppm").read_bytes()
        self.assertIn("draw: 60 taken, bins of (16, 16)", out)
        self.assertIn("cpu against gpu-on-cpu: equal", out)
        self.assertIn("CompileError: dots.piko.cpp:28: 1", out)
        self.assertTrue(picture.startswith(b"P6\n128 128\n255\n"))
        self.assertEqual(len(picture), 15 + 3 * 128 * 128)
        self.assertGreater(len(set(picture)), 100)  # shades

    def test_mesh(self):
        # A cube, of squares.
        corners = [f"v {x} {y} {z}" for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
        faces = ["f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"]
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "cube.obj").write_text("\n".join(corners + faces) + "\n")
            out = self.run_program(ROOT / "examples" / "python" / "bunny.py",
                                   ROOT / "examples" / "raster" / "raster.piko.cpp",
                                   "cube.obj", "cube.ppm", folder=folder)
            picture = (Path(folder) / "cube.ppm").read_bytes()
        self.assertIn("12 triangles in ", out)
        pixels = picture[len(b"P6\n1024 768\n255\n"):]
        self.assertEqual(len(pixels), 3 * 1024 * 768)
        at = [3 * (1024 * y + x) for x, y in ((512, 384), (5, 5))]
        middle, corner = (pixels[i:i + 3] for i in at)
        self.assertEqual(corner, b"\x1a\x1a\x1a")
        self.assertGreater(min(middle), 0x40)

    def test_tradeoff(self):
        """Precision costs last bits, a quarter of the steps the picture."""
        lesson = ROOT / "examples" / "lessons" / "10-numbers"
        with tempfile.TemporaryDirectory() as folder:
            out = self.run_program(ROOT / "examples" / "python" / "tradeoff.py",
                                   lesson / "numbers.piko.cpp", lesson / "julia.csv",
                                   "points.csv", folder=folder)
            with open(Path(folder) / "points.csv", newline="") as file:
                rows = {row["variant"]: row for row in csv.DictReader(file)}
        self.assertRegex(out, r"(?m)^Strict +\d+\.\d{3} ms, rms 0, FLIP 0")
        self.assertEqual(len(rows), 5)
        self.assertLess(float(rows["Contracted"]["rms"]), 0.05)
        self.assertGreater(float(rows["24 steps"]["rms"]), 0.2)
        self.assertIn("1", [row["front"] for row in rows.values()])

    def test_notebook(self):
        notebook = ROOT / "examples" / "python" / "bubbles.ipynb"
        out = self.run_program(HERE / "run_notebook.py", notebook, folder=HERE)
        self.assertEqual(out.count("<picture of "), 3)
        self.assertIn("\n1 picture\n", out)
        self.assertIn("\ncpu against reference: equal\n", out)
        self.assertRegex(out, r"bubbles\.piko\.cpp:\d+:\d+: error: no member named")
        self.assertIn("source 'draw': field 'center': expected (2,) of float32", out)


if __name__ == "__main__":
    unittest.main()
