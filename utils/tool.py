# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""How scripts end: what is wrong is said as Piko's tools say it, "NAME: error: ...",
with a status that is not 0."""

import os
import shlex
import subprocess
import sys


def describe(error):
    """What went wrong with a file, or with a program that was called."""
    if isinstance(error, subprocess.CalledProcessError):
        words = error.cmd if isinstance(error.cmd, list) else [error.cmd]
        command = shlex.join(str(word) for word in words)
        said = (error.stderr or b"").strip()
        said = said if isinstance(said, str) else said.decode(errors="replace")
        return f"'{command}' ended with {error.returncode}" + (f":\n{said}" if said else "")
    if error.filename is None:
        return str(error.strerror or error)
    return f"'{os.fspath(error.filename)}': {error.strerror}"


def run_main(main):
    """Calls a program's main, and ends with what it returns."""
    name = os.path.basename(sys.argv[0])
    try:
        sys.exit(main())
    except SystemExit as end:
        if not isinstance(end.code, str):
            raise
        said = end.code
        for prefix in (f"{name}: error: ", f"{name}: ", f"{os.path.splitext(name)[0]}: "):
            said = said.removeprefix(prefix)
    except (OSError, subprocess.CalledProcessError) as error:
        said = describe(error)
    sys.exit(f"{name}: error: {said.strip()}")
