# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What was published of the two rasterizers that this one follows."""

from suite.section import Section, draw_groups

SOURCE = "Patney et al., Piko, ACM TOG 34(4), 2015, table 4: Tesla K40c, 1024 x 768"
# Scene, triangles, milliseconds of cudaraster and of the paper's Piko.
TABLE = [("Fairy Forest", 174_000, 1.58, 8.80), ("Buddha", 1_100_000, 2.63, 11.20),
         ("Mecha", 254_000, 1.91, 6.40), ("Dragon", 871_000, 2.58, 10.20)]


def measure(options, timer):
    del options, timer
    return Section(
        "published", "Published: cudaraster and Piko on a Tesla K40c",
        [SOURCE + ". Their scenes and cameras are not those of this page, and neither "
         "is the card: nothing here is to be divided by anything there."],
        ["scene", "triangles", "cudaraster", "Piko, 2015", "relative"],
        [[scene, f"{triangles:,}", f"{theirs} ms", f"{own} ms", f"{own / theirs:.2f}"]
         for scene, triangles, theirs, own in TABLE],
        [{"scene": scene, "triangles": triangles, "cudaraster_ms": theirs,
          "piko_2015_ms": own} for scene, triangles, theirs, own in TABLE],
        lambda pyplot: draw_groups(
            pyplot, [row[0] for row in TABLE],
            {"cudaraster": [row[2] for row in TABLE],
             "Piko, 2015": [row[3] for row in TABLE]}, "milliseconds"))
