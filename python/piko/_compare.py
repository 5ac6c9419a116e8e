# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Does a pipeline give what the reference executor gives?"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Iterator, List, Optional, Tuple

import numpy as np

from ._arrays import leading_rank
from ._errors import RunError
from ._pipeline import Array, Pipeline
from ._progress import Progress
from ._records import DType, scalar_of


@dataclass(frozen=True)
class Difference:
    """A field of a piece of state that differs: in `count` records, first in the one at
    `index`, where `expected` and `actual` are its numbers, and at most by `largest`."""

    state: str
    field: str
    index: Tuple[int, ...]
    expected: Any
    actual: Any
    count: int
    largest: float

    def __str__(self) -> str:
        where = f"{self.state}[{', '.join(map(str, self.index))}]"
        name = f"{where}.{self.field}" if self.field else where
        return (
            f"{name}: expected {self.expected}, but got {self.actual}; {self.count}"
            f" differ, by at most {self.largest:.6g}"
        )


def _drop_names(error: Optional[str]) -> Optional[str]:
    """How a run failed, without names: the reference executor knows those of classes,
    others those of stages."""
    if error is None:
        return None
    return re.sub(r"^(pipeline '[^']*': )?stage '[^']*'", "stage", error)


@dataclass(frozen=True)
class Comparison:
    """What two runs have left; true where that is the same, or both failed alike."""

    target: str
    against: str
    differences: Tuple[Difference, ...]
    # How runs ended that did not end well.
    expected_error: Optional[str] = None
    actual_error: Optional[str] = None

    def __bool__(self) -> bool:
        errors = [_drop_names(one) for one in (self.expected_error, self.actual_error)]
        return not self.differences and errors[0] == errors[1]

    def __str__(self) -> str:
        both = f"{self.target} against {self.against}"
        failed = self.expected_error is not None or self.actual_error is not None
        if self and not failed:
            return f"{both}: equal"
        lines = [f"{both}: {'both failed' if self else 'different'}"]
        if failed:
            lines += [
                f"  {self.against}: {self.expected_error or 'no error'}",
                f"  {self.target}: {self.actual_error or 'no error'}",
            ]
        lines += [f"  {one}" for one in self.differences]
        return "\n".join(lines)


def _leaves(dtype: DType, path: str = "") -> Iterator[Tuple[Tuple[str, ...], str]]:
    """The fields that are numbers or arrays of them, as keys and as text."""

    def walk(part: DType, keys: Tuple[str, ...]) -> Iterator[Tuple[str, ...]]:
        base = part.subdtype[0] if part.subdtype else part
        if not base.fields:
            yield keys
            return
        for name, entry in base.fields.items():
            yield from walk(entry[0], (*keys, name))

    for keys in walk(dtype, ()):
        yield keys, ".".join(keys)


def _compare_numbers(
    state: str, field: str, expected: Array, actual: Array, rank: int, tolerance: float
) -> Optional[Difference]:
    if expected.shape != actual.shape:
        return Difference(
            state, field, (), f"shape {expected.shape}", f"shape {actual.shape}", 1, 0.0
        )
    both_nan = np.zeros(expected.shape, bool)
    if expected.dtype.kind == "f":
        both_nan = np.isnan(expected) & np.isnan(actual)
    bits = f"u{expected.dtype.itemsize}"
    differs = (expected.view(bits) != actual.view(bits)) & ~both_nan
    if not differs.any():
        return None
    with np.errstate(invalid="ignore", over="ignore"):
        gaps = np.abs(expected.astype("f8") - actual.astype("f8"))
    gaps = np.where(np.isnan(gaps), np.inf, gaps)
    if tolerance > 0:
        differs &= gaps > tolerance
        if not differs.any():
            return None
    records = differs.reshape(*differs.shape[:rank], -1).any(axis=-1)
    index = tuple(int(i) for i in np.argwhere(records)[0])
    return Difference(
        state,
        field,
        index,
        expected[index].tolist(),
        actual[index].tolist(),
        int(records.sum()),
        float(gaps[differs].max()),
    )


def bind_copy(pipe: Pipeline, other: Pipeline) -> None:
    """Gives another pipeline copies of what one has."""
    if pipe.domain:
        other.domain = pipe.domain
    for name, state in pipe._states.items():
        if state.kind == "constant":
            other._set_constant(other._find(name), pipe[name])
        elif state.kind == "buffer" and state.source < 0 and has_memory(pipe, name):
            other[name] = np.array(pipe.read(name))
    for index, bound in pipe._fed.items():
        if bound.on_device:
            raise ValueError("expected sources in the host's memory to compare with")
        other.feed(index, bound.array)


def _run_copy(pipe: Pipeline, other: Pipeline) -> Optional[str]:
    """Runs another pipeline on copies of what one has; how that failed."""
    bind_copy(pipe, other)
    try:
        other.run()
    except RunError as error:
        return str(error)
    return None


def _records_of(array: Array, dtype: DType) -> Array:
    """What was bound as plain numbers as the records that they are."""
    scalar = scalar_of(dtype)
    if array.dtype.fields or scalar is None:
        return array
    base, shape = dtype.subdtype or (dtype, ())
    rank = leading_rank(array.shape, dtype.itemsize // scalar.itemsize)
    flat: Array = np.ascontiguousarray(array).reshape(-1).view(base)
    return flat.reshape((*array.shape[:rank], *shape))


def has_memory(pipe: Pipeline, name: str) -> bool:
    """Whether a buffer is bound; what no kernel uses need not be."""
    bound = {one[0]: one[5] for one in pipe._core.states()}
    return bound[name]


def compare(
    pipe: Pipeline, *, against: str = "reference", tolerance: float = 0.0
) -> Comparison:
    """Runs a pipeline and the same one for another target, by default the reference
    executor, on copies of what is bound, and says where what they leave differs.

    All bits count but padding and which NaN it is; numbers that differ by at most
    `tolerance` are equal. `pipe` and its arrays stay as they are. Where the reference
    takes long, so does this.
    """
    if not isinstance(pipe, Pipeline):
        raise TypeError(f"expected a pipeline, but got {type(pipe).__name__}")
    if not isinstance(against, str):
        kind = type(against).__name__
        raise TypeError(f"against: expected the name of a target, but got {kind}")
    if not tolerance >= 0:
        raise ValueError(f"expected a tolerance of at least 0, but got {tolerance}")
    with Progress(f"comparing {pipe.name} with {against}"):
        return _compare(pipe, against, tolerance)


def _compare(pipe: Pipeline, against: str, tolerance: float) -> Comparison:
    try:
        program = pipe.program.with_target(against)
    except ValueError as error:
        raise ValueError(re.sub("^target: ", "against: ", str(error))) from None
    first, second = Pipeline(program), Pipeline(pipe.program)
    expected_error = _run_copy(pipe, first)
    actual_error = _run_copy(pipe, second)
    differences: List[Difference] = []
    if expected_error is None and actual_error is None:
        for name, state in pipe._states.items():
            if state.kind == "constant" or not has_memory(second, name):
                continue
            expected = _records_of(first.read(name), state.dtype)
            actual = _records_of(second.read(name), state.dtype)
            rank = expected.ndim - len(state.dtype.shape)
            for keys, field in _leaves(state.dtype):
                a, b = expected, actual
                for key in keys:
                    a, b = a[key], b[key]
                found = _compare_numbers(
                    name,
                    field,
                    np.ascontiguousarray(a),
                    np.ascontiguousarray(b),
                    rank,
                    tolerance,
                )
                if found:
                    differences.append(found)
    return Comparison(
        pipe.program.target,
        against,
        tuple(differences),
        expected_error,
        actual_error,
    )
