#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Measures how many instructions of the machine ptxas makes of one of PTX.

Two kernels have an instruction 16 and 48 times, each time on what the one before it
gave; by how much their code differs in size says what one of them is. Code that
instructions share, such as that for rare operands, is left out by it, and so are the
functions that divide 64-bit integers: of these there are the calls alone. Prints
Markdown; model.SLOTS has what it printed for sm_80.
"""

import argparse
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

# What is measured, by the count that it belongs to.
CASES = {
    "integer": "add.s32 %r2, %r2, %r3; xor.b32 %r2, %r2, %r3;",
    "integer64": "add.s64 %rd3, %rd3, %rd4; xor.b64 %rd3, %rd3, %rd4;",
    "float32": "add.rn.f32 %f1, %f1, %f2;",
    "float64": "add.rn.f64 %fd1, %fd1, %fd2;",
    "special": "ex2.approx.f32 %f1, %f1;",
    "integerDivision": "div.u32 %r2, %r3, %r2;",
    "float32Division": "div.rn.f32 %f1, %f2, %f1;",
    "float64Division": "div.rn.f64 %fd1, %fd2, %fd1;",
    "convert": "cvt.rzi.s32.f32 %r2, %f1; cvt.rn.f32.s32 %f1, %r2;",
}
PER_CASE = {"convert": 2, "integer": 2, "integer64": 2}
FEW, MANY = 16, 48
BYTES = 16  # of an instruction, from sm_70 on
KERNEL = """.version 7.8
.target {target}
.address_size 64
.visible .entry k(.param .u64 a) {{
  .reg .b64 %rd<9>; .reg .b32 %r<9>; .reg .f32 %f<9>; .reg .f64 %fd<9>;
  ld.param.u64 %rd1, [a];
  ld.global.f32 %f1, [%rd1]; ld.global.f32 %f2, [%rd1+8];
  ld.global.f64 %fd1, [%rd1+16]; ld.global.f64 %fd2, [%rd1+24];
  ld.global.u32 %r2, [%rd1+32]; ld.global.u32 %r3, [%rd1+40];
  ld.global.u64 %rd3, [%rd1+48]; ld.global.u64 %rd4, [%rd1+56];
  {body}
  st.global.f32 [%rd1], %f1; st.global.f64 [%rd1+16], %fd1;
  st.global.u32 [%rd1+32], %r2; st.global.u64 [%rd1+48], %rd3;
  ret;
}}
"""


def find_assembler():
    """ptxas as pikoc finds it, or None."""
    folders = [os.environ.get("PATH", ""),
               os.path.join(os.environ.get("CUDA_HOME", ""), "bin"),
               "/usr/local/cuda/bin"]
    return shutil.which("ptxas", path=os.pathsep.join(folders))


def measure_code(image):
    """Bytes of the sections of an ELF file with 64 bits whose names begin with
    .text."""
    table, = struct.unpack_from("<Q", image, 40)
    size, count, names = struct.unpack_from("<HHH", image, 58)

    def read(index):  # name, offset, bytes
        fields = struct.unpack_from("<IIQQQQ", image, table + index * size)
        return fields[0], fields[4], fields[5]

    _, start, _ = read(names)
    return sum(bytes for name, _, bytes in map(read, range(count))
               if image[start + name:].startswith(b".text"))


def assemble(assembler, chip, body, folder):
    source, target = pathlib.Path(folder, "k.ptx"), pathlib.Path(folder, "k.cubin")
    source.write_text(KERNEL.format(target="sm_75", body=body))
    done = subprocess.run([assembler, f"-arch={chip}", "-o", target, source],
                          capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{assembler}: {done.stderr.strip()}")
    return measure_code(target.read_bytes())


def measure(assembler, chip):
    """Instructions by count."""
    with tempfile.TemporaryDirectory() as folder:
        return {name: (assemble(assembler, chip, MANY * body, folder) -
                       assemble(assembler, chip, FEW * body, folder))
                / (MANY - FEW) / BYTES / PER_CASE.get(name, 1)
                for name, body in CASES.items()}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("chips", nargs="*", default=["sm_80"], metavar="CHIP")
    options = parser.parse_args()
    assembler = find_assembler()
    if not assembler:
        sys.exit("slots: no ptxas was found")
    slots = {chip: measure(assembler, chip) for chip in options.chips}
    print(f"| instruction | {' | '.join(slots)} |\n|---{'|---' * len(slots)}|")
    for name in CASES:
        print(f"| {name} | {' | '.join(f'{s[name]:.1f}' for s in slots.values())} |")


if __name__ == "__main__":
    main()
