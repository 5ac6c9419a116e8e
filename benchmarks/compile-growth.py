#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""How the time and the memory of compiling a pipeline grow with its text.

  compile-growth.py [options] [KIND..]

Generates pipelines of more and more stages and statements, compiles each of them,
without a cache, and prints a table in Markdown, a text a row: the time of its
processor in seconds, the memory that was resident at most in MiB, and how many times
those of the text before, which is a tenth or a third as long. Kinds of texts:

  fused     a chain of stages that become one kernel
  apart     a chain of stages with a kernel each
  stores    statements that store if the primitive is divisible by a number
  loads     statements that add elements of a buffer to a local variable
  branches  statements that change a local variable in one of two ways
  locals    statements that change a local variable

With --most-memory the exit status is 1 where memory grows by more than that from the
smallest text of a kind to the largest.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile

from commands import run_main

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

HEAD = """#include <piko.h>
struct In { int i, v; };
struct State { piko::Buffer<int> out; };
"""

STAGES = """template <int K> struct Step : piko::Stage<{bins}, 64, In, In> {{
{assign}  void process(const In &in) {{ this->emit(In{{in.i, in.v * 3 + K}}); }}
}};
struct Last : piko::Stage<0, 0, 64, In>, piko::Uses<State> {{
  void process(const In &in) {{ state().out[in.i] = in.v; }}
}};
"""

ASSIGN = """  void assignBin(const In &in) {
    this->assignToBin(in, piko::BinId(in.v & 7));
  }
"""

STATEMENTS = {
    "stores": lambda k: f"if (in.i % {k + 2} == 0) state().out[in.i] = {k};",
    "loads": lambda k: f"x += state().out[in.v + {k}];",
    "branches": lambda k: f"if (x & {1 << k % 20}) x += {k}; else x ^= {k};",
    "locals": lambda k: f"x = x * {k % 7 + 3} + (x >> {k % 5 + 1});",
}
KINDS = ["fused", "apart", *STATEMENTS]


def generate_stages(count, apart):
    text = HEAD + STAGES.format(bins="8, 8" if apart else "0, 0",
                                assign=ASSIGN if apart else "")
    text += "struct P : piko::Pipe<State> {\n"
    text += "".join(f"  Step<{k}> s{k};\n" for k in range(count))
    text += "  Last last;\n  P() {\n    source(s0);\n"
    text += "".join(f"    connect(s{k}, 0, s{k + 1});\n" for k in range(count - 1))
    return text + f"    connect(s{count - 1}, 0, last);\n  }}\n}};\n"


def generate_statements(count, statement):
    text = HEAD + "struct A : piko::Stage<0, 0, 64, In>, piko::Uses<State> {\n"
    text += "  void process(const In &in) {\n    int x = in.v;\n"
    text += "".join(f"    {statement(k)}\n" for k in range(count))
    text += "    state().out[in.i] = x;\n  }\n};\n"
    return text + "struct P : piko::Pipe<State> {\n  A a;\n  P() { source(a); }\n};\n"


def generate(kind, count):
    if kind in STATEMENTS:
        return generate_statements(count, STATEMENTS[kind])
    return generate_stages(count, apart=kind == "apart")


def compile_text(pikoc, text):
    """The time of the processor in seconds, and the memory at most in MiB."""
    with tempfile.TemporaryDirectory() as work:
        path = os.path.join(work, "text.piko.cpp")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        command = [pikoc, path, "--no-cache", "-o", os.path.join(work, "text.o")]
        process = subprocess.Popen(command)
        _, status, used = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(command)}: status {os.waitstatus_to_exitcode(status)}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", default=KINDS,
                        help="(all)")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin")
    parser.add_argument("--stages", type=int, nargs="+", default=[30, 100, 300, 1000],
                        help="(%(default)s)")
    parser.add_argument("--statements", type=int, nargs="+",
                        default=[100, 1000, 10000], help="(%(default)s)")
    parser.add_argument("--most-memory", type=float, metavar="FACTOR")
    arguments = parser.parse_args()
    for kind in arguments.kinds:
        if kind not in KINDS:
            parser.error(f"expected one of {', '.join(KINDS)}, but got {kind}")

    # A text whose memory grows with the square must not take the machine's.
    resource.setrlimit(resource.RLIMIT_AS, (16 << 30, 16 << 30))
    grows = False
    print("| text | length | s | times before | MiB | times before |")
    print("|---|---|---|---|---|---|")
    for kind in arguments.kinds:
        before, first = None, None
        sizes = arguments.statements if kind in STATEMENTS else arguments.stages
        for size in sizes:
            now = compile_text(f"{arguments.bin}/pikoc", generate(kind, size))
            factors = [f"{a / b:.1f}" for a, b in zip(now, before)] if before else "  "
            print(f"| {kind} | {size} | {now[0]:.2f} | {factors[0]} | {now[1]:.0f} | "
                  f"{factors[1]} |", flush=True)
            first, before = first or now, now
        if arguments.most_memory and before[1] > arguments.most_memory * first[1]:
            print(f"{kind}: memory grows by {before[1] / first[1]:.1f}, more than "
                  f"{arguments.most_memory}", file=sys.stderr)
            grows = True
    return 1 if grows else 0


if __name__ == "__main__":
    run_main(main)
