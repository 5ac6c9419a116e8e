# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""From a pipeline's text to a program."""

from __future__ import annotations

import os
import re
import sys
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Iterable, List, Mapping, Optional, Tuple, Union

from . import _core
from ._errors import CompileError, CompileWarning, Diagnostic, parse_diagnostics
from ._jobs import finish

if TYPE_CHECKING:
    from ._pipeline import Pipeline

Source = Union[str, "os.PathLike[str]"]
Macros = Union[Mapping[str, object], Iterable[str]]

LEVELS = (
    "authored",
    "kernels",
    "machine",
    "target",
    "llvm",
    "llvmir",
    "assembly",
    "gpu",
    "ptx",
)


@dataclass(frozen=True)
class Tunable:
    """A constant that a text leaves open among `values`, of which the first is the
    standard one; declared at `file`, `line` and `column`."""

    name: str
    values: Tuple[str, ...]
    file: str
    line: int
    column: int


@dataclass(frozen=True)
class Object:
    """An object file and the header of its C++ class; `files` were read."""

    pipeline: str
    symbol: str
    code: bytes
    header: str
    files: Tuple[str, ...]


def _text_of(value: object) -> str:
    """A value as the compiler writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)


@dataclass(frozen=True)
class _Options:
    """All that decides what is compiled, as (name, value) of piko_set_option."""

    source: str
    is_text: bool
    name: str
    settings: Tuple[Tuple[str, str], ...]

    def compiler(self, **others: str) -> _core.Compiler:
        """A compiler of it; `others` replace settings, with _ for -."""
        compiler = _core.Compiler()
        if self.is_text:
            status = compiler.set_text(self.name, self.source)
        else:
            status = compiler.set_file(self.source)
        _check_argument(status, compiler)
        replaced = {key.replace("_", "-"): value for key, value in others.items()}
        for key, value in self.settings:
            if key not in replaced:
                _check_argument(compiler.set_option(key, value), compiler)
        for key, value in replaced.items():
            _check_argument(compiler.set_option(key, value), compiler)
        return compiler

    def setting(self, name: str) -> Optional[str]:
        found = [value for key, value in self.settings if key == name]
        return found[-1] if found else None


def _check_argument(status: int, compiler: _core.Compiler) -> None:
    if status:
        said = compiler.diagnostics().removeprefix("error: ").rstrip("\n")
        raise ValueError(_in_python(said))


def _in_python(said: str) -> str:
    """What the compiler says of an option, of the argument of compile's."""
    match = re.match(r"option '([\w-]+)': (?:--\1: )?", said)
    return f"{_parameter(match[1])}: {said[match.end():]}" if match else said


_INVALID_ARGUMENT, _OUT_OF_MEMORY = 1, 3
# What is in texts, and hardly in paths.
_IS_CODE = re.compile(r"[;{}<>#]")


def warn(warning: Warning) -> None:
    """As from the line of the user's that called this package."""
    level, frame = 1, sys._getframe()
    package = os.path.dirname(__file__)
    while frame.f_back and os.path.dirname(frame.f_code.co_filename) == package:
        level, frame = level + 1, frame.f_back
    warnings.warn(warning, stacklevel=level)


def _result(job: _core.Job, what: str) -> Any:
    """What a job gives; what the compiler warns of becomes warnings of Python's."""
    finish(job, what)
    text = job.diagnostics
    if job.status == _INVALID_ARGUMENT:
        raise ValueError(_in_python(text.removeprefix("error: ").rstrip("\n")))
    if job.status == _OUT_OF_MEMORY:
        raise MemoryError("out of memory while compiling")
    if job.status:
        raise CompileError(text)
    for one in parse_diagnostics(text):
        if one.severity == "warning":
            warn(CompileWarning(one.text))
    return job.result()


def _list_of(key: str, values: Iterable[Any]) -> List[Any]:
    if isinstance(values, str):
        raise TypeError(f"{_parameter(key)}: expected a list, but got a string")
    if not isinstance(values, bytes) and isinstance(values, Iterable):
        return list(values)
    kind = type(values).__name__
    raise TypeError(f"{_parameter(key)}: expected a list, but got {kind}")


def _is_unicode(text: str) -> bool:
    """Not of surrogates, which stand for bytes that are no text."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


class _Settings:
    """Options one by one, in the order in which the compiler gets them."""

    def __init__(self) -> None:
        self.found: List[Tuple[str, str]] = []

    def add(self, key: str, value: object) -> None:
        if value is None:
            return
        text = _text_of(value)
        if "\0" in text or not _is_unicode(text):
            raise ValueError(f"{_parameter(key)}: expected a text, but got {text!r}")
        self.found.append((key, text))

    def add_all(self, key: str, values: Iterable[object]) -> None:
        for value in _list_of(key, values):
            self.add(key, value)

    def add_pairs(self, key: str, values: Optional[Mapping[str, object]]) -> None:
        if values is not None and not isinstance(values, Mapping):
            kind = type(values).__name__
            raise TypeError(
                f"{_parameter(key)}: expected a mapping of names, but got {kind}"
            )
        for name, value in (values or {}).items():
            self.add(key, f"{name}={_text_of(value)}")

    def add_reading(self, defines: Macros, include_dirs: Iterable[Source]) -> None:
        """What C++ is read with."""
        if isinstance(defines, Mapping):
            self.add_pairs("define", defines)
        else:
            self.add_all("define", defines)
        folders = _list_of("include-dir", include_dirs)
        self.add_all("include-dir", [os.fspath(folder) for folder in folders])

    def of(self, source: Source, name: Optional[str]) -> _Options:
        text = os.fspath(source) if hasattr(source, "__fspath__") else source
        if not isinstance(text, str):
            kind = type(source).__name__
            raise TypeError(f"expected a path or a text, but got {kind}")
        if not text:
            raise ValueError("expected a path or a text, but got an empty one")
        is_text = isinstance(source, str) and "\n" in source
        if not is_text and "\0" in text:
            raise ValueError(f"expected a path, but got {text!r}")
        if not is_text and _IS_CODE.search(text) and not os.path.exists(text):
            raise ValueError(
                f"expected a path, but got {text!r} (a text needs a line's end)"
            )
        if not _is_unicode(text):
            raise ValueError("expected a text or a path of Unicode, but got surrogates")
        return _Options(text, is_text, name or "pipeline.piko.cpp", tuple(self.found))


class Program:
    """A pipeline that is compiled for this machine; `create` makes what runs.

    It can be pickled: who reads it compiles it anew, through the cache.
    """

    def __init__(self, options: _Options) -> None:
        self._options = options
        compiler = options.compiler()
        what = f"compiling {options.name if options.is_text else options.source}"
        self._core: _core.Program = _result(compiler.load(), what)
        self._tuned_mappings = compiler.tuned_mappings()
        self._tuned_strip_size = compiler.tuned_strip_size()

    @property
    def name(self) -> str:
        """The pipeline's name in C++."""
        return self._core.name

    @property
    def target(self) -> str:
        return self._options.setting("target") or "cpu"

    @property
    def compile_ms(self) -> float:
        """Milliseconds from the text, or the cache, to code in memory."""
        return self._core.load_milliseconds

    @property
    def code_hash(self) -> int:
        """Programs with the same run the same."""
        return self._core.code_hash

    @property
    def names(self) -> List[str]:
        """The pipelines of the file, as they stand there."""
        job = self._options.compiler().list_pipelines()
        names: List[str] = _result(job, "reading pipelines")
        return names

    @property
    def tunables(self) -> List[Tunable]:
        """What the text leaves open, with all values."""
        job = self._options.compiler().list_tunables()
        found = _result(job, "reading tunables")
        return [Tunable(one[0], tuple(one[1]), *one[2:]) for one in found]

    def explain(self) -> str:
        """What the compiler made of the pipeline, and why not more."""
        text: str = _result(self._options.compiler().emit("report"), "explaining")
        return text

    def emit(self, level: str) -> str:
        """The pipeline as text at a level: one of piko.LEVELS."""
        if level not in LEVELS:
            raise ValueError(
                f"there is no level '{level}'; expected one of {', '.join(LEVELS)}"
            )
        text: str = _result(self._options.compiler().emit(level), f"writing {level}")
        return text

    def compile_object(
        self, *, cpu: Optional[str] = None, namespace: str = "pipelines"
    ) -> Object:
        """An object to link, as pikoc makes it, with its header; by default for the
        least processor that Piko supports."""
        others = {"cpu": cpu or "", "namespace": namespace}
        job = self._options.compiler(**others).compile()
        pipeline, symbol, code, header, files = _result(job, "compiling an object")
        return Object(pipeline, symbol, code, header, tuple(files))

    def with_target(self, target: str) -> Program:
        """The same for another target."""
        kept = tuple(one for one in self._options.settings if one[0] != "target")
        settings = (*kept, ("target", target))
        options = self._options
        return Program(
            _Options(options.source, options.is_text, options.name, settings)
        )

    def create(
        self,
        domain: Optional[Iterable[int]] = None,
        *,
        threads: Optional[int] = None,
        device: Optional[int] = None,
        **state: Any,
    ) -> Pipeline:
        """Makes a pipeline. `domain` is its extent in cells, x first; `threads` as in
        Pipeline.threads; `device` the number of a CUDA device, or -2 for the
        processor; further arguments are state by name, as pipe[name] = value."""
        from ._pipeline import Pipeline

        return Pipeline(self, domain=domain, threads=threads, device=device, **state)

    def __repr__(self) -> str:
        return f"<piko.Program {self.name} for {self.target}>"

    def __reduce__(self) -> Tuple[Any, ...]:
        return Program, (self._options,)


def compile(
    source: Source,
    pipe: Optional[str] = None,
    *,
    target: str = "cpu",
    tunables: Optional[Mapping[str, object]] = None,
    tuned: Optional[Source] = None,
    fix: Optional[Mapping[str, object]] = None,
    defines: Macros = (),
    include_dirs: Iterable[Source] = (),
    cpu: Optional[str] = "native",
    opt_level: int = 3,
    check: Union[bool, Iterable[str]] = False,
    without: Iterable[str] = (),
    directives: Iterable[str] = (),
    gpu_threads: int = 0,
    gpu_chip: Optional[str] = None,
    cache: bool = True,
    cache_dir: Optional[Source] = None,
    name: Optional[str] = None,
) -> Program:
    """Compiles a pipeline, or finds its code in the cache.

    `source` is a path, to C++, `.mlir` or a `.so` of pikoc's objects, or a text: a
    string with a line's end, which `name` names in messages. `pipe` is the pipeline
    where the file has several. `target` is cpu, reference, gpu-on-cpu, cuda or auto.

    `tunables` has values for what the text leaves open; `tuned` a file of piko-tune's;
    `fix` constants, and sizes of buffers as NAME.size, that the code takes for granted;
    `defines` macros, as a mapping or a list of NAME=VALUE. `check` looks for broken
    rules while it runs, or is a list of RECORD.FIELD that must not be NaN. `without`
    are passes to leave out, `directives` STAGE:KEY=VALUE.

    Raises CompileError, with the user's file and line, and ValueError where an option
    is wrong. Warnings of the compiler are CompileWarnings. Ctrl-C raises
    KeyboardInterrupt at once; the compiler then ends in the background.
    """
    return Program(_read_options(**locals()))


# The options of compile, as the compiler names them.
_SETTINGS = {
    "tunables": "tunable",
    "defines": "define",
    "include_dirs": "include-dir",
    "opt_level": "opt-level",
    "directives": "directive",
    "gpu_threads": "gpu-threads",
    "gpu_chip": "gpu-chip",
    "cache_dir": "cache-dir",
}


def _read_options(
    source: Source,
    pipe: Optional[str] = None,
    *,
    target: str = "cpu",
    tunables: Optional[Mapping[str, object]] = None,
    tuned: Optional[Source] = None,
    fix: Optional[Mapping[str, object]] = None,
    defines: Macros = (),
    include_dirs: Iterable[Source] = (),
    cpu: Optional[str] = "native",
    opt_level: int = 3,
    check: Union[bool, Iterable[str]] = False,
    without: Iterable[str] = (),
    directives: Iterable[str] = (),
    gpu_threads: int = 0,
    gpu_chip: Optional[str] = None,
    cache: bool = True,
    cache_dir: Optional[Source] = None,
    name: Optional[str] = None,
) -> _Options:
    """The arguments of compile, checked, as the compiler takes them."""
    settings = _Settings()
    settings.add("pipe", pipe)
    settings.add("target", target)
    settings.add_pairs("tunable", tunables)
    settings.add("tuned", None if tuned is None else os.fspath(tuned))
    settings.add_pairs("fix", fix)
    settings.add_reading(defines, include_dirs)
    settings.add("cpu", cpu)
    settings.add("opt-level", opt_level)
    if check is True:
        settings.add("check", "on")
    elif check:
        settings.add("check", "nan:" + ",".join(_list_of("check", check)))
    if without:
        settings.add("without", ",".join(_list_of("without", without)))
    settings.add_all("directive", directives)
    settings.add("gpu-threads", gpu_threads or None)
    settings.add("gpu-chip", gpu_chip)
    settings.add("cache", None if cache else "off")
    settings.add("cache-dir", None if cache_dir is None else os.fspath(cache_dir))
    return settings.of(source, name)


def _parameter(key: str) -> str:
    """The argument of compile that a setting is of."""
    names = [name for name, setting in _SETTINGS.items() if setting == key]
    return names[0] if names else key


def change_options(options: _Options, changed: Mapping[str, Any]) -> _Options:
    """The same with some arguments of compile in the place of what they said."""
    read = _read_options(options.source, **changed)
    keys = {_SETTINGS.get(one, one) for one in changed}
    kept = [one for one in options.settings if one[0] not in keys]
    kept += [one for one in read.settings if one[0] in keys]
    return _Options(options.source, options.is_text, options.name, tuple(kept))


def pipelines(
    source: Source,
    *,
    defines: Macros = (),
    include_dirs: Iterable[Source] = (),
    name: Optional[str] = None,
) -> List[str]:
    """The names of a file's pipelines, none of which is compiled."""
    settings = _Settings()
    settings.add_reading(defines, include_dirs)
    job = settings.of(source, name).compiler().list_pipelines()
    found: List[str] = _result(job, "reading pipelines")
    return found
