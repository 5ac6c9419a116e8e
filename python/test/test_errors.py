# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What is wrong is an exception of the right kind, whose message says what was expected:
in lower case, without a final stop."""

import os
import re
import tempfile
import unittest
from pathlib import Path

import numpy as np

import piko
from support import TABLE, make_pipe

NOTHING = "No such file or directory"
FOLDER = "Is a directory"
# What is called, what is raised, and what its first line is, a regular expression.
COMPILING = [
    ("piko.compile(3)", TypeError, "expected a path or a text, but got int"),
    ("piko.compile('')", ValueError, "expected a path or a text, but got an empty one"),
    ("piko.compile('a\\0b')", ValueError, r"expected a path, but got 'a\\x00b'"),
    ("piko.compile('\\udcff\\n')", ValueError, "expected a text or a path of Unicode, .*"),
    ("piko.compile('int a;')", ValueError,
     r"expected a path, but got 'int a;' \(a text needs a line's end\)"),
    ("piko.compile('none.piko.cpp')", piko.CompileError,
     f"none.piko.cpp:1:1: error: cannot open the file: {NOTHING}"),
    ("piko.compile('folder')", piko.CompileError,
     f"folder:1:1: error: cannot open the file: {FOLDER}"),
    ("piko.compile('utf.piko.cpp')", piko.CompileError,
     "utf.piko.cpp:2:1: error: source file is not valid UTF-8"),
    ("piko.compile('noise.so', 'P')", piko.CompileError, "error: noise.so: .*ELF.*"),
    ("piko.compile(TABLE, 'Nope')", piko.CompileError,
     "pipeline.piko.cpp:1:1: error: expected the name of a pipeline, but got 'Nope'"),
    ("piko.compile(TABLE, target='x')", ValueError,
     "target: expected cpu, .* or auto, but got 'x'"),
    ("piko.compile(TABLE, opt_level=9)", ValueError,
     "opt_level: expected 0 to 3, but got '9'"),
    ("piko.compile(TABLE, tunables=3)", TypeError,
     "tunables: expected a mapping of names, but got int"),
    ("piko.compile(TABLE, tunables={'factor': 4})", piko.CompileError,
     ".*: error: expected 3 or 5 for tunable 'factor', but got 4"),
    ("piko.compile(TABLE, tuned='none.json')", ValueError,
     f"tuned: tuned file 'none.json': {NOTHING} in folder '.*'"),
    ("piko.compile(TABLE, without=['x'])", ValueError,
     "without: expected passes of .*, but got 'x'"),
    ("piko.compile(TABLE, without='x')", TypeError,
     "without: expected a list, but got a string"),
    ("piko.compile(TABLE, defines=3)", TypeError,
     "defines: expected a list, but got int"),
    ("piko.compile(TABLE, defines='QUIET')", TypeError,
     "defines: expected a list, but got a string"),
    ("piko.compile(TABLE, include_dirs='inc/a')", TypeError,
     "include_dirs: expected a list, but got a string"),
    ("piko.compile(TABLE, include_dirs=b'inc')", TypeError,
     "include_dirs: expected a list, but got bytes"),
    ("piko.compile(TABLE, directives='a')", TypeError,
     "directives: expected a list, but got a string"),
    ("piko.compile(TABLE, fix={'offset'})", TypeError,
     "fix: expected a mapping of names, but got set"),
    ("piko.compile(TABLE, defines=['A=\\0'])", ValueError,
     r"defines: expected a text, but got 'A=\\x00'"),
    ("piko.compile(TABLE).emit('x')", ValueError,
     "there is no level 'x'; expected one of authored, .*"),
    ("piko.compile(TABLE).compile_object(namespace='3x')", piko.CompileError,
     "error: expected a namespace such as 'a' or 'a::b', but got '3x'"),
]
SETTING_UP = [
    ("piko.Pipeline(TABLE, domain=3)", TypeError,
     "domain: expected a cell count for each dimension, but got int"),
    ("piko.Pipeline(TABLE, domain=(1.5, 1))", TypeError,
     "domain: expected an integer, but got float"),
    ("piko.Pipeline(TABLE, domain=(-1, 1))", ValueError,
     r"domain: pipeline 'Table': expected domain extents in \[1, 1073741824\], "
     "but got -1 in dimension 0"),
    ("piko.Pipeline(TABLE, domain=(8, 8, 8))", ValueError,
     "domain: pipeline 'Table': expected a domain of rank 2, but got 3"),
    ("piko.Pipeline(TABLE, threads=1 << 40)", ValueError,
     r"threads: expected a number of threads in \[0, 10000\], but got 1099511627776"),
    ("piko.Pipeline(TABLE, threads=-1)", ValueError,
     r"threads: expected a number of threads in \[0, 10000\], but got -1"),
    ("piko.Pipeline(pipe.program, tunables={'factor': 5})", TypeError,
     "tunables: an option of piko.compile, but the program is compiled"),
    ("piko.Pipeline(TABLE, nothing=3)", KeyError,
     "pipeline 'Table' has no state 'nothing'; it has offset, values"),
    ("piko.Pipeline(TABLE, offset='x')", ValueError,
     "constant 'offset': expected numbers of type int32, but got 'x'"),
    ("piko.Pipeline(TABLE, offset=[1, 2])", ValueError,
     r"constant 'offset': expected shape \(\), but got \(2,\)"),
    ("pipe.__setitem__('offset', None)", TypeError,
     "constant 'offset': expected real numbers, but got None"),
    ("pipe.__setitem__('offset', 1j)", TypeError,
     "constant 'offset': expected real numbers, but got 1j"),
    ("pipe.__setitem__('offset', np.array(1j))", TypeError,
     "constant 'offset': expected real numbers, but got complex128"),
    ("pipe.__setitem__('values', None)", TypeError,
     "buffer 'values': expected real numbers, but got None"),
    ("pipe.__setitem__('values', [1, None])", TypeError,
     "buffer 'values': expected real numbers, but got None"),
    ("pipe.__setitem__('values', np.array(3, 'i4'))", ValueError,
     r"buffer 'values': expected shape \(N,\), a number for each record, but got \(\)"),
    ("setattr(pipe, 'offset', 3)", AttributeError,
     r"state is set by pipe\['offset'\] = value, not as an attribute"),
    ("setattr(pipe, 'values', [3])", AttributeError,
     r"state is set by pipe\['values'\] = value, not as an attribute"),
    ("setattr(pipe, 'domian', (3, 3))", AttributeError,
     "a pipeline has no attribute 'domian'; near it are domain"),
    ("setattr(pipe, 'run', 3)", AttributeError, "'run' is a method of pipelines"),
    ("pipe.feed('set', ['x'])", ValueError,
     r"source 'set': expected numbers of type int32, but got \['x'\]"),
    ("pipe.feed('set', np.zeros(3))", ValueError,
     "source 'set': expected int32, but got float64"),
    ("pipe.feed(7, [])", KeyError, "pipeline 'Table' has no source '7'; it has set"),
    ("pipe.allocate('values', -1)", ValueError,
     "buffer 'values': expected a count of at least 0, but got -1"),
    ("pipe.capture('none/x')", piko.RunError,
     f"pipeline 'Table': cannot write 'none/x': {NOTHING}"),
    ("pipe.capture('/dev/full')", piko.RunError,
     "pipeline 'Table': cannot write '/dev/full': No space left on device"),
]
MEASURING = [
    ("piko.compare(3)", TypeError, "expected a pipeline, but got int"),
    ("piko.compare(pipe, against='x')", ValueError,
     "against: expected cpu, .*, but got 'x'"),
    ("piko.compare(pipe, against=3)", TypeError,
     "against: expected the name of a target, but got int"),
    ("piko.compare(pipe, tolerance=float('nan'))", ValueError,
     "expected a tolerance of at least 0, but got nan"),
    ("piko.tune(pipe, metric='x')", ValueError,
     "metric: expected max, mean, rms, p99 or flip, but got 'x'"),
    ("piko.tune(pipe, error=-1)", ValueError,
     "error: expected a number of at least 0, or A/B, but got '-1'"),
    ("piko.tune(pipe, budget=0)", ValueError, "budget: expected .*, but got .*0.*"),
    ("piko.tune(pipe, budget=1.5)", TypeError,
     "budget: expected an integer, but got float"),
    ("piko.tune(pipe, threads=-1)", ValueError, "threads: expected .*, but got .*-1.*"),
    ("piko.tune(pipe, clock='sun')", ValueError,
     "clock: expected wall or cpu, but got 'sun'"),
    ("piko.tune(pipe, space=['x'])", ValueError,
     "space: expected tunables, .*, but got 'x'"),
    ("piko.tune(pipe, space='x')", TypeError, "space: expected a list, but got a string"),
    ("piko.tune(pipe, tool='none')", piko.TuneError,
     f"cannot run piko-tune, 'none': {NOTHING}"),
    ("piko.speed_error(pipe, {'a': {'x': 1}}, rounds=1)", piko.VariantError,
     "variant 'a': pipeline 'Table' has no state 'x'; it has offset, values"),
    ("piko.speed_error(pipe, {'a': {}}, rounds='x')", TypeError,
     "rounds: expected an integer, but got str"),
    ("piko.speed_error(pipe, {'a': {}}, seconds=-1)", ValueError,
     "seconds: expected at least 0, but got -1"),
]


class Errors(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)
        Path("folder").mkdir()
        Path("utf.piko.cpp").write_bytes(b"#include <piko.h>\n\xff\xfe\n")
        Path("noise.so").write_bytes(bytes(range(1, 256)))

    def check(self, cases):
        pipe = piko.Pipeline(TABLE, domain=(1, 1), values=[0] * 9)
        pipe.feed("set", [1, 2])
        names = {"piko": piko, "np": np, "pipe": pipe, "TABLE": TABLE}
        files = sorted(os.listdir())
        for call, kind, message in cases:
            with self.subTest(call):
                with self.assertRaises(kind) as caught:
                    eval(call, names)
                error = caught.exception
                said = error.args[0] if isinstance(error, KeyError) else str(error)
                first = said.split("\n")[0]
                self.assertIsNotNone(re.fullmatch(message, first), first)
                self.assertRegex(first, r"^(?![A-Z]).*[^.!]$")
                self.assertEqual(sorted(os.listdir()), files)
        pipe.run()  # none of this has left anything
        self.assertEqual(pipe["values"].tolist(), [0, 3, 6, 0, 0, 0, 0, 0, 0])

    def test_compiling(self):
        self.check(COMPILING)

    def test_setting_up(self):
        self.check(SETTING_UP)

    def test_measuring(self):
        self.check(MEASURING)

    def test_no_memory(self):
        """Records that do not fit take the place of none, or leave none."""
        pipe = make_pipe()
        before = pipe["weights"]
        pipe.set_memory_limit(1 << 20)
        for count in (1 << 20, 1 << 62):
            with self.assertRaises(piko.RunError) as caught:
                pipe.allocate("weights", count)
            self.assertEqual(caught.exception.status, piko.Status.OUT_OF_MEMORY)
        with self.assertRaisesRegex(piko.RunError, "state 'weights' is not bound"):
            pipe["weights"]
        pipe["weights"] = before
        self.assertIs(pipe["weights"], before)


if __name__ == "__main__":
    unittest.main()
