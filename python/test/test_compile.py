# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""From texts to programs, and what is wrong with them."""

import pickle
import tempfile
import unittest
import warnings
from pathlib import Path

import numpy as np

import piko
from support import DOTS, TABLE


def run_table(program, **options):
    values = np.zeros(3, "i4")
    pipe = program.create((1, 1), offset=100, values=values, **options)
    pipe.feed("set", np.arange(3, dtype="i4"))
    pipe.run()
    return values.tolist()


class Compile(unittest.TestCase):
    def test_text(self):
        program = piko.compile(TABLE, name="table.piko.cpp")
        self.assertEqual(program.name, "Table")
        self.assertEqual(program.target, "cpu")
        self.assertEqual(repr(program), "<piko.Program Table for cpu>")
        self.assertGreater(program.compile_ms, 0)
        self.assertEqual(run_table(program), [100, 103, 106])
        self.assertEqual(program.code_hash, piko.compile(TABLE, name="table.piko.cpp").code_hash)

    def test_file_and_names(self):
        names = ["Dots", "Countdown", "Outside"]
        self.assertEqual(piko.pipelines(DOTS), names)
        self.assertEqual(piko.pipelines(str(DOTS)), names)
        program = piko.compile(DOTS, "Countdown")
        self.assertEqual((program.name, program.names), ("Countdown", names))

    def test_tunables(self):
        program = piko.compile(TABLE, tunables={"factor": 5})
        self.assertEqual(run_table(program), [100, 105, 110])
        (factor,) = program.tunables
        self.assertEqual((factor.name, factor.values), ("factor", ("3", "5")))
        self.assertEqual(factor.line, 2)
        with self.assertRaisesRegex(piko.CompileError, "expected 3 or 5") as caught:
            piko.compile(TABLE, tunables={"factor": 4}, name="table.piko.cpp")
        self.assertEqual(caught.exception.line, 2)
        self.assertIn("table.piko.cpp", caught.exception.file)

    def test_targets(self):
        for target in ("reference", "gpu-on-cpu", "auto"):
            program = piko.compile(TABLE, target=target, opt_level=0)
            self.assertEqual(run_table(program), [100, 103, 106], target)

    def test_options(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "offset.h").write_text("#define MORE 7\n")
            text = TABLE.replace("#include", '#include "offset.h"\n#include', 1)
            text = text.replace("+ state().offset", "+ state().offset + MORE * TIMES")
            program = piko.compile(
                text,
                include_dirs=[folder],
                defines={"TIMES": 2, "QUIET": 1},
                fix={"offset": 100},
                without=["vectorize"],
                directives=["set:schedule=load_balance"],
                check=True,
                cache_dir=Path(folder) / "cache",
            )
            self.assertEqual(run_table(program), [114, 117, 120])
            self.assertTrue((Path(folder) / "cache").exists())
            self.assertEqual(
                piko.pipelines(text, defines=["TIMES=2"], include_dirs=[folder]),
                ["Table"],
            )
            pipe = program.create((1, 1), offset=1, values=[0, 0, 0])
            with self.assertRaisesRegex(piko.RunError, "expected 100"):
                pipe.run()

    def test_wrong_options(self):
        for options, text in (
            ({"target": "gpu"}, "^target: expected cpu, reference"),
            ({"opt_level": 4}, "opt_level: expected 0 to 3"),
            ({"without": ["nothing"]}, "nothing"),
            ({"check": ["a b"]}, "^check: "),
            ({"gpu_threads": 3}, "expected 0, or a power of two"),
            ({"gpu_chip": "90"}, "names such as sm_90"),
            ({"tuned": "none.json"}, "none.json"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                piko.compile(TABLE, **options)
        for source, error in (("", ValueError), (b"a", TypeError), (3, TypeError)):
            with self.assertRaises(error):
                piko.compile(source)
        for options in ({"defines": "A=1"}, {"without": "a"}, {"check": "R.f"}):
            with self.assertRaisesRegex(TypeError, "expected a list, but got a string"):
                piko.compile(TABLE, **options)
        with self.assertRaisesRegex(TypeError, "tunables: expected a mapping of names"):
            piko.compile(TABLE, tunables=["factor"])

    def test_levels(self):
        program = piko.compile(TABLE)
        for level in piko.LEVELS:
            self.assertGreater(len(program.emit(level)), 100, level)
        self.assertIn("piko.kernel", program.emit("kernels"))
        self.assertIn("Table", program.explain())
        with self.assertRaisesRegex(ValueError, "no level 'none'; expected one of"):
            program.emit("none")
        with self.assertRaisesRegex(ValueError, "the reference executor has no level"):
            program.with_target("reference").emit("kernels")

    def test_objects(self):
        made = piko.compile(TABLE).compile_object(cpu="x86-64-v3", namespace="mine")
        self.assertEqual(made.symbol, "mine_Table_program")
        self.assertTrue(made.code.startswith(b"\x7fELF"))
        self.assertIn("class Table", made.header)
        self.assertTrue(any(file.endswith("/piko.h") for file in made.files))
        with self.assertRaisesRegex(piko.CompileError, "there is no processor 'none'"):
            piko.compile(TABLE).compile_object(cpu="none")

    def test_pickle(self):
        program = piko.compile(TABLE, tunables={"factor": 5})
        again = pickle.loads(pickle.dumps(program))
        self.assertEqual(run_table(again), [100, 105, 110])
        with self.assertRaisesRegex(TypeError, "pickle its program"):
            pickle.dumps(program.create())


class Errors(unittest.TestCase):
    def test_place(self):
        text = TABLE.replace("factor * i", "factor * unknown")
        with self.assertRaises(piko.CompileError) as caught:
            piko.compile(text, name="table.piko.cpp")
        error = caught.exception
        self.assertIsInstance(error, piko.Error)
        self.assertTrue(error.file.endswith("table.piko.cpp"))
        self.assertEqual(error.line, 5)
        self.assertIn("unknown", text.splitlines()[error.line - 1])
        first = error.diagnostics[0]
        self.assertEqual((first.severity, first.line), ("error", 5))
        self.assertIn("unknown", first.message)
        self.assertIn("^", first.text)
        self.assertEqual(str(error), error.text.rstrip("\n"))

    def test_notes(self):
        with self.assertRaises(piko.CompileError) as caught:
            piko.compile(DOTS)
        notes = [one for one in caught.exception.diagnostics if one.severity == "note"]
        self.assertEqual(len(notes), 3)
        self.assertIn("pipeline 'Countdown' is defined here", notes[1].message)

    def test_missing_file(self):
        with self.assertRaisesRegex(piko.CompileError, "cannot open the file") as caught:
            piko.compile("none.piko.cpp")
        self.assertEqual(caught.exception.file, "none.piko.cpp")
        with self.assertRaisesRegex(piko.CompileError, "no pipeline|name of a pipeline"):
            piko.compile(TABLE, "None")

    def test_warnings(self):
        with self.assertWarnsRegex(piko.CompileWarning, "mind the step") as caught:
            piko.compile(TABLE, defines=["WARN"])
        self.assertEqual(Path(caught.filename).name, "test_compile.py")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(piko.CompileWarning):
                piko.compile(TABLE, defines=["WARN"])


if __name__ == "__main__":
    unittest.main()
