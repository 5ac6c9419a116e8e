# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What goes wrong, and what the compiler has to say."""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Iterable, List, Optional, Tuple

_LINE = re.compile(
    r"(?:(?P<file>[^\n]+?):(?P<line>\d+):(?P<column>\d+): )?"
    r"(?P<severity>error|warning|note|remark): (?P<message>.*)"
)


@dataclass(frozen=True)
class Diagnostic:
    """One message of the compiler.

    `file` is None and `line` and `column` are 0 where there is no place; they count
    from 1. `text` is the whole of it, with the line of the user's file below.
    """

    severity: str
    message: str
    file: Optional[str]
    line: int
    column: int
    text: str

    def __str__(self) -> str:
        return self.text


def parse_diagnostics(text: str) -> List[Diagnostic]:
    """The messages in what the compiler has written."""
    found: List[Diagnostic] = []
    for line in text.splitlines():
        match = _LINE.fullmatch(line)
        if match:
            found.append(
                Diagnostic(
                    match["severity"],
                    match["message"],
                    match["file"],
                    int(match["line"] or 0),
                    int(match["column"] or 0),
                    line,
                )
            )
        elif found:
            last = found.pop()
            fields = dict(last.__dict__, text=f"{last.text}\n{line}")
            found.append(Diagnostic(**fields))
    return found


class Status(enum.IntEnum):
    """Why a call of the runtime failed; see pikort.h."""

    OK = 0
    INVALID_ARGUMENT = 1
    NOT_FOUND = 2
    SIZE_MISMATCH = 3
    UNBOUND = 4
    OUT_OF_MEMORY = 5
    TOO_MANY = 6
    BAD_PROGRAM = 7
    VERSION = 8
    WRONG_PROCESSOR = 9
    NO_DEVICE = 10
    DEVICE_FAILED = 11
    REPEATED = 12
    NOT_WRITTEN = 13
    INTERRUPTED = 14
    BIN_OUTSIDE = 16
    UPDATE_OUTSIDE = 17
    INDEX_OUTSIDE = 18
    ENDLESS = 19
    NOT_A_NUMBER = 20
    NOT_UNIFORM = 21
    RULE_BROKEN = 22
    NO_QUOTIENT = 23


class Error(Exception):
    """The base of what this module raises of its own."""


class CompileError(Error):
    """A pipeline's text, or what is asked of it, is wrong.

    `text` is what the compiler wrote, `diagnostics` its messages one by one; `file`,
    `line` and `column` are those of the first error.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text.rstrip("\n"))
        self.text = text
        self.diagnostics = parse_diagnostics(text)
        errors = [one for one in self.diagnostics if one.severity == "error"]
        first = errors[0] if errors else None
        self.file = first.file if first else None
        self.line = first.line if first else 0
        self.column = first.column if first else 0


class RunError(Error):
    """A pipeline could not be made, set up or run.

    `status` is a Status; `message` names the stage and, where there is one, the bin.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = Status(status)
        self.message = message

    def __reduce__(self) -> Tuple[Any, ...]:
        return RunError, (int(self.status), self.message)


def say_unknown(name: str, names: Iterable[str]) -> str:
    """Of an attribute that pipelines do not have, where they have those names."""
    public = sorted({one for one in names if not one.startswith("_")})
    near = get_close_matches(name, public)
    text = f"a pipeline has no attribute '{name}'"
    return f"{text}; near it are {', '.join(near)}" if near else text


class CompileWarning(UserWarning):
    """What the compiler warns of in a pipeline's text."""
