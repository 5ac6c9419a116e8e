# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""State, sources and runs."""

import gc
import threading
import unittest
import weakref

import numpy as np

import piko
from support import COUNT, DOTS, draw, make_dots, make_pipe


class Runs(unittest.TestCase):
    def test_picture(self):
        pipe = make_pipe(style={"gain": 2})
        pipe.run()
        image = pipe["image"]
        self.assertEqual((image.shape, image.dtype), ((16, 32), pipe.dtype("image")))
        dots = make_dots(pipe.source("plot").dtype)
        colors, counts = draw(dots, 2 * np.linspace(0, 1, COUNT, dtype="f4"))
        np.testing.assert_array_equal(image["count"], counts)
        np.testing.assert_allclose(image["color"], colors, rtol=1e-6)
        np.testing.assert_array_equal(pipe["order"], np.arange(COUNT) + 5)

    def test_one_step(self):
        pipe = piko.Pipeline(
            DOTS, "Dots", domain=[32, 16], threads=1, defines=["QUIET"], offset=9
        )
        self.assertEqual((pipe.domain, pipe.threads), ((32, 16), 1))
        self.assertEqual(pipe["offset"], 9)
        self.assertEqual(repr(pipe), "<piko.Pipeline Dots, 32 x 16>")
        self.assertEqual((pipe.device, pipe.device_refusal), (-2, ""))
        program = piko.compile(DOTS, "Dots")
        self.assertEqual(piko.Pipeline(program, "Dots").name, "Dots")
        with self.assertRaisesRegex(ValueError, "is of 'Dots', not of 'None'"):
            piko.Pipeline(program, "None")
        with self.assertRaisesRegex(KeyError, "no state 'none'; it has image, weights"):
            program.create(none=3)

    def test_threads_make_no_difference(self):
        pictures = []
        for threads in (1, 2, 7):
            pipe = make_pipe()
            pipe.threads = threads
            pipe.run()
            pictures.append(pipe["image"].tobytes())
        self.assertEqual(len(set(pictures)), 1)

    def test_options(self):
        pipe = make_pipe()
        pipe.set_memory_limit(1 << 30)
        pipe.set_memory_budget(1 << 20)
        pipe.set_strip_size(16)
        pipe.set_loop_limit(5)
        pipe.set_mappings("scalar")
        pipe.set_static_input(True)
        pipe.run()
        for call, value in (
            (pipe.set_memory_limit, -1),
            (pipe.set_memory_budget, -1),
            (pipe.set_strip_size, -1),
            (pipe.set_loop_limit, -1),
            (pipe.set_mappings, "none"),
        ):
            with self.assertRaisesRegex(ValueError, f"^{call.__name__}: .*expected "):
                call(value)
        for threads in (-1, 1 << 40):
            with self.assertRaisesRegex(ValueError, r"threads: .* in \[0, 10000\]"):
                pipe.threads = threads
        with self.assertRaisesRegex(ValueError, "expected domain extents in "):
            pipe.domain = (0, 3)
        for value, error in (((1.5, 3), TypeError), ((1 << 70, 3), ValueError)):
            with self.assertRaisesRegex(error, "domain: expected an integer"):
                pipe.domain = value
        self.assertEqual(pipe.domain, (32, 16))

    def test_errors_of_runs(self):
        pipe = piko.Pipeline(DOTS, "Outside", domain=(1, 1), values=[0, 0])
        pipe.feed("store", [0, 1])
        pipe.run()
        pipe.feed("store", [1, 5])
        with self.assertRaisesRegex(piko.RunError, "stage 'store'") as caught:
            pipe.run()
        self.assertEqual(caught.exception.status, piko.Status.INDEX_OUTSIDE)
        self.assertIn("5", caught.exception.message)
        with self.assertRaises(piko.RunError) as caught:
            piko.Pipeline(DOTS, "Outside", domain=(1, 1)).run()
        self.assertEqual(caught.exception.status, piko.Status.UNBOUND)
        self.assertIn("buffer 'values' is not bound", str(caught.exception))
        with self.assertRaises(piko.RunError) as caught:
            piko.Pipeline(DOTS, "Outside").run()
        self.assertIn("the domain is not set", str(caught.exception))
        with self.assertRaises(piko.RunError):
            piko.Pipeline(DOTS, "Outside", device=-9)

    def test_stats(self):
        pipe = make_pipe()
        self.assertEqual((pipe.stats().runs, pipe.stats().ms), (0, 0))
        for _ in range(3):
            pipe.run()
        stats = pipe.stats()
        self.assertEqual(stats.runs, 3)
        self.assertEqual([stage.name for stage in stats.stages], ["plot"])
        plot = stats.stages[0]
        self.assertEqual((plot.bin_size, plot.taken), ((8, 8), 3 * COUNT))
        self.assertIn("plot", [kernel.name for kernel in stats.kernels])
        self.assertGreater(stats.ms, 0)
        self.assertGreater(stats.reserved_bytes, 0)
        pipe.reset_stats()
        self.assertEqual(pipe.stats().runs, 0)


class State(unittest.TestCase):
    def test_constants(self):
        pipe = piko.Pipeline(DOTS, "Dots")
        self.assertEqual((pipe["offset"], pipe["light"].tolist()), (5, [0, 0, 0]))
        pipe = make_pipe()
        self.assertEqual(pipe["offset"], 5)
        pipe["offset"] = 8
        self.assertEqual((pipe["offset"], pipe["offset"].shape), (8, ()))
        pipe["light"] = np.float64(2)
        self.assertEqual(pipe["light"].tolist(), [2, 2, 2])
        pipe["style"] = {"knots": [((1, 2, 3), 4), ((5, 6, 7), 8)], "scale": 3}
        style = pipe["style"]
        self.assertEqual(style["knots"]["at"].tolist(), [[1, 2, 3], [5, 6, 7]])
        self.assertEqual((style["gain"], style["scale"]), (1, 3))
        with self.assertRaisesRegex(ValueError, "read-only"):
            style["gain"] = 3
        for name, value in (
            ("light", (1, 2)),
            ("light", "red"),
            ("offset", (1, 2)),
            ("offset", 1 << 40),
            ("offset", 1.5),
            ("style", 3),
            ("style", {"knots": 3}),
            ("style", {"none": 1}),
        ):
            with self.assertRaisesRegex(ValueError, f"constant '{name}': "):
                pipe[name] = value
        none = [None, 1j, np.complex64(3), (1, None, 2), np.array([None] * 3)]
        for name, value in [("light", one) for one in none] + [("style", {"gain": None})]:
            with self.assertRaisesRegex(TypeError, f"'{name}': expected real numbers, "):
                pipe[name] = value
        self.assertEqual(pipe["light"].tolist(), [2, 2, 2])
        pipe["style"] = style  # a record of its own kind
        self.assertEqual(pipe["style"], style)

    def test_buffers_in_place(self):
        values = np.zeros(8, "i4")
        pipe = piko.Pipeline(DOTS, "Outside", domain=(1, 1), values=values)
        self.assertIs(pipe["values"], values)
        pipe.feed("store", np.arange(8, dtype="u4"))
        pipe.run()
        self.assertEqual(values.tolist(), list(range(8)))
        kept = weakref.ref(values)
        del values
        gc.collect()
        self.assertIsNotNone(kept())  # while it is bound
        pipe.run()
        pipe["values"] = [0] * 9  # a copy
        gc.collect()
        self.assertIsNone(kept())
        pipe.run()
        self.assertEqual(pipe["values"].tolist(), [*range(8), 0])
        np.testing.assert_array_equal(pipe.read("values"), pipe["values"])

    def test_allocate(self):
        pipe = piko.Pipeline(DOTS, "Outside", domain=(1, 1))
        values = pipe.allocate("values", 4)
        self.assertEqual((values.tolist(), values.dtype), ([0] * 4, "i4"))
        pipe.feed("store", [3])
        pipe.run()
        self.assertEqual(values.tolist(), [0, 0, 0, 3])
        values[0] = 9  # it is the pipeline's own memory
        self.assertEqual(pipe["values"].tolist(), [9, 0, 0, 3])
        with self.assertRaisesRegex(BufferError, "'values' is in use"):
            pipe.allocate("values", 8)
        with self.assertRaisesRegex(BufferError, "'values' is in use"):
            pipe["values"] = np.zeros(3, "i4")
        del values
        self.assertEqual(pipe.allocate("values", 8).shape, (8,))
        self.assertEqual(pipe.allocate("values", 0).shape, (0,))
        with self.assertRaisesRegex(ValueError, "'values': expected a count of at least 0"):
            pipe.allocate("values", -1)
        with self.assertRaisesRegex(TypeError, "is constant, not a buffer"):
            make_pipe().allocate("light", 3)

    def test_mapping(self):
        names = ["image", "weights", "tints", "order", "light", "offset", "style"]
        pipe = make_pipe()
        self.assertEqual((list(pipe), list(pipe.keys()), len(pipe)), (names, names, 7))
        self.assertIn("light", pipe)
        self.assertNotIn("lihgt", pipe)
        self.assertNotIn(0, pipe)
        pipe.run()
        self.assertEqual([name for name, _ in pipe.items()], names)
        self.assertEqual(len(pipe.values()), 7)
        self.assertIs(dict(pipe)["weights"], pipe["weights"])
        bare = "struct Bare : piko::Pipe<> {\n  Drop drop;\n  Bare() { source(drop); }\n};\n"
        drop = "struct Drop : piko::Stage<0, 0, 64, int> {\n  void process(const int &) {}\n};\n"
        empty = piko.Pipeline(f"#include <piko.h>\n{drop}{bare}")
        self.assertEqual((len(empty), bool(empty)), (0, True))

    def test_attributes(self):
        """Those of a derived class are its own, unless they are state."""

        class Player(piko.Pipeline):
            def __init__(self):
                super().__init__(DOTS, "Dots", domain=(1, 1))
                self.frames = 0

        player = Player()
        player.frames += 1
        player.threads = 3
        self.assertEqual((player.frames, player.threads), (1, 3))
        with self.assertRaisesRegex(AttributeError, r"set by pipe\['light'\]"):
            player.light = (1, 2, 3)
        self.assertFalse(hasattr(player, "light"))

    def test_what_cannot_be_assigned(self):
        pipe = make_pipe()
        with self.assertRaisesRegex(TypeError, "'image' is an image"):
            pipe["image"] = np.zeros(3)
        with self.assertRaisesRegex(TypeError, "each primitive of source 'plot'"):
            pipe["order"] = np.zeros(3, "i4")
        with self.assertRaisesRegex(KeyError, "has no state 'none'"):
            pipe["none"]
        with self.assertRaises(piko.RunError) as caught:
            pipe["image"]  # before a run
        self.assertEqual(caught.exception.status, piko.Status.UNBOUND)

    def test_views_live_as_long_as_their_pipeline(self):
        pipe = make_pipe()
        pipe.run()
        colors = pipe["image"]["color"][2:5]
        expected = colors.copy()
        core = weakref.ref(pipe)
        del pipe
        gc.collect()
        self.assertIsNone(core())  # the memory is kept, not the object
        np.testing.assert_array_equal(colors, expected)

    def test_views_are_no_copies(self):
        for target in ("cpu", "reference", "gpu-on-cpu"):
            pipe = make_pipe(target=target, opt_level=0)
            pipe.run()
            first, again = pipe["image"], pipe["image"]
            before = first.copy()
            self.assertTrue(np.shares_memory(first, again))
            pipe["light"] = (0, 0, 0)
            for _ in range(3):  # in the same memory
                pipe.run()
                self.assertTrue(np.shares_memory(first, pipe["image"]), target)
            self.assertFalse(np.array_equal(first["color"], before["color"]))

    def test_no_view_dangles(self):
        pipe = make_pipe()
        pipe.run()
        color = pipe["image"]["color"]
        order = pipe["order"]
        pipe.domain = (64, 16)
        with self.assertRaisesRegex(BufferError, "'image' is in use.*copy()"):
            pipe.run()
        color = color.copy()
        pipe.run()
        self.assertEqual(pipe["image"].shape, (16, 64))
        pipe.feed("plot", make_dots(pipe.source("plot").dtype)[:7])
        with self.assertRaisesRegex(BufferError, "'order' is in use"):
            pipe.run()
        del order
        pipe.run()
        self.assertEqual(pipe["order"].shape, (7,))

    def test_reflection(self):
        pipe = make_pipe()
        self.assertEqual(pipe.state["image"], "image")
        self.assertEqual(pipe.state["order"], "buffer")
        self.assertEqual(pipe.state["light"], "constant")
        (plot,) = pipe.sources
        self.assertEqual((plot.name, plot.index, plot.count), ("plot", 0, COUNT))
        self.assertIs(pipe.source(0), plot)
        for which in ("none", 1, -1):
            with self.assertRaisesRegex(KeyError, "no source '.*'; it has plot"):
                pipe.source(which)
        self.assertNotEqual(pipe.processor, "")


class Threads(unittest.TestCase):
    def test_one_at_a_time(self):
        """A pipeline that runs is nobody else's."""
        pipe = piko.Pipeline(DOTS, "Countdown", domain=(1, 1), values=[0])
        pipe.set_loop_limit(1 << 40)
        pipe.feed("count", [200_000])
        runs = threading.Thread(target=pipe.run)
        seen = []
        runs.start()
        while runs.is_alive():
            try:
                pipe["values"]
            except RuntimeError as error:
                seen.append(str(error))
        runs.join()
        self.assertEqual(pipe["values"].tolist(), [7])
        self.assertTrue(set(seen) <= {"pipeline 'Countdown' runs in another thread"})

    def test_several_at_once(self):
        pipes = [make_pipe() for _ in range(4)]
        threads = [threading.Thread(target=pipe.run) for pipe in pipes]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len({pipe["image"].tobytes() for pipe in pipes}), 1)


if __name__ == "__main__":
    unittest.main()
