# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A pipeline that runs: its state and sources as NumPy arrays."""

from __future__ import annotations

import operator
import os
import signal
import threading
import weakref
from collections.abc import ItemsView, KeysView, ValuesView
from dataclasses import dataclass
from types import MappingProxyType
from typing import (
    TYPE_CHECKING,
    Any,
    Dict,
    Iterable,
    Iterator,
    List,
    Mapping,
    Optional,
    Tuple,
    Union,
    cast,
)

import numpy as np

from . import _core
from ._arrays import Bound, DeviceArray, assign, check_numbers, take_array, view_of
from ._compile import Program, Source, compile
from ._errors import RunError, Status, say_unknown
from ._progress import Progress
from ._records import DType, make_dtype
from ._stats import Stats, read_stats

Array = np.ndarray[Any, DType]

PROCESSOR = -2
_ANY_DEVICE = -1
_KINDS = ("constant", "buffer", "image")


@dataclass(frozen=True)
class Device:
    """A CUDA device: `capability` of compute is 10 * major + minor, `memory` in bytes.
    `usable`: whether pipelines can be on it."""

    name: str
    capability: int
    usable: bool
    memory: int


def devices() -> List[Device]:
    """The CUDA devices of this machine, by their numbers; none without a driver."""
    return [Device(*one) for one in _core.devices()]


class SourceInfo:
    """Where primitives come in: the stage's `name`, its number `index`, the `dtype` of
    a primitive and how many are bound."""

    def __init__(self, name: str, index: int, dtype: DType) -> None:
        self.name, self.index, self.dtype = name, index, dtype
        self.count = 0

    def __repr__(self) -> str:
        return f"<piko.Source {self.index} '{self.name}', {self.count} bound>"


def read_number(what: str, value: Any) -> int:
    """An integer that fits into 64 bits."""
    try:
        number = operator.index(value)
    except TypeError:
        kind = type(value).__name__
        raise TypeError(f"{what}: expected an integer, but got {kind}") from None
    if not -(2**63) <= number < 2**63:
        raise ValueError(f"{what}: expected an integer of 64 bits, but got {number}")
    return number


class _State:
    """What is known of a piece of state; `bound` is what a buffer is."""

    def __init__(
        self, name: str, kind: int, dtype: DType, rank: int, source: int
    ) -> None:
        self.name, self.dtype, self.rank, self.source = name, dtype, rank, source
        self.kind = _KINDS[kind]
        self.bound: Optional[Bound] = None
        self.lease: Optional[weakref.ref[_core.Memory]] = None
        self.shape: Tuple[int, ...] = ()  # of the lease

    def is_viewed(self) -> bool:
        return self.lease is not None and self.lease() is not None


class Pipeline:
    """A compiled pipeline with state and sources, for one thread at a time.

    `program` is a Program, or what piko.compile takes first, with its options. `domain`
    is the extent in cells, x first. `threads`: 0 = OMP_NUM_THREADS, or all processors;
    results do not depend on it. Further arguments are pieces of state, or options of
    piko.compile.

    pipe[name] is a piece of state:

    * a constant: a copy, which cannot be changed; `pipe[name] = value` sets it, from
      numbers, sequences, arrays, or a mapping of fields. One that nobody sets is what
      the text says, or zero;
    * a buffer: the array that was assigned, which is used in place, or allocated;
    * an image: shape (..., height, width), without a copy, once the pipeline has run.

    It is a mapping: `name in pipe`, len(pipe), list(pipe), keys, values, items.

    An array of an image, or of a buffer that the pipeline owns, keeps the pipeline
    alive and shows what each run leaves. What would move its memory (another domain,
    another number of primitives, `allocate`) raises BufferError while such an array is
    in use; copy() ends that. On a CUDA device they are copies.
    """

    def __init__(
        self,
        program: Union[Program, Source],
        pipe: Optional[str] = None,
        *,
        domain: Optional[Iterable[int]] = None,
        threads: Optional[int] = None,
        device: Optional[int] = None,
        **others: Any,
    ) -> None:
        accepted = compile.__annotations__
        if not isinstance(program, Program):
            options = {key: others.pop(key) for key in list(others) if key in accepted}
            program = compile(program, pipe, **options)
        elif pipe is not None and pipe != program.name:
            raise ValueError(f"the program is of '{program.name}', not of '{pipe}'")
        self.program = program
        self._process = os.getpid()
        self._user: Optional[int] = None  # the thread that runs it
        self._core = _core.Pipeline(
            program._core, _ANY_DEVICE if device is None else device
        )
        self._check(self._core.status())
        self._read_declarations()
        for name in others:
            if name in accepted and name not in self._states:
                raise TypeError(
                    f"{name}: an option of piko.compile, but the program is compiled"
                )
        if program._tuned_mappings:
            self._check(self._core.set_mappings(program._tuned_mappings))
        if program._tuned_strip_size:
            self._check(self._core.set_strip_size(program._tuned_strip_size))
        if domain is not None:
            self.domain = domain  # type: ignore[assignment]
        if threads is not None:
            self.threads = threads
        for name, value in others.items():
            self[name] = value

    def _read_declarations(self) -> None:
        records = self._core.records()
        dtypes = [make_dtype(name, size, fields) for name, size, _, fields in records]
        self._domain: Tuple[int, ...] = ()
        self._records = {record[0]: dtype for record, dtype in zip(records, dtypes)}
        self._states = {
            name: _State(name, kind, dtypes[record], rank, source)
            for name, kind, record, rank, source, _ in self._core.states()
        }
        self._sources = [
            SourceInfo(name, index, dtypes[record])
            for index, (name, record, _) in enumerate(self._core.sources())
        ]
        self._fed: Dict[int, Bound] = {}
        for name, kind, record, _, _, is_bound in self._core.states():
            if _KINDS[kind] == "constant" and not is_bound:  # the language's rule
                zeros = bytes(dtypes[record].itemsize)
                self._check(self._core.bind_constant(name, zeros))

    # --- Errors -------------------------------------------------------------

    def _check(self, status: int) -> None:
        if status:
            raise RunError(status, self._core.message())

    def _check_argument(self, who: str, status: int) -> None:
        """Likewise, where an argument that is wrong is a ValueError."""
        if status == Status.INVALID_ARGUMENT:
            raise ValueError(f"{who}: {self._core.message()}")
        self._check(status)

    def _use(self) -> None:
        """Before each call: one thread at a time, and in the process that made it."""
        user = self._user
        if user is not None:
            raise RuntimeError(
                f"pipeline '{self.name}' runs in another thread"
                if user != threading.get_ident()
                else f"pipeline '{self.name}' runs"
            )
        if self._process != os.getpid() and self._core.device() >= 0:
            raise RuntimeError(
                f"pipeline '{self.name}' is on a CUDA device, which is its parent"
                " process's; make it anew in this one"
            )

    def _find(self, name: str) -> _State:
        self._use()
        state = self._states.get(name)
        if state is None:
            known = ", ".join(self._states) or "none"
            raise KeyError(
                f"pipeline '{self.name}' has no state '{name}'; it has {known}"
            )
        return state

    if not TYPE_CHECKING:  # for whom any attribute could then be set

        def __setattr__(self, name: str, value: Any) -> None:
            """State and misspelled options do not become attributes unseen; those of
            a class derived from this one may be what they like."""
            known = name == "program" or name.startswith("_")
            what = getattr(type(self), name, None)
            if known or isinstance(what, property):
                object.__setattr__(self, name, value)
                return
            if name in self.__dict__.get("_states", ()):
                raise AttributeError(
                    f"state is set by pipe['{name}'] = value, not as an attribute"
                )
            if type(self) is not Pipeline:
                object.__setattr__(self, name, value)
                return
            if what is not None:
                raise AttributeError(f"'{name}' is a method of pipelines")
            raise AttributeError(say_unknown(name, [*dir(Pipeline), *self._states]))

    # --- What it is ---------------------------------------------------------

    @property
    def name(self) -> str:
        return self._core.name()

    @property
    def records(self) -> Mapping[str, DType]:
        """The dtypes of all records, by the names of their types in C++. Vectors are
        subarrays, and padding is kept."""
        return MappingProxyType(self._records)

    @property
    def state(self) -> Mapping[str, str]:
        """What there is: "constant", "buffer" or "image", by name."""
        kinds = {name: state.kind for name, state in self._states.items()}
        return MappingProxyType(kinds)

    def dtype(self, name: str) -> DType:
        """Of a piece of state: of its records."""
        return self._find(name).dtype

    @property
    def sources(self) -> List[SourceInfo]:
        return list(self._sources)

    def source(self, which: Union[str, int]) -> SourceInfo:
        """A source, by its stage's name or by its number."""
        if isinstance(which, str):
            found = [one for one in self._sources if one.name == which]
            if len(found) == 1:
                return found[0]
            if found:
                numbers = ", ".join(str(one.index) for one in found)
                raise KeyError(
                    f"stage '{which}' has several sources; say which: {numbers}"
                )
        elif 0 <= read_number("source", which) < len(self._sources):
            return self._sources[which]
        names = ", ".join(one.name for one in self._sources)
        raise KeyError(
            f"pipeline '{self.name}' has no source '{which}'; it has {names}"
        )

    @property
    def device(self) -> int:
        """The number of the CUDA device that it is on; -2 is the processor."""
        return self._core.device()

    @property
    def device_refusal(self) -> str:
        """Why it is on the processor although there is a device; "" otherwise."""
        return self._core.device_refusal()

    @property
    def processor(self) -> str:
        """The processor that its code is for."""
        return self._core.processor()

    # --- Options ------------------------------------------------------------

    @property
    def domain(self) -> Tuple[int, ...]:
        """The extent in cells, x first; () before it is set."""
        return self._domain

    @domain.setter
    def domain(self, extent: Iterable[int]) -> None:
        self._use()
        if not isinstance(extent, Iterable):
            kind = type(extent).__name__
            raise TypeError(f"domain: expected a cell count for each dimension, but got {kind}")
        cells = [read_number("domain", cell) for cell in extent]
        self._check_argument("domain", self._core.set_domain(cells))
        self._domain = tuple(cells)

    @property
    def threads(self) -> int:
        """How many the latest run could use, or how many were set."""
        return self._core.threads()

    @threads.setter
    def threads(self, count: int) -> None:
        self._use()
        number = read_number("threads", count)
        if number >= 2**31:  # the runtime has no words for it
            raise ValueError(
                f"threads: expected a number of threads in [0, 10000], but got {number}"
            )
        self._check_argument("threads", self._core.set_threads(number))

    def _set(self, name: str, value: int) -> None:
        self._use()
        number = read_number(name, value)
        self._check_argument(name, getattr(self._core, name)(number))

    def set_memory_limit(self, bytes: int) -> None:
        """Limits all memory; 0 = no limit. A run that needs more is a RunError."""
        self._set("set_memory_limit", bytes)

    def set_memory_budget(self, bytes: int) -> None:
        """How many bytes bins and queues should use; 0 = no budget. Sources run in
        strips where that helps."""
        self._set("set_memory_budget", bytes)

    def set_strip_size(self, primitives: int) -> None:
        """How many primitives of a source a strip has; 0 = what fits."""
        self._set("set_strip_size", primitives)

    def set_loop_limit(self, limit: int) -> None:
        """How many hops a primitive makes on a cycle of stages, and rounds it runs."""
        self._set("set_loop_limit", limit)

    def set_mappings(self, setting: str) -> None:
        """Which version of its loops run: measured, expected, vectors or scalar, or for
        one loop "Kernel:0=vectors"."""
        self._use()
        self._check_argument("set_mappings", self._core.set_mappings(setting))

    def set_static_input(self, on: bool) -> None:
        """On a device: whether arrays of the host stay as they are between runs."""
        self._use()
        self._check(self._core.set_static_input(int(on)))

    # --- State and sources --------------------------------------------------

    def __getitem__(self, name: str) -> Any:
        state = self._find(name)
        if state.kind == "constant":
            return self._read_constant(state)
        if state.bound is not None:
            return state.bound.array
        return self._view(state)

    def __contains__(self, name: object) -> bool:
        return name in self._states

    def __iter__(self) -> Iterator[str]:
        return iter(self._states)

    def __len__(self) -> int:
        return len(self._states)

    def __bool__(self) -> bool:
        return True  # also without state

    def keys(self) -> KeysView[str]:
        """The names of state, as `list(pipe)`."""
        return self._states.keys()

    def values(self) -> ValuesView[Any]:
        return ValuesView(cast(Mapping[str, Any], self))

    def items(self) -> ItemsView[str, Any]:
        return ItemsView(cast(Mapping[str, Any], self))

    def _read_constant(self, state: _State) -> Array:
        status, address, *_ = self._core.view(state.name)
        self._check(status)
        view = view_of(address, (), state.dtype, self._core)[0]
        copy = np.frombuffer(view.tobytes(), view.dtype)
        return copy.reshape(view.shape)  # of bytes, which cannot be changed

    def _view(self, state: _State) -> Array:
        """Memory that the pipeline owns; on a device a copy of it."""
        status, address, extent, size, rank = self._core.view(state.name)
        self._check(status)
        shape = tuple(reversed(extent[:rank]))
        if self.device >= 0:
            array = view_of(address, shape, state.dtype, self._core)[0]
            return array.copy()
        array, lease = view_of(address, shape, state.dtype, self._core)
        live = state.lease() if state.lease is not None else None
        if live is not None and state.shape == shape:
            # One memory for all, so that one reference tells of all of them.
            return view_of(address, shape, state.dtype, self._core, live)[0]
        state.lease, state.shape = weakref.ref(lease), shape
        return array

    def __setitem__(self, name: str, value: Any) -> None:
        state = self._find(name)
        if state.kind == "constant":
            self._set_constant(state, value)
        elif state.kind == "image":
            raise TypeError(
                f"'{name}' is an image, which runs write; change pipe['{name}'][...]"
            )
        else:
            self._bind(state, value)

    def _set_constant(self, state: _State, value: Any) -> None:
        array = self._read_constant(state).copy()
        check_numbers(value, f"constant '{state.name}'")
        try:
            assign(array, value)
        except (ValueError, TypeError, OverflowError) as error:
            raise ValueError(f"constant '{state.name}': {error}") from None
        self._check(self._core.bind_constant(state.name, array.tobytes()))

    def _bind(self, state: _State, value: Any) -> None:
        if state.source >= 0:
            raise TypeError(
                f"buffer '{state.name}' has an element for each primitive of source"
                f" '{self._sources[state.source].name}', and cannot be bound"
            )
        who = f"buffer '{state.name}'"
        bound = take_array(value, state.dtype, who, writes=True)
        self._refuse_views(state, "bound anew")
        self._check(
            self._core.bind_buffer(
                state.name,
                bound.address,
                bound.count,
                state.dtype.itemsize,
                bound.on_device,
            )
        )
        state.bound = bound

    def allocate(self, name: str, count: int) -> Array:
        """Gives a buffer `count` zeroed records that the pipeline owns, and returns
        them."""
        state = self._find(name)
        if state.kind != "buffer":
            raise TypeError(f"'{name}' is {state.kind}, not a buffer")
        self._refuse_views(state, "allocated anew")
        status = self._core.allocate(name, read_number("allocate", count))
        said = self._core.message()
        # Without memory for the new records the old ones are gone, too.
        if not status or not {one[0]: one[5] for one in self._core.states()}[name]:
            state.bound = None
        if status == Status.INVALID_ARGUMENT:
            raise ValueError(said)
        if status:
            raise RunError(status, said)
        return self._view(state)

    def feed(self, source: Union[str, int], primitives: Any) -> None:
        """Gives a source its primitives: a structured array of its dtype, used in place
        and kept; one of plain numbers, (N, k), where all of the record's are of that
        type; anything with __dlpack__ or __cuda_array_interface__; or a sequence, which
        is copied. ValueError names the field that does not fit."""
        self._use()
        info = self.source(source)
        who = f"source '{info.name}'"
        bound = take_array(primitives, info.dtype, who, writes=False)
        self._check(
            self._core.bind_source(
                info.index,
                bound.address,
                bound.count,
                info.dtype.itemsize,
                bound.on_device,
            )
        )
        self._fed[info.index] = bound
        info.count = bound.count

    def read(self, name: str) -> Array:
        """A copy of a buffer or an image, wherever it is."""
        state = self._find(name)
        if state.kind == "constant" or self.device < 0:
            array: Array = np.array(self[name])
            return array
        _, extent, _, _ = self._device_place(state)
        base, shape = state.dtype.subdtype or (state.dtype, ())
        copy = np.empty((*extent, *shape), base)
        count = int(np.prod(extent))
        size = state.dtype.itemsize
        self._check(self._core.read(name, copy.ctypes.data, count, size))
        return copy

    def _device_place(
        self, state: _State
    ) -> Tuple[int, Tuple[int, ...], Tuple[int, ...], int]:
        status, address, extent, stride, _, rank, device = self._core.device_view(
            state.name
        )
        self._check(status)
        shape, strides = tuple(extent[:rank]), tuple(stride[:rank])
        return address, shape[::-1], strides[::-1], device

    def device_array(self, name: str) -> DeviceArray:
        """An image or a buffer where it is on the CUDA device, for other libraries, by
        __cuda_array_interface__. Valid until the next run."""
        state = self._find(name)
        address, shape, strides, device = self._device_place(state)
        return DeviceArray(address, shape, strides, state.dtype, device, self._core)

    # --- Running ------------------------------------------------------------

    def _refuse_views(self, state: _State, what: str) -> None:
        if state.is_viewed():
            raise BufferError(
                f"an array of '{state.name}' is in use, which cannot be {what};"
                " delete it, or use a copy() of it"
            )

    def _refuse_moves(self) -> None:
        """A run that would move memory that arrays show."""
        for state in self._states.values():
            if state.kind == "image":
                shape = tuple(reversed(self._domain))
            elif state.source >= 0:
                shape = (self._sources[state.source].count,)
            else:
                continue
            if state.is_viewed() and state.shape != shape:
                self._refuse_views(state, f"made anew with shape {shape}")

    def run(self, *, stream: Optional[int] = None) -> None:
        """Clears the images and runs the pipeline on what was fed. Other threads of
        Python run meanwhile.

        Ctrl-C in the main thread raises KeyboardInterrupt when the kernel that runs has
        ended, with results that are incomplete; a kernel cannot be stopped, nor can the
        reference executor or a frame that a device has all of, which end first. With
        `stream`, a CUstream's address, the run is in its order.
        """
        self._use()
        self._refuse_moves()
        hears = (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        )
        self._user = threading.get_ident()
        try:
            with Progress(f"running {self.name}"):
                status = self._core.run(stream, hears)
        finally:
            self._user = None
        self._check(status)

    def capture(self, path: Source) -> None:
        """Writes what a run would take now to a file, for piko-render and piko-tune."""
        self._use()
        with Progress(f"writing {os.fspath(path)}"):
            self._check(self._core.capture(os.fspath(path)))

    def stats(self) -> Stats:
        """What runs did, and where their time went, since reset_stats()."""
        self._use()
        return read_stats(self._core)

    def reset_stats(self) -> None:
        self._use()
        self._core.reset_stats()

    def __repr__(self) -> str:
        domain = " x ".join(map(str, self._domain)) or "no domain"
        return f"<piko.Pipeline {self.name}, {domain}>"

    def __reduce__(self) -> Any:
        raise TypeError(
            "a pipeline cannot be pickled; pickle its program, and make one of it there"
        )


__all__ = ["PROCESSOR", "Array", "Device", "Pipeline", "SourceInfo", "devices"]
