# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Arrays that pipelines take, and those that they show."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Tuple, cast

import numpy as np

from . import _core
from ._records import DType, describe, find_misfit, scalar_of

Array = np.ndarray[Any, DType]

# DLPack's kinds of devices and numbers.
_DL_CPU, _DL_CUDA, _DL_CUDA_HOST, _DL_CUDA_MANAGED = 1, 2, 3, 13
_DL_KINDS = {0: "i", 1: "u", 2: "f", 6: "b"}


@dataclass
class Bound:
    """Memory that a pipeline uses, and who keeps it: `array` as the user knows it."""

    array: Any
    address: int
    count: int
    on_device: bool


class DeviceArray:
    """Memory of a CUDA device, for libraries that know __cuda_array_interface__. It
    keeps the pipeline alive."""

    def __init__(
        self,
        address: int,
        shape: Tuple[int, ...],
        strides: Tuple[int, ...],
        dtype: DType,
        device: int,
        owner: object,
    ) -> None:
        scalar = scalar_of(dtype)
        if scalar is not None and dtype.itemsize > scalar.itemsize:
            shape = (*shape, dtype.itemsize // scalar.itemsize)
            strides = (*strides, scalar.itemsize)
        self.address, self.shape, self.strides = address, shape, strides
        self.dtype = dtype if scalar is None else scalar
        self.device = device
        self._owner = owner

    @property
    def __cuda_array_interface__(self) -> Dict[str, Any]:
        interface: Dict[str, Any] = {
            "version": 3,
            "data": (self.address, False),
            "shape": self.shape,
            "strides": self.strides,
            "typestr": self.dtype.str,
            "stream": None,
        }
        if self.dtype.fields:
            interface["descr"] = self.dtype.descr
        return interface


def view_of(
    address: int,
    shape: Tuple[int, ...],
    dtype: DType,
    owner: object,
    lease: Optional[_core.Memory] = None,
) -> Tuple[Array, _core.Memory]:
    """An array of memory, and what it holds on to; that holds on to the owner."""
    base, inner = dtype.subdtype or (dtype, ())
    count = int(np.prod(shape, dtype=np.int64))
    if lease is None:
        lease = _core.Memory(address, count * dtype.itemsize, False, owner)
    if count == 0:
        return np.empty((*shape, *inner), base), lease
    flat: Array = np.frombuffer(cast(memoryview, lease), np.uint8)
    return flat.view(base).reshape((*shape, *inner)), lease


def leading_rank(shape: Tuple[int, ...], per_record: int) -> int:
    """How many dimensions count records, where the others have the numbers of one; 0 if
    there are none such."""
    for rank in range(len(shape), 0, -1):
        if math.prod(shape[rank:]) == per_record:
            return rank
    return 0


def _fit(dtype: DType, given: DType, shape: Tuple[int, ...], who: str) -> int:
    """The number of records that an array has; ValueError where it has none."""
    if dtype.fields and given.fields:
        misfit = find_misfit(dtype, given)
        if misfit:
            raise ValueError(f"{who}: {misfit}")
        if len(shape) != 1:
            raise ValueError(f"{who}: expected one dimension, but got shape {shape}")
        return shape[0]
    scalar = scalar_of(dtype)
    if given.fields or scalar is None:
        kind = "records with fields " if dtype.fields else ""
        raise ValueError(
            f"{who}: expected {kind}{describe(dtype)}, but got {describe(given)}"
        )
    misfit = find_misfit(scalar, given)
    if misfit:
        raise ValueError(f"{who}: {misfit.removeprefix('the record: ')}")
    per_record = dtype.itemsize // scalar.itemsize
    rank = leading_rank(shape, per_record)
    if not rank:
        wanted = "(N,), a number" if per_record == 1 else f"(N, {per_record}), a row"
        raise ValueError(
            f"{who}: expected shape {wanted} for each record, but got {shape}"
        )
    return math.prod(shape[:rank])


def _take_numpy(array: Array, dtype: DType, who: str, writes: bool) -> Bound:
    count = _fit(dtype, array.dtype, array.shape, who)
    if not array.flags.c_contiguous:
        raise ValueError(
            f"{who}: expected a contiguous array, which np.ascontiguousarray makes"
        )
    if writes and not array.flags.writeable:
        raise ValueError(f"{who}: expected an array that may be written; copy() is one")
    return Bound(array, array.ctypes.data, count, False)


def _check_strides(
    shape: Tuple[int, ...], strides: Optional[Tuple[int, ...]], size: int, who: str
) -> None:
    """Strides are in units of which a number has `size`."""
    if strides is None:
        return
    step = size
    for extent, stride in zip(reversed(shape), reversed(strides)):
        if extent > 1 and stride != step:
            raise ValueError(f"{who}: expected a contiguous array")
        step *= extent


def _take_cuda(value: Any, dtype: DType, who: str, writes: bool) -> Bound:
    interface = value.__cuda_array_interface__
    try:
        address, is_read_only = interface["data"]
        given: DType = np.dtype(interface["typestr"])
        if given.kind == "V" and interface.get("descr"):
            given = np.dtype(interface["descr"])
        shape = tuple(interface["shape"])
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{who}: no __cuda_array_interface__: {error!r}") from None
    count = _fit(dtype, given, shape, who)
    _check_strides(shape, interface.get("strides"), given.itemsize, who)
    if writes and is_read_only:
        raise ValueError(f"{who}: expected an array that may be written")
    return Bound(value, address, count, True)


def _take_dlpack(value: Any, dtype: DType, who: str, writes: bool) -> Bound:
    device = value.__dlpack_device__()[0]
    if device not in (_DL_CPU, _DL_CUDA, _DL_CUDA_HOST, _DL_CUDA_MANAGED):
        raise ValueError(
            f"{who}: expected memory of the processor or of a CUDA device, but got"
            f" DLPack's device {int(device)}"
        )
    tensor = _core.Tensor(value.__dlpack__())
    code, bits, lanes = tensor.type
    if code not in _DL_KINDS or lanes != 1 or bits % 8:
        raise ValueError(f"{who}: expected plain numbers, but got DLPack's type {code}")
    given: DType = np.dtype(f"{_DL_KINDS[code]}{bits // 8}")
    shape = tuple(tensor.shape)
    count = _fit(dtype, given, shape, who)
    strides = tensor.strides
    _check_strides(shape, None if strides is None else tuple(strides), 1, who)
    on_device = device in (_DL_CUDA, _DL_CUDA_MANAGED)
    array: Any = tensor
    if not on_device:
        array = view_of(tensor.address, shape, given, tensor)[0]
    return Bound(array, tensor.address, count, on_device)


def check_numbers(value: Any, who: str) -> None:
    """TypeError for what NumPy takes for a number with a loss, or for NaN: None, and
    numbers that are complex. In sequences and mappings, too."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        value = value.ravel().tolist()
    if isinstance(value, (list, tuple)):
        for one in value:
            if not isinstance(one, (float, int)):
                check_numbers(one, who)
        return
    is_real = isinstance(value, numbers.Real)
    is_complex = isinstance(value, numbers.Complex) and not is_real
    if isinstance(value, np.ndarray) and value.dtype.kind == "c":
        raise TypeError(f"{who}: expected real numbers, but got {value.dtype}")
    if value is None or is_complex:
        raise TypeError(f"{who}: expected real numbers, but got {value!r}")


def convert(value: Any, dtype: DType) -> Array:
    """A sequence, or a number, as an array of plain numbers; ValueError where an integer
    does not fit, or a fraction would be lost."""
    if isinstance(value, np.ndarray) and value.dtype == dtype:
        return np.ascontiguousarray(value)
    try:
        array = np.array(value, order="C")
        with np.errstate(over="ignore", invalid="ignore"):
            made = array.astype(dtype)
    except (TypeError, ValueError):
        raise ValueError(f"expected numbers of type {dtype}, but got {value!r}") from None
    if dtype.kind in "iu" and array.dtype.kind in "iufb" and not (made == array).all():
        raise ValueError(f"expected numbers of type {dtype}, but got {value!r}")
    return made


def assign(to: Array, value: Any, path: str = "") -> None:
    """Sets numbers or records; of a mapping, the fields that it has. ValueError or
    TypeError where that cannot be."""
    if not to.dtype.fields:
        made = convert(value, to.dtype)
        try:
            to[...] = made
        except ValueError:
            raise ValueError(
                f"expected shape {to.shape}, but got {made.shape}"
            ) from None
    elif isinstance(value, Mapping):
        for name, part in value.items():
            inner = f"{path}.{name}" if path else str(name)
            if name not in to.dtype.fields:
                raise ValueError(f"there is no field '{inner}'")
            assign(to[name], part, inner)
    elif isinstance(value, (np.ndarray, np.void)):
        misfit = find_misfit(to.dtype, value.dtype, path)
        if misfit:
            raise ValueError(misfit)
        to[...] = value
    elif isinstance(value, (tuple, list)):
        to[...] = value
    else:
        kind = type(value).__name__
        raise ValueError(f"expected a mapping or a tuple of fields, but got {kind}")


def take_array(value: Any, dtype: DType, who: str, writes: bool) -> Bound:
    """Memory with records of a dtype: what has some is used in place, and other
    sequences are copied. ValueError where they do not fit."""
    if isinstance(value, np.ndarray):
        return _take_numpy(value, dtype, who, writes)
    if hasattr(value, "__cuda_array_interface__"):
        return _take_cuda(value, dtype, who, writes)
    if hasattr(value, "__dlpack__") and hasattr(value, "__dlpack_device__"):
        return _take_dlpack(value, dtype, who, writes)
    check_numbers(value, who)
    try:
        base = dtype.subdtype[0] if dtype.subdtype else dtype
        array = np.array(value, base, order="C") if base.fields else convert(value, base)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{who}: {error}") from None
    return _take_numpy(array, dtype, who, writes)
