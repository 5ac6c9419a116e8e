# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The fastest setting of a pipeline within an error, by piko-tune."""

from __future__ import annotations

import atexit
import json
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

from ._compile import Program, Source, warn
from ._errors import Error
from ._pipeline import Pipeline, read_number
from ._progress import Progress

# Of piko.compile's options those that piko-tune has, by its names.
_OPTIONS = {
    "define": "-D",
    "include-dir": "-I",
    "without": "--without",
    "cpu": "--cpu",
    "cache-dir": "--cache-dir",
}
# What it says of its options, where tune has such an argument.
_OF_ARGUMENT = re.compile(
    r"piko-tune: error: --(error|metric|budget|space|threads|clock): (.*)"
)
# The exit status of a program some library of which is missing.
_NOT_LOADED = 127


class TuneError(Error):
    """piko-tune is not there, or has failed; `output` is what it wrote."""

    def __init__(self, message: str, output: str = "") -> None:
        super().__init__(message)
        self.output = output


@dataclass(frozen=True, repr=False)
class Tuned:
    """What piko-tune chose. `piko.compile(..., tuned=...)` takes it, and so do the files
    that `save` writes, for pikoc and piko-render, too.

    `report` is what piko-tune says of how it found that, as docs/Tuning.md has it; as a
    text it is its summary, in a few lines.
    """

    pipeline: str
    tunables: Mapping[str, Any]
    directives: Mapping[str, Any]
    without: Sequence[str]
    strip: int
    mappings: str
    measured: Mapping[str, Any]
    report: Mapping[str, Any]
    text: str
    path: str

    def save(self, path: Source) -> None:
        Path(path).write_text(self.text)

    def __str__(self) -> str:
        summary: str = self.report["summary"].rstrip("\n")
        return re.sub(r"--budget (\d+)", r"budget=\1", summary)

    def __repr__(self) -> str:
        ms, text_ms = self.measured["ms"], self.measured["text_ms"]
        return f"<piko.Tuned {self.report['chosen']}: {ms} ms, the text's {text_ms} ms>"

    def __fspath__(self) -> str:
        return self.path


def _find_tool() -> str:
    """A wheel's own, beside the libraries, or on PATH."""
    package = Path(__file__).resolve().parent
    # PREFIX/lib/python3/dist-packages/piko, or BUILD/python/piko
    for up in (package, *package.parents[:4]):
        if (up / "bin" / "piko-tune").exists():
            return str(up / "bin" / "piko-tune")
    found = shutil.which("piko-tune")
    if not found:
        raise TuneError("expected piko-tune, which Piko's tools bring, on PATH")
    return found


def _arguments(program: Program) -> List[str]:
    arguments = []
    for name, value in program._options.settings:
        if name in _OPTIONS:
            word = _OPTIONS[name]
            arguments += [word + value] if len(word) == 2 else [word, value]
        elif (name, value) == ("cache", "off"):
            arguments.append("--no-cache")
        elif (name, value) not in (("target", "cpu"), ("opt-level", "3")):
            if name != "pipe":
                raise ValueError(f"piko-tune takes no program with {name} {value}")
    return arguments


def tune(
    pipe: Pipeline,
    *,
    error: Union[str, float] = 0,
    metric: str = "max",
    budget: int = 500,
    space: Sequence[str] = (),
    threads: Optional[int] = None,
    clock: str = "wall",
    tool: Optional[Source] = None,
) -> Tuned:
    """Looks for the fastest setting of a pipeline, on what is bound to it now, of those
    whose results differ by at most `error` (a number, or "1/255") from what the text
    gives. Runs piko-tune on a capture, which takes as long as its frames: at most
    `budget`. `space` are groups as docs/Tuning.md has them; `metric` is max, mean, rms,
    p99 or flip; `clock` wall or cpu. Warns where the budget is too small to try each
    change of one value. TuneError has what piko-tune wrote.
    """
    if not isinstance(pipe, Pipeline):
        raise TypeError(f"expected a pipeline, but got {type(pipe).__name__}")
    if isinstance(space, str):
        raise TypeError("space: expected a list, but got a string")
    frames = read_number("budget", budget)
    count = pipe.threads if threads is None else read_number("threads", threads)
    program = pipe.program
    command = [os.fspath(tool) if tool is not None else _find_tool()]
    folder = tempfile.mkdtemp(prefix="piko-tune-")
    try:
        source = program._options.source
        if program._options.is_text:
            source = os.path.join(folder, program._options.name)
            Path(source).write_text(program._options.source)
        capture = os.path.join(folder, "input.capture")
        pipe.capture(capture)
        out = os.path.join(folder, "tuned.json")
        command += [source, capture, "--pipe", program.name, "--json", "--out", out]
        command += ["--error", str(error), "--metric", metric]
        command += ["--budget", str(frames), "--clock", clock]
        command += ["--threads", str(count)]
        command += _arguments(program)
        if space:
            command += ["--space", ",".join(map(str, space))]
        with Progress(f"tuning {program.name}"):
            done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            said = done.stderr.strip() or f"piko-tune ended with {done.returncode}"
            wrong = _OF_ARGUMENT.fullmatch(said)
            if wrong:
                raise ValueError(f"{wrong[1]}: {wrong[2]}")
            if done.returncode == _NOT_LOADED:
                said += " (on Debian, packages libmimalloc2.0 and libpng16-16)"
            raise TuneError(said, done.stderr)
        text = Path(out).read_text()
        tuned = _read(text, json.loads(done.stdout.splitlines()[-1]), _keep(text))
        _warn_of_budget(tuned.report, frames)
        return tuned
    except OSError as problem:
        raise TuneError(f"cannot run piko-tune, '{command[0]}': {problem.strerror}") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _warn_of_budget(report: Mapping[str, Any], budget: int) -> None:
    missed = report["missed_changes"]
    if missed:
        warn(
            UserWarning(
                f"the budget of {budget} is too small for {missed} changes of one value;"
                f" budget={report['needed_budget']} is enough"
            )
        )


def _keep(text: str) -> str:
    """A file that lasts as long as the process."""
    handle, path = tempfile.mkstemp(prefix="piko-tuned-", suffix=".json")
    with os.fdopen(handle, "w") as file:
        file.write(text)
    atexit.register(lambda: Path(path).unlink(missing_ok=True))
    return path


def _read(text: str, report: Dict[str, Any], path: str) -> Tuned:
    setting = json.loads(text)
    return Tuned(
        setting["pipeline"],
        setting.get("tunables", {}),
        setting.get("directives", {}),
        setting.get("without", []),
        setting.get("strip", 0),
        setting.get("mappings", ""),
        setting.get("measured", {}),
        report,
        text,
        path,
    )
