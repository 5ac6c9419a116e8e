#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compiles and runs the C++ examples of a Markdown file.

A fence that opens with ```cpp is an example. One that holds `#include` is a
program of its own. Any other continues the program of its section: all such
fences under one `##` heading form one file, in order, after
`#include <piko.h>`. Where the file has no `main`, one that does nothing is
added, so that the examples are compiled and linked.

A comment `// error: TEXT` on a line of a fence says that the example must be
refused by the compiler with a message that holds TEXT.

All begin with piko.h, which Clang reads once for them.
"""
import argparse
import pathlib
import re
import subprocess
import sys


def examples(text):
    """Yields (line, C++ text) of each program in the Markdown text."""
    section, section_line, body, start = [], 0, None, 0
    for number, line in enumerate(text.splitlines() + ["## end"], 1):
        if body is not None:
            if line.startswith("```"):
                code = "\n".join(body) + "\n"
                where = f'#line {start + 1} "Language.md"\n'
                if "#include" in code:
                    yield start, where + code
                else:
                    section_line = section_line or start
                    section.append(where + code)
                body = None
            else:
                body.append(line)
        elif line.startswith("```cpp"):
            body, start = [], number
        elif line.startswith("## ") and section:
            yield section_line, "#include <piko.h>\n" + "".join(section)
            section, section_line = [], 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--include", required=True)
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--compiler", required=True)
    parser.add_argument("document", type=pathlib.Path)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)

    flags = [args.compiler, "-std=c++20", "-Wall", f"-I{args.include}"]
    header = args.work / "piko.pch"
    subprocess.run([*flags, "-fpch-instantiate-templates", "-x", "c++-header",
                    f"{args.include}/piko.h", "-o", str(header)], check=True)
    flags += ["-include-pch", str(header)]

    failures = count = 0
    for line, code in examples(args.document.read_text()):
        count += 1
        expected = re.search(r"// error: (.*)", code)
        if " main(" not in code:
            code += "int main() {}\n"
        source = args.work / f"example{line}.cpp"
        source.write_text(code)
        program = source.with_suffix("")
        build = subprocess.run(
            [*flags, str(source), "-o", str(program)],
            text=True, capture_output=True)
        if expected:
            if build.returncode == 0 or expected[1] not in build.stderr:
                print(f"line {line}: expected the error '{expected[1]}', "
                      f"but got\n{build.stderr}")
                failures += 1
            continue
        if build.returncode == 0:
            build = subprocess.run([program], text=True, capture_output=True)
        if build.returncode != 0:
            print(f"line {line}:\n{build.stdout}{build.stderr}")
            failures += 1
    print(f"{count} programs, {failures} failures")
    sys.exit(failures != 0 or count == 0)


if __name__ == "__main__":
    main()
