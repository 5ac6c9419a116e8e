# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Where a user trades speed for error, and what each choice is measured by."""

import dataclasses
from dataclasses import dataclass, field

from speed_error.lod import Level

CHOICES_FOLDER = "benchmarks/choices"


@dataclass(frozen=True)
class Setting:
    """One of a choice: a pipeline and options of piko-render."""

    name: str
    source: str
    pipe: str
    options: tuple[str, ...] = ()
    quick: bool = True  # whether it is of what --quick measures
    level: Level | None = None  # of the mesh; None: all of it

    def command(self, tool):
        return [tool, self.source, "--pipe", self.pipe, "-I", "examples",
                *self.options]


@dataclass(frozen=True)
class Choice:
    name: str
    title: str
    settings: list[Setting]
    reference: Setting
    against: str  # what the reference is, for a reader
    text: str  # what the choice is
    default: str  # the setting of the examples
    patches: bool = False  # of scenes that are patches, not meshes
    options: tuple[str, ...] = field(default=())  # of all settings

    def is_quick(self):
        """Whether --quick measures it if nobody asks for it."""
        return any(s.quick for s in self.settings)

    def quickly(self):
        """What --quick measures of it: all, if none of its settings is quick."""
        settings = [s for s in self.settings if s.quick or not self.is_quick()]
        return dataclasses.replace(self, settings=settings)


def sets(**constants):
    return tuple(word for name, value in constants.items()
                 for word in ("--set", f"{name}={value}"))


EXACT = Setting("exact", f"{CHOICES_FOLDER}/exact.piko.cpp", "Exact")


def exact(**constants):
    return Setting("exact", EXACT.source, EXACT.pipe, sets(**constants))


def numbers():
    source = f"{CHOICES_FOLDER}/numbers.piko.cpp"
    return Choice(
        "numbers", "Numbers of a stage",
        [*(Setting(name, source, f"{name}Numbers")
           for name in ("Strict", "Contracted", "Relaxed", "Double")),
         *(Setting(name, f"{CHOICES_FOLDER}/halves.piko.cpp", pipe, quick=False)
           for name, pipe in (("half normals", "HalfNormals"),
                              ("half colours", "HalfColors"),
                              ("both in halves", "Halves")))],
        Setting("Double", source, "DoubleNumbers"), "the same in double",
        "specifyPrecision of the stage that shades, in examples/raster's Tiled, "
        "and halves in place of floats on the edges to it and from it. In one "
        "kernel with what they connect, these edges are registers or arrays of a "
        "bin: halves save little memory traffic and cost conversions.",
        "Strict", options=("--lights", "100"))


def functions():
    source = f"{CHOICES_FOLDER}/functions.piko.cpp"
    return Choice(
        "functions", "Functions of a stage",
        [Setting(name, source, pipe) for name, pipe in
         (("0.501 ULP", "ExactFunctions"), ("1 ULP", "FunctionsIn1Ulp"),
          ("4 ULP", "FunctionsIn4Ulps"), ("Relaxed, 4 ULP", "RelaxedFunctions"))],
        Setting("0.501 ULP", source, "ExactFunctions"),
        "functions within 0.501 ULP",
        "specifyUlps of the stage that shades, in examples/raster's Tiled with a "
        "highlight of each light (pow), fog (exp) and gamma (pow). In Relaxed "
        "divisions and square roots are approximated as well.",
        "0.501 ULP", options=("--lights", "20"))


def subpixels():
    source = "examples/visibility/visibility.piko.cpp"
    return Choice(
        "subpixels", "Bits below a pixel",
        [Setting(f"{bits} bits", source, "Visibility",
                 ("-D", f"SUBPIXEL_BITS={bits}")) for bits in (2, 4, 6, 8, 10)],
        exact(), "rays in double",
        "The grid on which examples/visibility places corners; its coverage is "
        "exact on each.", "8 bits")


def rays():
    source = f"{CHOICES_FOLDER}/rays.piko.cpp"
    return Choice(
        "rays", "Rays and triangles",
        [Setting(name, source, pipe, sets(depth=0, shadows=0), quick)
         for name, pipe, quick in
         (("watertight", "Watertight", True),
          ("direct, float", "DirectFloat", True),
          ("direct, double", "DirectDouble", True),
          ("watertight, double t", "FarWatertight", False),
          ("direct, double t", "FarDirectDouble", False))],
        exact(), "rays in double",
        "The test of examples/raytrace, which is watertight, and Moeller's and "
        "Trumbore's, whose triangles round each for itself; the distance t of a "
        "hit in float, or in double. Camera rays. Points are computed from the "
        "weights of a triangle's corners, so that t only decides which hit is the "
        "nearest: its precision shows where two are closer than floats tell apart.",
        "watertight")


def shading_rate():
    source = f"{CHOICES_FOLDER}/shading_rate.piko.cpp"
    return Choice(
        "shading-rate", "Pixels that share a colour",
        [*(Setting(f"{side}x{side}", source, f"Rate{side}")
           for side in (1, 2, 4)),
         *(Setting(f"{side}x{side} by depths", source, f"Contrast{side}")
           for side in (2, 4)),
         *(Setting(f"{side}x{side} by {percent} % contrast", source,
                   f"Colors{side}", ("-D", f"CONTRAST={percent / 100}"),
                   quick=False)
           for side in (2, 4) for percent in (1, 5))],
        Setting("1x1", source, "Rate1"), "each pixel shaded",
        "examples/visibility, shaded once for each block of pixels; once more "
        "where their depths differ; or at two pixels of 2x2 and the corners of 4x4, "
        "and at the others only if the contrast of these colours is above so many "
        "percent.", "1x1", options=("--lights", "1000"))


def transparency():
    source = f"{CHOICES_FOLDER}/transparency.piko.cpp"
    return Choice(
        "transparency", "Layers of transparency",
        [Setting("sorted", source, "Sorted"),
         *(Setting(f"{k} nearest", source, f"Nearest{k}")
           for k in (2, 4, 8, 16, 32)),
         Setting("weighted", source, "Weighted"),
         Setting("moments", f"{CHOICES_FOLDER}/moments.piko.cpp", "MomentOit",
                 quick=False)],
        Setting("sorted", source, "Sorted"), "all layers sorted",
        "examples/oit; pixels that keep their k nearest layers (a k-buffer); a "
        "weighted mean of all; and moment-based transparency, which estimates "
        "from four power moments how far each layer is seen.", "sorted")


SHADOW = "examples/shadow/shadow.piko.cpp"
SHADOW_MAP = f"{CHOICES_FOLDER}/shadow_map.piko.cpp"


def shadows():
    # On a slope, texels of the filter are nearer to the light by up to half a
    # texel more than its reach.
    return Choice(
        "shadows", "Percentage-closer filtering",
        [Setting(f"{2 * reach + 1}x{2 * reach + 1}", SHADOW, "Bins32",
                 sets(texels=reach, bias=reach + 0.5)) for reach in range(4)],
        exact(shadows=1), "shadow rays in double",
        "How many texels of the shadow map examples/shadow compares, with as much "
        "bias as that needs; its map has as many texels as the image has pixels.",
        "3x3", options=("--ground",))


def shadow_map():
    return Choice(
        "shadow-map", "Size of a shadow map",
        [Setting("as the image", SHADOW, "Bins32", quick=False),
         *(Setting(f"{side} x {side}", SHADOW_MAP, f"Map{side}", sets(side=side),
                   quick=False)
           for side in (256, 512, 1024, 2048, 4096, 8192))],
        exact(shadows=1), "shadow rays in double",
        "The texels of the map that examples/shadow draws: as many as the image has "
        "pixels, or so many in a square. The ground, two triangles, covers half of "
        "them.", "as the image", options=("--ground",))


def shadow_bias():
    def settings(name, pipe, biases, quick):
        return [Setting(f"{name} {bias}", SHADOW_MAP, pipe,
                        sets(side=1024, bias=bias), quick) for bias in biases]

    return Choice(
        "shadow-bias", "Bias of a shadow map",
        [*settings("offset", "Map1024", (0, 0.5, 1, 1.5, 3, 6), True),
         *settings("slope", "SlopeScaled1024", (1, 1.5, 3, 6), False),
         *settings("constant", "Constant1024", (1, 1.5, 3, 6), False)],
        exact(shadows=1), "shadow rays in double",
        "How far, in texels of a map of 1024 x 1024, a surface is lifted above it: "
        "by their slope along the normal, as examples/shadow does; by their slope "
        "towards the light (slope-scaled bias); or towards the light by as much "
        "everywhere. With less it shadows itself (acne), with more shadows come off "
        "what casts them.", "offset 1.5", options=("--ground",))


REYES = "examples/reyes/reyes.piko.cpp"
FINEST = Setting("1/16", REYES, "Reyes", sets(rate=1 / 16))


def micropolygons():
    return Choice(
        "micropolygons", "Size of micropolygons",
        [Setting(f"{rate} pixels", REYES, "Reyes", sets(rate=rate))
         for rate in (4, 2, 1, 0.5, 0.25)],
        FINEST, "micropolygons of 1/16 pixel",
        "How long an edge of a micropolygon of examples/reyes may be.",
        "1 pixels", patches=True)


def bound_slack():
    # Segments are as many as the bound over the rate, so that a bound which is
    # twice as long is a rate which is half as long.
    return Choice(
        "bound-slack", "Slack of the bound of edges",
        [Setting(f"{slack} times", REYES, "Reyes", sets(rate=1 / slack),
                 quick=False) for slack in (0.7, 1, 1.2, 1.4, 1.7, 2)],
        FINEST, "micropolygons of 1/16 pixel",
        "examples/reyes dices to edges of 1 pixel at most, by bounds of curves: how "
        "many times longer these are than its own. Below 1 an edge may be longer "
        "than asked for, at 0.7 by what rounding segments to the nearest power of "
        "two, not up, would allow.", "1 times", patches=True)


def levels_of_detail():
    source = "examples/visibility/visibility.piko.cpp"
    full = Setting("full mesh", source, "Visibility", quick=False)

    def level(pixels, cluster=0):
        name = f"{pixels} pixels" + (" by cluster" if cluster else "")
        return Setting(name, source, "Visibility", quick=False,
                       level=Level(pixels, cluster))

    return Choice(
        "detail", "Levels of detail",
        [full, *(level(pixels) for pixels in (0.25, 0.5, 1, 2, 4, 8)),
         *(level(pixels, 2048) for pixels in (0.5, 2, 8))],
        full, "the full mesh",
        "examples/visibility of meshes that meshoptimizer has simplified, by edge "
        "collapse and quadric error metrics: so far off, in pixels, at the vertex "
        "that is nearest to the eye, or for each cluster of 2048 triangles at its "
        "nearest one, with fixed borders between clusters. That is of positions: "
        "the normals, which make most of the error here, are off by more.",
        "full mesh")


def samples():
    source = f"{CHOICES_FOLDER}/samples.piko.cpp"
    return Choice(
        "samples", "Samples a pixel",
        [Setting("1", source, "Samples1"),
         *(Setting(f"{n} {kind.lower()}", source, f"{kind}{n}")
           for n in (2, 4, 8, 16) for kind in ("Rotated", "Sobol"))],
        exact(samples=32), "1024 rays a pixel in double",
        "Where camera rays pass through a pixel: a rotated grid (the standard "
        "patterns of Direct3D) or the first points of Sobol's sequence.", "1")


def depth(scale, name="depth"):
    source = f"{CHOICES_FOLDER}/depth.piko.cpp"
    return Choice(
        name, f"Format of depths, far plane {scale:,} times as far as the near one",
        [Setting(setting, source, pipe, sets(range=scale), quick=scale == 10)
         for setting, pipe in
         (("16 bits", "Depth16"), ("24 bits", "Depth24"),
          ("32 bits", "Depth32"), ("float", "DepthFloat"),
          ("reversed float", "DepthReversed"))],
        exact(), "rays in double",
        "What examples/raster's Tiled compares: z / w as an integer or a float, "
        "or near / distance.", "float")


def output():
    source = f"{CHOICES_FOLDER}/output.piko.cpp"
    return Choice(
        "output", "Format of the result",
        [Setting(name, source, pipe) for name, pipe in
         (("float", "OutputFloat"), ("half", "OutputHalf"),
          ("dithered 8 bits", "OutputDithered"), ("8 bits", "OutputBytes"))],
        Setting("float", source, "OutputFloat"), "floats",
        "What the last stage rounds colours to. Dithering adds to the error of "
        "each pixel, and takes away that of their means, which FLIP sees.",
        "float")


CHOICES = {choice.name: choice for choice in
           (numbers(), functions(), samples(), levels_of_detail(), subpixels(), depth(10),
            depth(10**4, "depth-10k"), depth(10**6, "depth-1m"), rays(),
            shading_rate(), transparency(), shadows(), shadow_map(),
            shadow_bias(), micropolygons(), bound_slack(), output())}
