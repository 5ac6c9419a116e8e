# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Records as NumPy dtypes, and whether an array fits one.

The runtime lists a record's numbers by their paths: `lights.color.x` is four floats,
32 bytes apart. Paths that begin alike become a member; x, y, z and w of one type that
follow each other a vector; the dimensions of an array go to the innermost member where
the bytes come out right, as in the headers that pikoc writes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

DType = np.dtype[Any]
# Name, offset, elements, stride, type.
Leaf = Tuple[str, int, int, int, int]

_TYPES = ("f4", "f8", "i1", "i2", "i4", "i8")
# Of std::array; GLM's matrices have columns in `value`.
_HIDDEN = ("_M_elems", "__elems_")
_ROW = re.compile(r"(.*)\[(\d+)\]")


@dataclass
class _Part:
    """A member, before its arrays are complete: `dims` are left of them."""

    dtype: DType
    offset: int
    dims: List[Tuple[int, int]] = field(default_factory=list)  # count, stride


def _align(dtype: DType) -> int:
    if dtype.subdtype:
        return _align(dtype.subdtype[0])
    if dtype.fields:
        return max(_align(entry[0]) for entry in dtype.fields.values())
    return dtype.itemsize


def _absorb(part: _Part) -> _Part:
    """Takes the dimensions that are dense."""
    while part.dims and part.dims[-1][1] == part.dtype.itemsize:
        count = part.dims.pop()[0]
        base, shape = part.dtype.subdtype or (part.dtype, ())
        part.dtype = np.dtype((base, (count, *shape)))
    return part


def _struct(parts: Dict[str, _Part], size: Optional[int] = None) -> _Part:
    """Members as one, from the first one's place on."""
    begin = min(part.offset for part in parts.values())
    end = max(part.offset + part.dtype.itemsize for part in parts.values())
    align = max(_align(part.dtype) for part in parts.values())
    if size is None:
        size = -(-(end - begin) // align) * align
    dtype = np.dtype(
        {
            "names": list(parts),
            "formats": [part.dtype for part in parts.values()],
            "offsets": [part.offset - begin for part in parts.values()],
            "itemsize": size,
        }
    )
    return _Part(dtype, begin)


def _is_vector(parts: Dict[str, _Part]) -> bool:
    names, first = list(parts), next(iter(parts.values()))
    if not 2 <= len(names) <= 4 or names != ["x", "y", "z", "w"][: len(names)]:
        return False
    size = first.dtype.itemsize
    return first.dtype.fields is None and all(
        part.dtype == first.dtype
        and not part.dtype.subdtype
        and part.offset == first.offset + i * size
        for i, part in enumerate(parts.values())
    )


def _join(parts: Dict[str, _Part]) -> _Part:
    """What members with paths that begin alike are together."""
    dims = next(iter(parts.values())).dims
    if any(part.dims != dims for part in parts.values()):
        # Not of one array: each is one of structs with a gap.
        parts = {name: _pad({name: part}) for name, part in parts.items()}
        dims = []
    if _is_vector(parts):
        first = next(iter(parts.values()))
        base = first.dtype
        joined = _Part(np.dtype((base, (len(parts),))), first.offset)
    elif len(parts) == 1 and "value" in parts and _is_matrix(parts["value"]):
        return parts["value"]
    else:
        joined = _struct(parts)
    joined.dims = list(dims)
    return _absorb(joined)


def _is_matrix(part: _Part) -> bool:
    sub = part.dtype.subdtype
    return bool(sub and len(sub[1]) == 2 and all(2 <= n <= 4 for n in sub[1]))


def _pad(parts: Dict[str, _Part]) -> _Part:
    """Members with dimensions that are left, as structs as long as these say."""
    first = next(iter(parts.values()))
    dims = first.dims
    if not dims:
        return first
    if len(parts) == 1 and first.dtype.fields:
        parts = {
            name: _Part(entry[0], first.offset + entry[1], dims)
            for name, entry in first.dtype.fields.items()
        }
    bare = {name: _Part(part.dtype, part.offset) for name, part in parts.items()}
    padded = _struct(bare, dims[-1][1])
    padded.dims = list(dims)
    return _absorb(padded)


def _parts_of_rows(leaves: Sequence[Leaf]) -> List[Tuple[List[str], _Part]]:
    """The numbers by their paths; rows that follow each other evenly are one."""
    rows: Dict[str, List[Leaf]] = {}
    for leaf in leaves:
        match = _ROW.fullmatch(leaf[0])
        rows.setdefault(match[1] if match else leaf[0], []).append(leaf)
    found = []
    for name, group in rows.items():
        steps = {b[1] - a[1] for a, b in zip(group, group[1:])}
        even = len(steps) <= 1 and len({leaf[2:] for leaf in group}) == 1
        for row, (_, offset, elements, stride, kind) in enumerate(group):
            part = _Part(np.dtype(_TYPES[kind]), offset)
            if elements > 1 or stride:
                part.dims = [(elements, stride)]
            if even and len(group) > 1:
                part.dims.insert(0, (len(group), steps.pop()))
            path = [word for word in name.split(".") if word not in _HIDDEN]
            if not even:
                path[-1] += f"[{row}]"
            found.append((path, _absorb(part)))
            if even:
                break
    return found


def _build(entries: List[Tuple[List[str], _Part]]) -> Dict[str, _Part]:
    members: Dict[str, List[Tuple[List[str], _Part]]] = {}
    for path, part in entries:
        members.setdefault(path[0], []).append((path[1:], part))
    built = {}
    for name, inner in members.items():
        if len(inner) == 1 and not inner[0][0]:
            built[name] = inner[0][1]
        else:
            built[name] = _join(_build(inner))
    return built


def make_dtype(name: str, size: int, leaves: Sequence[Leaf]) -> DType:
    """The dtype of a record. Of a number, a vector, quaternion or matrix of GLM's
    that is no struct's member it is a plain one."""
    parts = _build(_parts_of_rows(leaves))
    is_plain = list(parts) == ["value"] or name.startswith("glm::")
    if is_plain:
        part = parts["value"] if list(parts) == ["value"] else _join(parts)
        if part.dtype.itemsize == size and not part.dims:
            return part.dtype
    members = {key: _pad({key: part}) for key, part in parts.items()}
    return np.dtype(
        {
            "names": list(members),
            "formats": [part.dtype for part in members.values()],
            "offsets": [part.offset for part in members.values()],
            "itemsize": size,
        }
    )


def scalar_of(dtype: DType) -> Optional[DType]:
    """The type of a record's numbers, if all have one and nothing is between them."""
    kinds = set()
    total = 0

    def walk(part: DType, count: int) -> None:
        nonlocal total
        if part.subdtype:
            walk(part.subdtype[0], count * int(np.prod(part.subdtype[1])))
        elif part.fields:
            for entry in part.fields.values():
                walk(entry[0], count)
        else:
            kinds.add(part)
            total += count * part.itemsize

    walk(dtype, 1)
    return kinds.pop() if len(kinds) == 1 and total == dtype.itemsize else None


def find_misfit(wanted: DType, given: DType, path: str = "") -> Optional[str]:
    """Why records of one dtype are not those of another; None if they are. Signs of
    integers, and bool for a byte, make no difference."""
    who = f"field '{path}'" if path else "the record"
    if wanted.subdtype and given.subdtype and wanted.itemsize == given.itemsize:
        return find_misfit(wanted.subdtype[0], given.subdtype[0], path)
    if wanted.fields and given.fields:
        for name in wanted.fields:
            inner = f"{path}.{name}" if path else name
            if name not in given.fields:
                return f"field '{inner}' is missing"
            a, b = wanted.fields[name], given.fields[name]
            misfit = find_misfit(a[0], b[0], inner)
            if misfit:
                return misfit
            if a[1] != b[1]:
                return f"field '{inner}': expected it at byte {a[1]}, but got {b[1]}"
        for name in given.fields:
            if name not in wanted.fields:
                inner = f"{path}.{name}" if path else name
                return f"there is no field '{inner}'"
        if wanted.itemsize != given.itemsize:
            return f"{who}: expected {wanted.itemsize} bytes, but got {given.itemsize}"
        return None
    if wanted.subdtype or given.subdtype or wanted.fields or given.fields:
        return f"{who}: expected {describe(wanted)}, but got {describe(given)}"
    integers = "iub"
    alike = wanted.kind == given.kind or (
        wanted.kind in integers and given.kind in integers
    )
    if not alike or wanted.itemsize != given.itemsize or not given.isnative:
        return f"{who}: expected {describe(wanted)}, but got {describe(given)}"
    return None


def describe(dtype: DType) -> str:
    """A dtype in a message."""
    if dtype.subdtype:
        return f"{dtype.subdtype[1]} of {describe(dtype.subdtype[0])}"
    if dtype.fields:
        return "(" + ", ".join(dtype.fields) + ")"
    return str(dtype)
