# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A pipeline as a tree: what the generator makes, the printers write and the
reducer takes apart.

Types are named i8 .. i64, u8 .. u64, f32, f64 and b1. Expressions have the
types i32, u32, i64, u64, f32, f64 and b1; the narrow ones are for fields.
`solid` parts keep a pipeline valid (an index that is in range, a counter that
ends a cycle), so that the reducer leaves them alone.
"""

from dataclasses import dataclass, field, fields, is_dataclass

SIZES = {"b1": 1, "i8": 1, "u8": 1, "i16": 2, "u16": 2, "i32": 4, "u32": 4,
         "i64": 8, "u64": 8, "f32": 4, "f64": 8}
INTEGERS = ("i32", "u32", "i64", "u64")
FLOATS = ("f32", "f64")


def wide(kind):
    """The type that a field has in an expression."""
    return {"i8": "i32", "u8": "i32", "i16": "i32", "u16": "i32"}.get(kind, kind)


# --- Records ---------------------------------------------------------------


@dataclass
class Member:
    """`kind` is a scalar type, a Record, or "vec2" .. "vec4" of GLM."""

    name: str
    kind: object
    count: int = 0  # an array's length
    default: object = None


@dataclass
class Leaf:
    """A number in a record: `path` is what C++ writes, with `[]` where an
    element's index goes."""

    path: str
    kind: str
    count: int
    offset: int
    stride: int
    default: object = None

    @property
    def symbol(self):
        return self.path.replace("[]", "")


@dataclass
class Record:
    """A struct, or with `scalar` a plain number."""

    name: str
    members: list = field(default_factory=list)
    scalar: str = ""

    def layout(self):
        if self.scalar:
            size = SIZES[self.scalar]
            return [Leaf("", self.scalar, 0, 0, 0)], size, size
        leaves, at, align = [], 0, 1
        for m in self.members:
            if isinstance(m.kind, Record):
                inner, size, step = m.kind.layout()
            elif m.kind.startswith("vec"):
                n = int(m.kind[3])
                inner = [Leaf("xyzw"[i], "f32", 0, 4 * i, 0) for i in range(n)]
                size, step = 4 * n, 4
            else:
                size = step = SIZES[m.kind]
                inner = [Leaf("", m.kind, 0, 0, 0)]
            at = -(-at // step) * step
            align = max(align, step)
            name = m.name + ("[]" if m.count else "")
            for leaf in inner:
                leaves.append(Leaf(
                    name + ("." + leaf.path if leaf.path else ""), leaf.kind,
                    m.count, at + leaf.offset, size if m.count else 0, m.default))
            at += size * max(m.count, 1)
        return leaves, -(-at // align) * align, align

    @property
    def leaves(self):
        return self.layout()[0]

    def leaf(self, path):
        return next((l for l in self.leaves if l.path == path), None)


# --- Expressions -----------------------------------------------------------


@dataclass(eq=False)
class Expr:
    type: str
    solid: bool = field(default=False, kw_only=True)


@dataclass(eq=False)
class Lit(Expr):
    value: object


@dataclass(eq=False)
class Var(Expr):
    name: str


@dataclass(eq=False)
class Get(Expr):
    """A field of a record variable; `index` is taken modulo the length."""

    base: str
    leaf: Leaf
    index: Expr = None


@dataclass(eq=False)
class Item(Expr):
    """A field of the list's primitive at `index`, which is in range."""

    leaf: Leaf
    at: Expr
    index: Expr = None


@dataclass(eq=False)
class Query(Expr):
    """bin, lo, hi, domain, size (of the list), or extent of a buffer."""

    kind: str
    dim: int = 0
    state: str = ""


@dataclass(eq=False)
class Load(Expr):
    """A number of state: a constant's, or an element's, whose index is taken
    modulo the extent."""

    state: object
    leaf: Leaf
    at: list
    index: Expr = None


@dataclass(eq=False)
class Element(Expr):
    """An element of a local array; `at` is taken modulo the length."""

    array: str
    length: int
    at: Expr


@dataclass(eq=False)
class Op(Expr):
    """An operation on operands of its own type, but for comparisons, casts and
    the functions, which say what they take."""

    name: str
    operands: list


@dataclass(eq=False)
class Gather(Expr):
    """any, all, count or reduce over f(0) .. f(n - 1), outside parallelFor."""

    kind: str
    var: str
    n: Expr
    value: Expr
    op: str = "+"


# --- Statements ------------------------------------------------------------


@dataclass(eq=False)
class Stmt:
    solid: bool = field(default=False, kw_only=True)


@dataclass(eq=False)
class Let(Stmt):
    name: str
    type: str
    value: Expr


@dataclass(eq=False)
class Assign(Stmt):
    name: str
    value: Expr


@dataclass(eq=False)
class Copy(Stmt):
    """A new record variable: a copy of another, of a list's item, or zero."""

    name: str
    record: Record
    base: str = ""
    at: Expr = None


@dataclass(eq=False)
class Put(Stmt):
    """Sets a field of a record variable."""

    base: str
    leaf: Leaf
    value: Expr
    index: Expr = None


@dataclass(eq=False)
class If(Stmt):
    test: Expr
    then: list
    other: list = field(default_factory=list)


@dataclass(eq=False)
class For(Stmt):
    """Counts an int from `first`, or 0, to `bound`, which is small, or `list` is
    true and it goes over the list."""

    var: str
    bound: Expr
    body: list
    list: bool = False
    first: Expr = None


@dataclass(eq=False)
class Jump(Stmt):
    """break, continue, or return, out of an update with its result."""

    kind: str
    value: Expr = None


@dataclass(eq=False)
class Switch(Stmt):
    """Cases 0, 1, ... of `value` modulo their number; the last is default."""

    value: Expr
    cases: list
    falls: list


@dataclass(eq=False)
class Emit(Stmt):
    port: int
    record: str


@dataclass(eq=False)
class Update(Stmt):
    """Of the pixel `at`, which is in the bin; `px` is the pixel's name."""

    image: object
    at: list
    body: list
    result: Expr = None
    name: str = ""


@dataclass(eq=False)
class Atomic(Stmt):
    op: str
    state: object
    at: list
    leaf: Leaf
    value: Expr
    name: str = ""  # the variable that takes what a Fetch returns


@dataclass(eq=False)
class Store(Stmt):
    """A whole record to an element that no other call writes."""

    state: object
    at: list
    record: str


@dataclass(eq=False)
class Array(Stmt):
    name: str
    type: str
    length: int


@dataclass(eq=False)
class Set(Stmt):
    array: str
    length: int
    at: Expr
    value: Expr


@dataclass(eq=False)
class Parallel(Stmt):
    """parallelFor, or parallelForPixels where `bound` is None: over the bin, or
    over what a box from `lo` to `hi` has of it."""

    var: str
    bound: Expr
    body: list
    lo: list = field(default_factory=list)
    hi: list = field(default_factory=list)


@dataclass(eq=False)
class Sync(Stmt):
    pass


@dataclass(eq=False)
class Collective(Stmt):
    """any, all, count, reduce, scan or sort between iterations."""

    kind: str
    name: str
    type: str
    value: Expr
    op: str = "+"


@dataclass(eq=False)
class Lambda(Stmt):
    """A variable whose value a lambda with an early return computes."""

    name: str
    type: str
    test: Expr
    early: Expr
    value: Expr


@dataclass(eq=False)
class Bins(Stmt):
    """An assign directive: to, at (known to be in the domain), box, floatbox, line,
    all, previous."""

    kind: str
    lo: list = field(default_factory=list)
    hi: list = field(default_factory=list)


@dataclass(eq=False)
class Directive(Stmt):
    """A schedule directive, as C++ writes it but for its operands."""

    kind: str  # specifySchedule, endStage, endBin, batch, everyBin, unordered,
    # specifyLanes, specifyPrecision
    policy: str = "LoadBalance"
    value: Expr = None
    stage: int = 0


# --- Pipelines -------------------------------------------------------------


@dataclass
class State:
    name: str
    kind: str  # constant, buffer or image
    record: Record
    source: int = -1  # a buffer that is allocated for a source


@dataclass
class Stage:
    name: str
    bins: list
    threads: int
    input: Record
    outputs: list
    is_list: bool = False
    assign: list = None
    schedule: list = field(default_factory=list)
    process: list = field(default_factory=list)
    template: int = 0  # the value of its template parameter
    twin_of: object = None  # the stage whose type it has


@dataclass
class Edge:
    producer: int
    port: int
    consumer: int


@dataclass
class Pipeline:
    name: str
    domain: list
    records: list = field(default_factory=list)
    state: list = field(default_factory=list)
    stages: list = field(default_factory=list)
    sources: list = field(default_factory=list)
    edges: list = field(default_factory=list)
    counts: list = field(default_factory=list)
    input_seed: int = 1
    used: set = field(default_factory=set)

    @property
    def rank(self):
        return len(self.domain)


def walk(node):
    """All expressions and statements under a node, itself included."""
    if isinstance(node, list):
        for item in node:
            yield from walk(item)
    elif isinstance(node, (Expr, Stmt)):
        yield node
        for f in fields(node):
            value = getattr(node, f.name)
            if isinstance(value, (Expr, Stmt, list)):
                yield from walk(value)
    elif isinstance(node, Stage):
        for part in (node.assign or [], node.schedule, node.process):
            yield from walk(part)
    elif isinstance(node, Pipeline):
        for stage in node.stages:
            yield from walk(stage)
