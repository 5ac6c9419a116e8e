# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs the cells of a notebook in their order, without Jupyter, which would take 37
packages: run_notebook.py FILE. Prints what they print, and of each cell's last
expression what Jupyter would show."""

import ast
import json
import sys


def show(value):
    if hasattr(value, "_repr_png_"):
        data = value._repr_png_()
        print(f"<picture of {len(data)} bytes, {data[:8]!r}>")
    elif value is not None:
        print(repr(value))


def run_cell(number, text, names):
    """Raises what the cell raises, with its number in the place of a file."""
    tree = ast.parse(text, f"cell {number}")
    last = tree.body[-1] if tree.body else None
    if isinstance(last, ast.Expr):
        tree.body.pop()
    exec(compile(tree, f"cell {number}", "exec"), names)
    if isinstance(last, ast.Expr):
        value = compile(ast.Expression(last.value), f"cell {number}", "eval")
        show(eval(value, names))


def main():
    with open(sys.argv[1]) as file:
        cells = json.load(file)["cells"]
    names = {"__name__": "__main__"}
    for number, cell in enumerate(cells, 1):
        assert not cell.get("outputs"), f"cell {number}: expected no outputs in the file"
        if cell["cell_type"] == "code":
            run_cell(number, "".join(cell["source"]), names)


if __name__ == "__main__":
    main()
