# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Bodies under the roofline of one core.

The roof is measured in the same run: a triad for the bandwidth of memory, and
chains of fused multiply-adds for arithmetic. A body's operations and bytes are
what its host counts: each `+ - * /` and root of a float that the program's text
asks for, and each byte of memory that it must read or write at least once.
"""

import os

import bodies
import suite.bodies
from commands import call
from suite.section import Rounds, Section

PEAKS = f"{bodies.ROOT}/benchmarks/roofline/peaks.cpp"


def measure_peaks(options):
    program = f"{options.work}/peaks"
    if not bodies.is_newer(program, PEAKS):
        call(["g++", "-std=c++20", "-O3", "-march=native", "-ffp-contract=fast",
              PEAKS, "-o", program])
    text = call([program, str(options.seconds), str(options.megabytes)])
    peaks = dict(line.split() for line in text.splitlines())
    return float(peaks["GB/s"]), float(peaks["GFLOP/s"])


def find_counted():
    """The bodies whose hosts count."""
    return [body for body in bodies.find_bodies()
            if "double flops()" in bodies.read(bodies.get_source(body))]


def measure(options):
    os.makedirs(options.work, exist_ok=True)
    counted = [body for body in options.bodies if body in find_counted()]
    suite.bodies.build(options, counted, [])
    bandwidth, peak = measure_peaks(options)
    rows, points = [], {}
    records = [{"what": "peak", "gflops": peak, "flops_per_byte": "",
                "gb_s": bandwidth, "roof_gflops": ""}]
    for body in counted:
        times = bodies.measure_rounds(options, body, ["default"])["default"]
        seconds = 1e-3 * Rounds(times).median
        flops, bytes_moved = bodies.count(options, body)
        intensity = flops / bytes_moved
        speed = 1e-9 * flops / seconds
        roof = min(peak, bandwidth * intensity)
        points[body] = intensity, speed
        rows.append([body, f"{flops / 1e6:.2f}", f"{bytes_moved / 1e3:.0f}",
                     f"{intensity:.2f}", f"{speed:.2f}", f"{roof:.1f}",
                     f"{speed / roof:.0%}"])
        records.append({"what": body, "gflops": speed,
                        "flops_per_byte": intensity,
                        "gb_s": 1e-9 * bytes_moved / seconds,
                        "roof_gflops": roof})
    return Section(
        "roofline", "Roofline",
        [f"One core: {bandwidth:.1f} GB/s by a triad, {peak:.1f} GFLOP/s by "
         "fused multiply-adds of the widest vectors. Pipelines multiply and add "
         "one after the other unless their text fuses them, which is at most "
         "half of that. Data that caches hold may be above the slope."],
        ["body", "MFLOP a frame", "KB a frame", "FLOP a byte", "GFLOP/s", "roof",
         "of the roof"], rows, records,
        lambda pyplot: draw(pyplot, points, bandwidth, peak))


def draw(pyplot, points, bandwidth, peak):
    figure, axes = pyplot.subplots(figsize=(8, 5))
    ridge = peak / bandwidth
    low = min([ridge, *(x for x, _ in points.values())]) / 3
    high = max([ridge, *(x for x, _ in points.values())]) * 3
    axes.plot([low, ridge, high], [low * bandwidth, peak, peak], color="black")
    axes.axhline(peak / 2, color="#666666", linestyle=":", linewidth=1)
    axes.text(high, peak / 2, "not fused ", ha="right", va="bottom", fontsize=9)
    for body, (intensity, speed) in points.items():
        axes.plot([intensity], [speed], "o", color="#0072b2")
        axes.annotate(body, (intensity, speed), xytext=(5, 3),
                      textcoords="offset points", fontsize=9)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(low, high)
    axes.set_xlabel("FLOP a byte")
    axes.set_ylabel("GFLOP/s")
    axes.grid(color="#dddddd")
    axes.set_axisbelow(True)
    figure.tight_layout()
    return figure
