# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""host-macros.py MACROS COMPILER FLAG... -- HEADER...

Compiles each header after the macros of a host, and fails if one does not, or if
a macro is another one afterwards."""
import re
import subprocess
import sys
import tempfile
from multiprocessing.pool import ThreadPool

split = sys.argv.index("--")
macros, *command = sys.argv[1:split]
headers = sys.argv[split + 1 :]
names = re.findall(r"#define (\w+)(\(a, b\))?", open(macros).read())


def compile_header(header):
    text = f'#include "{macros}"\n#include "{header}"\n'
    # A macro that is given another meaning is an error with -Werror; the same
    # one is none.
    text += open(macros).read()
    for name, _ in names:
        text += f"#ifndef {name}\n#error {name} is gone\n#endif\n"
    with tempfile.NamedTemporaryFile("w", suffix=".cpp") as file:
        file.write(text)
        file.flush()
        return subprocess.run(
            [*command, "-fsyntax-only", "-Werror", file.name],
            capture_output=True,
            text=True,
        )


failed = False
with ThreadPool(2) as pool:
    for header, done in zip(headers, pool.map(compile_header, headers)):
        if done.returncode:
            failed = True
            print(f"{header}:\n{done.stderr[:2000]}")
        else:
            print(f"{header}: compiles")
sys.exit(failed)
