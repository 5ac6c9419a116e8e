#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compares what libpikort promises with runtime/test/abi/abi.txt.

That list has the version of the ABI, each function with its type, each struct with its
size and the places of its members, and each value of an enumeration, as the headers for
hosts and for generated code declare them. The library must export these functions and
nothing else.

With the version that the list is of, nothing in it may change or go. What is new is
listed by --write, and so is everything once PIKORT_ABI_VERSION has another number.
"""

import argparse
import difflib
import json
import pathlib
import re
import subprocess
import sys

LIST = pathlib.Path(__file__).with_name("abi.txt")
HEADERS = ["pikort.h", "abi.h", "abi_setup.h", "grid.h", "emission.h", "ranks.h",
           "abi_ranks.h"]
MEMBER = re.compile(r"^ +(\d+) \|   (\S.*) (\w+)$")


def call(words, **options):
    return subprocess.run(
        [str(word) for word in words], check=True, stdout=subprocess.PIPE, text=True, **options
    ).stdout


def compile_headers(arguments, *flags):
    text = "".join(f"#include <pikort/{header}>\n" for header in HEADERS)
    # As runtime/inline/Emission.cpp has them.
    command = [arguments.clang, "-x", "c++", "-std=c++20", "-DPIKORT_INLINE=PIKORT_API"]
    command += ["-fsyntax-only", "-I", arguments.include]
    return call([*command, *flags, "-"], input=text)


def value_of(constant):
    """Of an enumerator, as its initializer says."""
    while "value" not in constant:
        constant = constant["inner"][0]
    return constant["value"]


def read_declarations(arguments):
    """Lines of functions by their names, and those of values."""
    functions, values = {}, []

    def visit(node):
        kind, name = node.get("kind"), node.get("name", "")
        if kind == "EnumDecl":
            for constant in node.get("inner", []):
                if constant["kind"] == "EnumConstantDecl" and constant["name"].startswith("PIKO"):
                    values.append(f"value {constant['name']} = {value_of(constant)}")
        elif kind == "FunctionDecl" and name.startswith("piko"):
            functions[name] = f"function {name}: {node['type']['qualType']}"
        elif kind in ("TranslationUnitDecl", "LinkageSpecDecl"):
            for child in node.get("inner", []):
                visit(child)

    visit(json.loads(compile_headers(arguments, "-Xclang", "-ast-dump=json")))
    return functions, values


def read_structs(arguments):
    layouts = compile_headers(arguments, "-Xclang", "-fdump-record-layouts-complete")
    for layout in layouts.split("*** Dumping AST Record Layout")[1:]:
        name = re.search(r"\| struct (piko(?:rt|ir)_\w+)$", layout, re.M)
        size = re.search(r"\[sizeof=(\d+)", layout)
        if not name:
            continue
        yield f"struct {name[1]}: {size[1]} bytes"
        for line in layout.splitlines():
            if member := MEMBER.match(line):
                yield f"  {member[1]} {name[1]}.{member[3]}: {member[2]}"


def read_exports(arguments):
    text = call([arguments.nm, "-D", "--defined-only", arguments.library])
    for line in text.splitlines():
        kind, symbol = line.split()[-2:]
        if kind != "A":  # a version's name
            yield symbol


def find_version(arguments):
    text = (arguments.include / "pikort" / "pikort.h").read_text()
    return int(re.search(r"^#define PIKORT_ABI_VERSION (\d+)u$", text, re.M)[1])


def describe(arguments, version):
    functions, values = read_declarations(arguments)
    exports = {symbol.split("@")[0]: symbol for symbol in read_exports(arguments)}
    faults = [f"'{name}' is exported and not declared" for name in exports.keys() - functions]
    faults += [f"'{name}' is declared and not exported" for name in functions.keys() - exports]
    faults += [
        f"'{symbol}': expected the version PIKORT_{version}"
        for symbol in exports.values()
        if not symbol.endswith(f"@@PIKORT_{version}")
    ]
    if faults:
        sys.exit("\n".join(f"abi.py: {arguments.library}: {it}" for it in sorted(faults)))
    lines = [f"version {version}", *sorted(functions.values()), *sorted(values)]
    return [*lines, *read_structs(arguments)]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--library", required=True, type=pathlib.Path, help="libpikort.so")
    parser.add_argument("--include", required=True, type=pathlib.Path, help="where pikort/ is")
    parser.add_argument("--clang", default="clang++-22", help="(clang++-22)")
    parser.add_argument("--nm", default="llvm-nm-22", help="(llvm-nm-22)")
    parser.add_argument("--list", default=LIST, type=pathlib.Path, help=f"({LIST.name})")
    parser.add_argument("--write", action="store_true", help="write the list")
    arguments = parser.parse_args()

    version = find_version(arguments)
    lines = describe(arguments, version)
    listed = arguments.list.read_text().splitlines() if arguments.list.exists() else []
    difference = [
        it for it in difflib.unified_diff(listed, lines, "listed", "found", n=1, lineterm="")
    ]
    gone = [it[1:] for it in difference[2:] if it.startswith("-")]
    if gone and f"version {version}" in listed:
        print("\n".join(difference))
        sys.exit(
            f"abi.py: what version {version} of the ABI promises has changed: set "
            f"PIKORT_ABI_VERSION in pikort.h to {version + 1}, and run this with --write"
        )
    if arguments.write:
        arguments.list.write_text("\n".join(lines) + "\n")
    elif difference:
        print("\n".join(difference))
        sys.exit(f"abi.py: expected what {arguments.list.name} says: run this with --write")


if __name__ == "__main__":
    main()
