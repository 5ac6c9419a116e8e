#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The model of benchmarks/gpu_model says what its limits say."""

import dataclasses
import json
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, sys.argv.pop(1))

from gpu_model import counting, model, slots  # noqa: E402
from gpu_model.chips import DATA, read_chips  # noqa: E402

CHIPS, SOURCES = read_chips()
# A round number of everything.
CHIP = dataclasses.replace(
    CHIPS["A100"], name="test", multiprocessors=10, gigahertz=1.0, issue=4,
    lanes={unit: 32 for unit in CHIPS["A100"].lanes}, l1_bytes_per_clock=128,
    l2_bytes_per_clock=1000, l2_megabytes=1, dram_gb_per_s=100, launch_us=0,
    arithmetic_cycles=4, l2_cycles=200)


def count(**kinds):
    """Of a launch of as many blocks as there are multiprocessors, of equal
    warps."""
    counts = dict.fromkeys(model.SLOTS, 0)
    counts.update(launches=1, blocks=10, threads=320, warps=10, globalBytes=0,
                  globalSectors=0, distinctSectors=0)
    counts.update(kinds)
    total = sum(counts[kind] for kind in model.SLOTS)
    counts.setdefault("warpInstructions", total)
    counts.setdefault("laneInstructions", 32 * total)
    counts.setdefault("leastSpan", 0)
    counts.setdefault("mostSpan", counts["leastSpan"])
    return counts


class Limits(unittest.TestCase):
    def test_issue(self):
        # 40 a cycle, all of one kind: its unit takes one a cycle.
        it = model.estimate_kernel(count(control=40e6), CHIP)
        self.assertAlmostEqual(it.least["issue"], 1.0)

    def test_units(self):
        it = model.estimate_kernel(count(float64=10e6), CHIP)
        self.assertEqual(it.limit, "float64")
        self.assertAlmostEqual(it.least_ms, 1.0)

    def test_divisions_are_sequences(self):
        one = model.estimate_kernel(count(float32=1e6), CHIP)
        division = model.estimate_kernel(count(float32Division=1e6), CHIP)
        self.assertAlmostEqual(division.least["issue"] / one.least["issue"], 11)
        self.assertGreater(division.least["special"], 0)

    def test_few_blocks_use_few_multiprocessors(self):
        many = model.estimate_kernel(count(float32=1e6), CHIP)
        one = model.estimate_kernel(count(float32=1e6, blocks=1), CHIP)
        self.assertAlmostEqual(one.least["float32"], 10 * many.least["float32"])

    def test_span(self):
        it = model.estimate_kernel(
            count(float32=1e6, leastSpan=2e6, mostSpan=5e6), CHIP)
        self.assertEqual((it.limit, it.most_limit), ("span", "span"))
        self.assertAlmostEqual(it.least_ms, 2.0)
        self.assertAlmostEqual(it.most_ms, it.work["float32"] + 5.0)

    def test_work(self):
        it = model.estimate_kernel(count(float32=1e9, leastSpan=2e6), CHIP)
        self.assertEqual((it.limit, it.most_limit), ("float32", "float32"))
        self.assertAlmostEqual(it.least_ms, 100)
        self.assertAlmostEqual(it.most_ms, 102)

    def test_memory(self):
        # 64 MB, which the cache cannot hold, and 32 KB, which it can.
        large = model.estimate_kernel(
            count(globalSectors=2e6, distinctSectors=2e6), CHIP)
        self.assertEqual(large.limit, "DRAM")
        self.assertAlmostEqual(large.least_ms, 0.64)
        small = model.estimate_kernel(
            count(globalSectors=2e6, distinctSectors=1e3), CHIP)
        self.assertEqual(small.least["DRAM"], 0)
        self.assertAlmostEqual(small.least["L2"], 32e-6)
        self.assertAlmostEqual(small.work["L2"], 0.064)
        unknown = dataclasses.replace(CHIP, l2_bytes_per_clock=None)
        self.assertNotIn("L2", model.estimate_kernel(count(), unknown).work)

    def test_least_is_never_more_than_most(self):
        for chip in CHIPS.values():
            it = model.estimate_kernel(
                count(float32=1e5, loadGlobal=1e4, globalSectors=1e5,
                      distinctSectors=5e4, float32Division=1e3), chip)
            self.assertLessEqual(it.least_ms, it.most_ms)

    def test_launches(self):
        chip = dataclasses.replace(CHIP, launch_us=1.0, graph_us=0.5, wait_us=5.0)
        report = {"kernels": {"k": count(launches=3)},
                  "host": {"launches": 3, "graphKernels": 0, "waits": 2}}
        frame = model.estimate_frame(report, chip)
        self.assertEqual(frame.kernels["k"].limit, "launch")
        self.assertAlmostEqual(frame.least_ms, 0.003)
        self.assertAlmostEqual(frame.most_ms, 0.013)
        report["host"] = {"launches": 0, "graphKernels": 3, "waits": 1}
        frame = model.estimate_frame(report, chip)
        self.assertAlmostEqual(frame.least_ms, 0.0015)
        self.assertAlmostEqual(frame.most_ms, 0.0065)

    def test_a_kernel_that_ran_nothing(self):
        it = model.estimate_kernel(count(blocks=0, warps=0, launches=0), CHIP)
        self.assertEqual(it.most_ms, 0)


class Data(unittest.TestCase):
    def test_chips(self):
        self.assertEqual(list(CHIPS), ["K40c", "V100", "A100", "H100", "H200"])
        for chip in CHIPS.values():
            self.assertTrue(chip.sources)
            self.assertEqual(set(chip.lanes), set(model.UNITS))
        self.assertEqual({s for c in CHIPS.values() for s in c.sources},
                         set(SOURCES))
        # As NVIDIA states it: 4.29 TFLOPS at 745 MHz, 15.7, 19.5, 67, 67.
        flops = {c.name: 2e-3 * c.multiprocessors * c.lanes["float32"] * c.gigahertz
                 for c in CHIPS.values()}
        for name, stated in (("K40c", 4.29), ("V100", 15.7), ("A100", 19.5),
                             ("H100", 67), ("H200", 67)):
            self.assertAlmostEqual(flops[name] / stated, 1, delta=0.01)

    def test_unknown_source(self):
        data = json.loads(pathlib.Path(DATA).read_text())
        data["chips"]["K40c"]["sources"] = ["hearsay"]
        with tempfile.NamedTemporaryFile("w") as file:
            json.dump(data, file)
            file.flush()
            with self.assertRaisesRegex(ValueError, "K40c.*'hearsay'"):
                read_chips(file.name)

    def test_slots(self):
        assembler = slots.find_assembler()
        if not assembler:
            self.skipTest("no ptxas")
        for kind, count in slots.measure(assembler, "sm_80").items():
            self.assertAlmostEqual(model.SLOTS[kind] / count, 1, delta=0.2, msg=kind)

    def test_explained(self):
        text = ("Pipeline P\n\nOn sm_80, as ptxas says:\n  threads  block memory  "
                "registers  stack  spilled  occupancy  kernel\n"
                "       64           264         48      0       12       62 %  "
                "kernel_a\n  For the largest stack a driver keeps 1664 KB of memory\n\nMore:\n  a b c\n")
        self.assertEqual(list(counting.read_explained(text)), [
            ("kernel_a", {"threads": "64", "block memory": "264",
                          "registers": "48", "stack": "0", "spilled": "12",
                          "occupancy": "62%"})])


if __name__ == "__main__":
    unittest.main()
