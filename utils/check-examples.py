#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs the ```mlir examples of the dialect's TableGen files and of documents.

Each operation of the dialect has an example in its description, or says "See
`piko.X`" where X's example shows it. An example that holds a record or a
pipeline is a module. Any other is a piece of a phase, of an iteration or of a
kernel's loops, and is put into the pipeline below; names that it does not
define have the types of NAMES.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

from tool import run_main

ROOT = pathlib.Path(__file__).resolve().parent.parent
FENCE = re.compile(r"^[ ]*```mlir\n(.*?)^[ ]*```", re.S | re.M)

KERNEL_OPS = re.compile(
    r"piko\.(cpu\.\w+|grid|\w+_schedule|schedule_bin|fail\w*)(?= )"
)
ASSIGN_OPS = re.compile(r"piko\.(assign_\w+|owner)\b")
DIRECTIVES = re.compile(r"piko\.set_\w+")
# A statement alone, or a region of it, is no program: its values come from
# others. test/Dialect/Piko/Program/program.mlir has them whole. Nor is there a grid.
PROGRAM_OPS = re.compile(
    r"piko\.(clear|feed|join|launch|leave|wait|schedule_bins|strips|waves|rounds"
    r"|partition|exchange|keep|common|share|gpu\.\w+)\b"
)
LIST_OPS = re.compile(r"piko\.(list_\w+|parallel_for)\b")
BARRIERS = re.compile(r"piko\.(sync|reduce|scan|sort|grouped)\b")

NAMES = {
    "f32": "u v z depth",
    "i32": "x y x0 y0 x1 y1 one count zero id kind",
    "i64": "batch split mark lineage",
    "i1": "always isInside isNaN isUnwritten",
    "index": "a b bin bucket call cell first hi i j lo n tile unit",
    "vector<16xf32>": "values",
    "vector<16xindex>": "as places",
    "vector<16xi32>": "lanes",
    "vector<16xi1>": "mask",
}

CONTEXT = """
piko.record @Fragment {"x" : i32 at 0, "y" : i32 at 4, "z" : f32 at 8,
                       "w" : f32[4 : 4] at 12} size 28 align 4
piko.record @Point {"u" : f32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @Fragment.checked {"z" : f32 at 0, "piko.lineage" : i64 at 8}
  size 16 align 8
piko.record @Camera {"width" : i32 at 0} size 4 align 4
piko.record @Light {"color.x" : f32 at 0, "cutoff" : f32[2 : 4] at 4}
  size 12 align 4
piko.record @Vertex {"position.x" : f32 at 0} size 4 align 4
piko.record @Count {"value" : i32 at 0} size 4 align 4
piko.record @Depth {"z" : f32 at 0} size 4 align 4
piko.pipeline @Example rank 2 {
  piko.constant @camera : @Camera
  piko.buffer @lights : @Light
  piko.buffer @vertices : @Vertex
  piko.buffer @histogram : @Count
  piko.buffer @next : @Count
  piko.image @depth : @Depth rank 2 clear [1.0 : f32]
  piko.image @depth.unit : @Count rank 2 internal
  piko.source @rasterize
  piko.source @blend
  piko.edge @rasterize[0] -> @shade
  piko.edge @shade[0] -> @plot
  piko.stage @rasterize bins [8, 8] threads 64 : @Fragment -> [@Fragment] {}
  piko.stage @plot bins [8, 8] threads 64 tile 4 : @Point -> [] {}
  piko.stage @shade bins [8, 8] threads 64 : @Fragment -> [@Point] {
    SHADE
  }
  piko.stage @blend bins [8, 8] threads 64 : list @Fragment -> [] {
    BLEND
  }
  KERNEL
}
"""
PHASE = """piko.NAME {
    ^bb0(%INPUT: !piko.TYPE<@Fragment>):
      BODY
      piko.return
    }
"""
SCHEDULE = """piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      BODY
      piko.return
    }
"""
ITERATIONS = """piko.parallel_for %n {
      ^bb0(%i: index):
        BODY
        piko.yield
      }
"""


def definitions(text):
    """Operations that define what an example uses and does not define."""
    defined = set()
    for line in text.splitlines():
        left = re.match(r"\s*((?:%\w+(?:, )?)+)\s*=", line)
        if left:
            defined |= set(re.findall(r"%(\w+)", left[1]))
        defined |= set(re.findall(r"%(\w+): ", line))
    used = set(re.findall(r"%(\w+)", text)) - defined
    writer, primitive = "writer" in used, "p" in used
    bins = "bins" in used or primitive
    lines = []
    for kind, names in NAMES.items():
        value = {"f32": "1.0", "i1": "true", "vector<16xf32>": "dense<1.0>",
                 "vector<16xindex>": "dense<1>", "vector<16xi32>": "dense<1>",
                 "vector<16xi1>": "dense<true>"}.get(kind, "1")
        lines += [
            f"%{name} = arith.constant {value}"
            + ("" if kind == "i1" else f" : {kind}")
            for name in names.split()
            if name in used
            or (writer and name == "unit")
            or (primitive and name == "i")
        ]
    if bins or writer:
        lines.append("%bins = piko.storage.open_bins @shade : !piko.bins<@Fragment>")
    if writer:
        lines.append(
            "%writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Fragment>"
        )
    if primitive:
        lines.append(
            "%p = piko.storage.item %bins[%i]"
            " : !piko.bins<@Fragment> -> !piko.prim<@Fragment>"
        )
    return "\n".join(lines)


def is_module(text):
    return re.search(r"^\s*piko\.(record|pipeline) ", text, re.M)


def complete(text):
    """A module that holds the example."""
    if is_module(text):
        return text
    def module(shade="", blend="", kernel=""):
        places = {"SHADE": shade, "BLEND": blend, "KERNEL": kernel}
        result = CONTEXT
        for place, content in places.items():
            result = result.replace(place, content)
        return result

    def phase(name, inside, takes="prim"):
        kind = {"TYPE": takes, "INPUT": "list" if takes == "list" else "f"}
        result = PHASE.replace("NAME", name).replace("BODY", inside)
        for place, content in kind.items():
            result = result.replace(place, content)
        return result

    def blend(schedule, inside):
        assign = phase("assign", "piko.assign_all")
        return module(
            blend=assign + schedule + phase("process", inside, "list")
        )

    if BARRIERS.search(text):
        text = ITERATIONS.replace("BODY", text)
    body = definitions(text) + "\n" + text
    if re.search(r"piko\.(check_record|counter|fixed) ", text):
        return module(kernel=text)
    if "piko.schedule " in text:
        return blend(text, "")
    if DIRECTIVES.search(text):
        return blend(SCHEDULE.replace("BODY", body), "")
    if LIST_OPS.search(text):
        return blend("", body)
    if KERNEL_OPS.search(text):
        return module(kernel="piko.kernel @kernel {\n" + body + "}")
    if ASSIGN_OPS.search(text):
        return module(shade=phase("assign", body) + phase("process", ""))
    return module(
        shade=phase("assign", "piko.assign_all")
        + "piko.schedule load_balance unordered\n"
        + phase("process", body)
    )


def descriptions(tblgen, includes):
    """(name of the operation or None, name of the record, description)."""
    file = ROOT / "include/Piko/Dialect/Piko/IR/PikoReference.td"
    command = [tblgen, "--dump-json", str(file), f"-I{ROOT}/include"]
    command += [f"-I{path}" for path in includes]
    records = json.loads(subprocess.check_output(command))
    for name, record in sorted(records.items()):
        if not isinstance(record, dict):
            continue
        kinds = record.get("!superclasses", [])
        dialect = (record.get("opDialect") or record.get("dialect") or {}).get(
            "def"
        )
        if dialect != "Piko_Dialect":
            continue
        text = record.get("description") or ""
        op = "piko." + record["opName"] if "Op" in kinds else None
        yield op, name, text


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--opt", default="piko-opt")
    parser.add_argument("--tblgen", default="llvm-tblgen")
    parser.add_argument("-I", dest="includes", action="append", default=[])
    parser.add_argument("documents", nargs="*", type=pathlib.Path)
    args = parser.parse_args()

    examples, shown, faults = [], {}, 0
    described = list(descriptions(args.tblgen, args.includes))
    for op, name, text in described:
        fences = FENCE.findall(text)
        examples += [
            (name, fence)
            for fence in fences
            if is_module(fence) or not PROGRAM_OPS.search(fence)
        ]
        if op:
            shown[op] = set(re.findall(r"piko\.[\w.]+", "".join(fences)))
    for op, name, text in described:
        if not op or op in shown[op]:
            continue
        see = re.search(r"See `(piko\.[\w.]+)`", text)
        if not see or op not in shown.get(see[1], ()):
            print(f"{name}: expected an example of {op} in its description")
            faults += 1
    for document in args.documents:
        for fence in FENCE.findall(document.read_text()):
            examples.append((document.name, fence))

    def run(example):
        return subprocess.run(
            [args.opt, "-o", os.devnull],
            input=complete(example[1]),
            capture_output=True,
            text=True,
        )

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for (where, text), result in zip(examples, pool.map(run, examples)):
            if result.returncode:
                print(f"{where}: example does not verify:\n{text}")
                print(result.stderr)
                faults += 1
    print(f"{len(examples)} examples, {faults} faults")
    sys.exit(1 if faults or not examples else 0)


if __name__ == "__main__":
    run_main(main)
