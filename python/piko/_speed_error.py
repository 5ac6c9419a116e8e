# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Speed against error: what variants of a pipeline cost, and how far off they are."""

from __future__ import annotations

import csv
import importlib
import os
import statistics
import time
from dataclasses import dataclass, fields, replace
from typing import (
    Any,
    Callable,
    Dict,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
    TypeVar,
    Union,
)

import numpy as np

from . import _core
from ._compare import bind_copy, has_memory
from ._compile import Program, Source, change_options, compile
from ._errors import Error
from ._pipeline import Array, Pipeline
from ._progress import Progress

Setup = Callable[[Pipeline], None]
Picture = Union[str, Callable[[Pipeline], Any]]
Variant = Mapping[str, Any]
_T = TypeVar("_T")

# The words of piko.tune and piko-tune, and those of piko-diff.
_METRICS = {"max": "largest"}
_METRICS.update({name: name for name in ("largest", "mean", "rms", "p99", "flip")})
_WARMUP = 2
_OWN = "the text as it is, on the reference executor"


class VariantError(Error):
    """A variant of speed_error could not be compiled, set up, run or compared; `variant`
    is its name, and `__cause__` what went wrong."""

    def __init__(self, variant: str, message: str) -> None:
        super().__init__(f"variant '{variant}': {message}")
        self.variant = variant
        self.message = message

    def __reduce__(self) -> Tuple[Any, ...]:
        return VariantError, (self.variant, self.message)


@dataclass(frozen=True)
class Errors:
    """How far a result is from the reference.

    Of pictures as piko-diff has it: `largest`, `mean` and `rms` are absolute differences
    of r, g and b as a display shows them, black to white being 1; 99 % of the pixels
    differ by at most `p99`; `psnr` is in dB, infinite for equal pictures; `flip` is the
    mean of FLIP, 0 to 1.

    Of other results as piko-tune has it: differences of all numbers, each over the
    largest magnitude of its field; `psnr` and `flip` are None.
    """

    largest: float
    mean: float
    rms: float
    p99: float
    psnr: Optional[float] = None
    flip: Optional[float] = None


@dataclass(frozen=True)
class SpeedErrorPoint:
    """A variant: `ms` are milliseconds of a run, the median of `times`, which are the
    rounds' medians; `front` says whether it is on the Pareto front."""

    variant: str
    ms: float
    times: Tuple[float, ...]
    errors: Errors
    front: bool = False


def pareto_front(ms: Sequence[float], errors: Sequence[float]) -> List[bool]:
    """Of each point whether no other one is at least as fast and as near, and in one of
    both better."""
    points = list(zip(ms, errors))
    if len(points) != len(ms) or len(points) != len(errors):
        raise ValueError(f"expected {len(ms)} errors, but got {len(errors)}")
    return [
        not any(t <= own_t and e <= own_e and (t, e) != (own_t, own_e) for t, e in points)
        for own_t, own_e in points
    ]


@dataclass(frozen=True)
class SpeedError:
    """What speed_error has measured: a point for each variant, in their order.

    `metric` is the field of Errors that the Pareto front and the chart are of, and
    `reference` what errors are from.
    """

    pipeline: str
    metric: str
    reference: str
    points: Tuple[SpeedErrorPoint, ...]

    def __getitem__(self, variant: str) -> SpeedErrorPoint:
        for point in self.points:
            if point.variant == variant:
                return point
        known = ", ".join(one.variant for one in self.points)
        raise KeyError(f"there is no variant '{variant}'; there are {known}")

    def error(self, point: SpeedErrorPoint) -> float:
        """Of a point, by `metric`."""
        return float(getattr(point.errors, self.metric))

    @property
    def front(self) -> List[SpeedErrorPoint]:
        """The Pareto front, the fastest first."""
        return sorted((one for one in self.points if one.front), key=lambda one: one.ms)

    def to_array(self) -> Array:
        """A structured array with a record for each point; what is None is NaN."""
        width = max(len(one.variant) for one in self.points)
        columns = [("variant", f"U{width}"), ("ms", "f8"), ("least_ms", "f8")]
        columns += [("most_ms", "f8"), *((one.name, "f8") for one in fields(Errors))]
        array: Array = np.zeros(len(self.points), [*columns, ("front", "?")])
        for record, point in zip(array, self.points):
            record["variant"], record["front"] = point.variant, point.front
            record["ms"] = point.ms
            record["least_ms"], record["most_ms"] = min(point.times), max(point.times)
            for name, value in vars(point.errors).items():
                record[name] = np.nan if value is None else value
        return array

    def write_csv(self, path: Source) -> None:
        """A line of names, then one for each point: times in milliseconds, errors as in
        Errors, 1 for those on the Pareto front."""
        with open(path, "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            names = [one.name for one in fields(Errors)]
            writer.writerow(["variant", "ms", "least ms", "most ms", *names, "front"])
            for one in self.points:
                found = [getattr(one.errors, name) for name in names]
                writer.writerow(
                    [one.variant]
                    + [f"{t:.6g}" for t in (one.ms, min(one.times), max(one.times))]
                    + ["" if value is None else f"{value:.6g}" for value in found]
                    + [int(one.front)]
                )

    def draw(self, path: Optional[Source] = None) -> Any:
        """A chart of milliseconds against error, both logarithmic, with a line along the
        Pareto front; bars go from the fastest round to the slowest. Returns the figure
        of matplotlib's, which need not be installed otherwise, and writes it to `path`
        in the format that its extension says."""
        figure = _import_figure()(figsize=(7, 4.8), layout="constrained")
        axes = figure.add_subplot()
        errors = [self.error(one) for one in self.points]
        # A logarithmic axis has no 0.
        zero = min((one for one in errors if one > 0), default=1.0) / 10
        place = {one.variant: self.error(one) or zero for one in self.points}
        front = self.front
        axes.plot([place[one.variant] for one in front], [one.ms for one in front], "C0-")
        for one in self.points:
            bars = [[one.ms - min(one.times)], [max(one.times) - one.ms]]
            face = "C0" if one.front else "white"
            at = place[one.variant], one.ms
            axes.errorbar(*at, bars, fmt="C0o", markerfacecolor=face)
            axes.annotate(one.variant, at, (6, 5), textcoords="offset points")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("{x:g}")
        none = f"; at {zero:.1e}: none" if 0 in errors else ""
        axes.set_xlabel(f"{self.metric} error against {self.reference}{none}")
        axes.set_ylabel("milliseconds a run")
        axes.set_title(self.pipeline)
        axes.grid(which="both", color="#eeeeee")
        axes.set_axisbelow(True)
        if path is not None:
            figure.savefig(os.fspath(path))
        return figure


def _import_figure() -> Any:
    # Its numerics may bind this thread to a core, by OMP_PROC_BIND.
    cores = os.sched_getaffinity(0)
    try:
        return importlib.import_module("matplotlib.figure").Figure
    except ImportError as error:
        raise ImportError(
            f"expected matplotlib to draw with ({error}); on Debian it is in the package"
            " python3-matplotlib, and write_csv needs none"
        ) from error
    finally:
        os.sched_setaffinity(0, cores)


# --- Results -----------------------------------------------------------------

_COLORS = ("piko::scene::Color", "piko::scene::Color8")


def _find_picture(pipe: Pipeline) -> Optional[str]:
    """The image of colours that tools take for the result, if there is one."""
    records = pipe._core.records()
    found = [
        name
        for name, kind, record, *_ in pipe._core.states()
        if pipe.state[name] == "image" and records[record][0] in _COLORS
    ]
    return f"{found[0]}.rgba" if len(found) == 1 else None


def _as_picture(array: Any) -> Array:
    """r, g, b and alpha as floats; 8 bits are taken as an image file has them."""
    picture = np.asarray(array)
    if picture.ndim == 2 and picture.dtype.kind in "ui" and picture.dtype.itemsize == 4:
        picture = np.ascontiguousarray(picture).view("u1").reshape(*picture.shape, 4)
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=2)
    if picture.ndim != 3 or picture.shape[2] not in (3, 4) or not picture.size:
        raise ValueError(
            "expected a picture of shape (height, width), (height, width, 3) or"
            f" (height, width, 4), but got {picture.shape}"
        )
    if picture.dtype.kind in "ui" and picture.dtype.itemsize == 1:
        picture = picture.view("u1") / np.float32(255)
    if picture.dtype.kind != "f":
        raise ValueError(
            f"expected a picture of floats or of 8 bits, but got {picture.dtype}"
        )
    full = np.ones((*picture.shape[:2], 4), "f4")
    full[..., : picture.shape[2]] = picture
    return full


def _read_picture(pipe: Pipeline, picture: Picture) -> Array:
    if not isinstance(picture, str):
        return _as_picture(picture(pipe))
    name, *keys = picture.split(".")
    array = pipe.read(name)
    for key in keys:
        if key not in (array.dtype.names or ()):
            known = ", ".join(array.dtype.names or ()) or "none"
            raise KeyError(f"'{picture}': there is no field '{key}'; there are {known}")
        array = array[key]
    return _as_picture(array)


class _Result:
    """What a run has left: a picture, or all numbers of buffers and images."""

    def __init__(self, pipe: Pipeline, picture: Optional[Picture]) -> None:
        found = picture if picture is not None else _find_picture(pipe)
        self.picture = None if found is None else _read_picture(pipe, found)
        self.numbers = _core.Numbers()
        if self.picture is not None:
            return
        records = pipe._core.records()
        for name, _, record, *_ in pipe._core.states():
            if pipe.state[name] != "constant" and has_memory(pipe, name):
                _, size, _, layout = records[record]
                self.numbers.add(name, pipe.read(name).tobytes(), size, layout)

    def measure(self, actual: _Result) -> Errors:
        if self.picture is None or actual.picture is None:
            return Errors(*self.numbers.measure(actual.numbers))
        height, width = self.picture.shape[:2]
        if self.picture.shape != actual.picture.shape:
            got = actual.picture.shape
            raise ValueError(
                f"expected a picture of {width} x {height} pixels, as the reference's"
                f" is, but got {got[1]} x {got[0]}"
            )
        places = self.picture.ctypes.data, actual.picture.ctypes.data
        return Errors(*_core.measure_pictures(width, height, *places))


# --- Measuring ---------------------------------------------------------------


class _Maker:
    """Pipelines of variants, with what they take."""

    def __init__(
        self,
        base: Union[Pipeline, Source],
        setup: Optional[Setup],
        common: Mapping[str, Any],
    ) -> None:
        self.base, self.setup, self.common = base, setup, common

    def make(self, variant: Variant) -> Pipeline:
        if isinstance(self.base, Pipeline):
            pipe = self._make_alike(self.base, {**self.common, **variant})
        else:
            pipe = Pipeline(self.base, **{**self.common, **variant})
        if self.setup is not None:
            self.setup(pipe)
        return pipe

    @staticmethod
    def _make_alike(base: Pipeline, given: Mapping[str, Any]) -> Pipeline:
        own = {**given}
        options = {key: own.pop(key) for key in given if key in compile.__annotations__}
        domain, threads = own.pop("domain", None), own.pop("threads", base.threads)
        made = Program(change_options(base.program._options, options))
        pipe = made.create(threads=threads)
        bind_copy(base, pipe)
        if domain is not None:
            pipe.domain = domain
        for name, value in own.items():
            pipe[name] = value
        return pipe


def _time_runs(pipe: Pipeline, frames: int, seconds: float) -> float:
    """The median of so many runs, at most, or of so many seconds, in milliseconds."""
    for _ in range(_WARMUP):
        pipe.run()
    times: List[float] = []
    begin = time.perf_counter()
    while len(times) < frames and (
        not times or time.perf_counter() - begin < seconds
    ):
        start = time.perf_counter()
        pipe.run()
        times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times)


def _check_arguments(
    pipe: object, variants: object, reference: object, metric: str, counts: Variant
) -> None:
    if not isinstance(pipe, (Pipeline, str, os.PathLike)):
        kind = type(pipe).__name__
        raise TypeError(f"expected a pipeline, a path or a text, but got {kind}")
    if not isinstance(variants, Mapping):
        kind = type(variants).__name__
        raise TypeError(f"variants: expected a mapping of names, but got {kind}")
    if not variants:
        raise ValueError("variants: expected at least one")
    for name, variant in variants.items():
        if not isinstance(name, str) or not isinstance(variant, Mapping):
            raise TypeError(
                f"variants: expected a mapping of options for '{name}', but got"
                f" {type(variant).__name__}"
            )
    if isinstance(reference, str) and reference not in variants:
        known = ", ".join(variants)
        raise ValueError(f"reference: expected one of {known}, but got '{reference}'")
    if reference is not None and not isinstance(reference, (str, Mapping)):
        kind = type(reference).__name__
        raise TypeError(f"reference: expected a name or a mapping, but got {kind}")
    if metric not in _METRICS:
        known = ", ".join(_METRICS)
        raise ValueError(f"metric: expected one of {known}, but got '{metric}'")
    for name, count in counts.items():
        if not isinstance(count, int):
            kind = type(count).__name__
            raise TypeError(f"{name}: expected an integer, but got {kind}")
        if count < 1:
            raise ValueError(f"{name}: expected at least 1, but got {count}")


def speed_error(
    pipe: Union[Pipeline, Source],
    variants: Mapping[str, Variant],
    *,
    setup: Optional[Setup] = None,
    reference: Union[None, str, Variant] = None,
    picture: Optional[Picture] = None,
    metric: str = "rms",
    rounds: int = 5,
    frames: int = 15,
    seconds: float = 0.3,
    **common: Any,
) -> SpeedError:
    """Measures time and error of variants of a pipeline.

    `pipe` is a pipeline, of which each variant gets a copy of what is bound, or a path
    or a text, as piko.compile takes it. `variants` has, by name, what is different: the
    arguments of piko.Pipeline, which are options of piko.compile (`tunables`,
    `directives`, `defines`, `pipe`, ...), `threads`, `domain`, and constants and buffers
    by name. `common` are such arguments of all. `setup(pipe)` is called with each new
    pipeline, to feed and bind.

    `reference` says what is right: the name of a variant, or arguments as those of one;
    None is the text as it is, on the reference executor. `picture` is what to compare:
    an image of colours such as "image.color", or a function that makes an array of a
    pipeline. None is the one image of piko::scene::Color or Color8, else all numbers of
    buffers and images. Errors are those of the first run of each.

    Variants take turns: in each of `rounds` rounds each runs for `seconds`, at most
    `frames` times, after two runs that are not counted. `metric` is max, mean, rms, p99
    or flip, and says which error the Pareto front is of. VariantError says which variant
    failed.
    """
    counts = {"rounds": rounds, "frames": frames}
    _check_arguments(pipe, variants, reference, metric, counts)
    if not seconds >= 0:
        raise ValueError(f"seconds: expected at least 0, but got {seconds}")
    maker = _Maker(pipe, setup, common)
    right, described = {"target": "reference"}, _OWN
    if isinstance(reference, str):
        right, described = dict(variants[reference]), f"'{reference}'"
    elif reference is not None:
        right, described = dict(reference), "the reference"
    with Progress(f"measuring {len(variants)} variants") as bar:
        steps = len(variants) * (1 + rounds)
        pipes: Dict[str, Pipeline] = {}
        points: Dict[str, SpeedErrorPoint] = {}
        expected = _attempt("reference", lambda: _run_once(maker, right, picture)[1])
        for name, variant in variants.items():

            def measure() -> Errors:
                pipes[name], result = _run_once(maker, variant, picture)
                return expected.measure(result)

            points[name] = SpeedErrorPoint(name, 0.0, (), _attempt(name, measure))
            bar.update(len(points) / steps)
        error_of = _METRICS[metric]
        if None in (getattr(one.errors, error_of) for one in points.values()):
            raise ValueError(
                "metric: expected max, mean, rms or p99, because flip is of pictures"
            )
        for turn in range(rounds):
            for place, (name, point) in enumerate(points.items()):
                taken = _attempt(name, lambda: _time_runs(pipes[name], frames, seconds))
                points[name] = replace(point, times=(*point.times, taken))
                bar.update((len(points) * (turn + 1) + place + 1) / steps)
    found = [replace(one, ms=statistics.median(one.times)) for one in points.values()]
    front = pareto_front(
        [one.ms for one in found], [getattr(one.errors, error_of) for one in found]
    )
    marked = tuple(replace(one, front=is_on) for one, is_on in zip(found, front))
    return SpeedError(next(iter(pipes.values())).name, error_of, described, marked)


def _run_once(
    maker: _Maker, variant: Variant, picture: Optional[Picture]
) -> Tuple[Pipeline, _Result]:
    pipe = maker.make(variant)
    pipe.run()
    return pipe, _Result(pipe, picture)


def _attempt(variant: str, function: Callable[[], _T]) -> _T:
    """What a function gives; what it raises says of which variant that is."""
    try:
        return function()
    except (Error, ValueError, TypeError, KeyError) as error:
        # That of a KeyError is quoted.
        said = error.args[0] if isinstance(error, KeyError) and error.args else error
        raise VariantError(variant, str(said)) from error
