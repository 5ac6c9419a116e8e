# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Records as dtypes."""

import unittest

import numpy as np

import piko
from piko._records import find_misfit, make_dtype, scalar_of
from support import DOTS

F32, F64, I8, I32 = 0, 1, 2, 4


class Records(unittest.TestCase):
    def check(self, dtype, size, leaves, name="R"):
        made = make_dtype(name, size, leaves)
        self.assertEqual(made, np.dtype(dtype))
        self.assertEqual(made.itemsize, size)

    def test_numbers(self):
        self.check("f4", 4, [("value", 0, 1, 0, F32)], "float")
        self.check(("f4", 3), 12, [(c, 4 * i, 1, 0, F32) for i, c in enumerate("xyz")],
                   "glm::vec<3, float>")

    def test_struct_of_coordinates(self):
        leaves = [("x", 0, 1, 0, F32), ("y", 4, 1, 0, F32)]
        self.check([("x", "f4"), ("y", "f4")], 8, leaves, "Point")

    def test_padding(self):
        leaves = [("a", 0, 1, 0, I8), ("d", 8, 1, 0, F64), ("b", 16, 1, 0, I8)]
        dtype = np.dtype({"names": ["a", "d", "b"], "formats": ["i1", "f8", "i1"],
                          "offsets": [0, 8, 16], "itemsize": 24})
        self.check(dtype, 24, leaves)

    def test_vectors(self):
        leaves = [(f"p.{c}", 4 * i, 1, 0, F32) for i, c in enumerate("xyzw")]
        self.check([("p", "f4", 4)], 16, leaves)
        mixed = [("p.x", 0, 1, 0, F32), ("p.y", 4, 1, 0, I32)]
        self.check([("p", [("x", "f4"), ("y", "i4")])], 8, mixed)
        other = [("p.x", 0, 1, 0, F32), ("p.q", 4, 1, 0, F32)]
        self.check([("p", [("x", "f4"), ("q", "f4")])], 8, other)

    def test_arrays(self):
        self.check([("t", "f4", 6)], 24, [("t", 0, 6, 4, F32)])
        # An array of structs, and a struct of arrays.
        knots = [("k.at.x", 0, 3, 12, F32), ("k.at.y", 4, 3, 12, F32),
                 ("k.w", 8, 3, 12, F32)]
        self.check([("k", [("at", "f4", 2), ("w", "f4")], 3)], 36, knots)
        arrays = [("s.a", 0, 2, 4, F32), ("s.b", 8, 2, 4, F32)]
        self.check([("s", [("a", "f4", 2), ("b", "f4", 2)])], 16, arrays)
        # std::array, and GLM's matrices.
        self.check([("v", "f4", (2, 3))], 24,
                   [(f"v._M_elems.{c}", 4 * i, 2, 12, F32) for i, c in enumerate("xyz")])
        self.check([("m", "f4", (3, 3))], 36,
                   [(f"m.value.{c}", 4 * i, 3, 12, F32) for i, c in enumerate("xyz")])

    def test_rows(self):
        """An array in the elements of another one, row by row."""
        leaves = [("i.t[0]", 0, 2, 4, F32), ("i.t[1]", 12, 2, 4, F32),
                  ("i.k", 8, 2, 12, I32)]
        self.check([("i", [("t", "f4", 2), ("k", "i4")], 2)], 24, leaves)

    def test_gaps(self):
        """Elements with bytes behind them that are nobody's."""
        dtype = np.dtype({"names": ["v"], "formats": ["f4"], "offsets": [0],
                          "itemsize": 16})
        self.check([("a", dtype, 2)], 32, [("a.v", 0, 2, 16, F32)])

    def test_scalars(self):
        self.assertEqual(scalar_of(np.dtype([("a", "f4", 3), ("b", "f4")])), "f4")
        self.assertIsNone(scalar_of(np.dtype([("a", "f4"), ("b", "i4")])))
        self.assertIsNone(scalar_of(np.dtype([("a", "i1"), ("b", "f8")], align=True)))

    def test_misfits(self):
        wanted = np.dtype([("a", "f4", 3), ("b", [("c", "i4")])])
        for given, text in (
            ([("a", "f4", 3)], "field 'b' is missing"),
            ([("a", "f4", 3), ("b", [("d", "i4")])], "field 'b.c' is missing"),
            ([("a", "f8", 3), ("b", [("c", "i4")])],
             "field 'a': expected (3,) of float32, but got (3,) of float64"),
            ([("b", [("c", "i4")]), ("a", "f4", 3)],
             "field 'a': expected it at byte 0, but got 4"),
            ([("a", "f4", 3), ("b", [("c", "f4")])],
             "field 'b.c': expected int32, but got float32"),
            ([("a", "f4", 3), ("b", [("c", "i4")]), ("e", "f4")],
             "there is no field 'e'"),
            ([("a", "f4", 3), ("b", [("c", ">i4")])],
             "field 'b.c': expected int32, but got >i4"),
        ):
            self.assertEqual(find_misfit(wanted, np.dtype(given)), text)
        signs = np.dtype([("a", "f4", 3), ("b", [("c", "u4")])])
        self.assertIsNone(find_misfit(wanted, signs))
        padded = np.dtype({"names": ["a"], "formats": ["f4"], "itemsize": 8})
        self.assertEqual(find_misfit(np.dtype([("a", "f4")]), padded),
                         "the record: expected 4 bytes, but got 8")

    def test_of_a_pipeline(self):
        pipe = piko.Pipeline(DOTS, "Dots")
        style = pipe.records["Style"]
        self.assertEqual(list(style.fields), ["gain", "isDark", "knots", "turn", "scale"])
        self.assertEqual(style["turn"].shape, (3, 3))
        self.assertEqual(style["knots"].shape, (2,))
        self.assertEqual(style.itemsize, 88)
        self.assertEqual(pipe.dtype("image"), pipe.records["Pixel"])
        self.assertEqual(pipe.source("plot").dtype, pipe.records["Dot"])
        with self.assertRaises(TypeError):
            pipe.records["Dot"] = style


if __name__ == "__main__":
    unittest.main()
