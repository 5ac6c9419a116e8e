# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Random expressions, and what is in scope where one is made."""

from model import *

LITERALS = {
    "i32": [0, 1, -1, 2, 3, 5, 7, 31, 63, 255, -128, 1 << 30, 2**31 - 1, -(2**31)],
    "u32": [0, 1, 2, 3, 5, 31, 255, 0x9E3779B9, 2**31, 2**32 - 1],
    "i64": [0, 1, -1, 3, 63, 1 << 33, -(1 << 40), 2**63 - 1, -(2**63)],
    "u64": [0, 1, 5, 63, 0x9E3779B97F4A7C15, 2**63, 2**64 - 1],
    "f32": [0.0, -0.0, 0.5, 1.0, -1.0, 0.25, 3.0, 100.0, 1e-40, 1e30, "inf", "-inf", "nan"],
    "f64": [0.0, 0.5, 1.0, -2.0, 0.1, 1e300, 1e-310, "inf", "nan"],
}
ARITHMETIC = ["+", "+", "-", "*", "*", "&", "|", "^", "^", "<<", ">>", "/", "%",
              "min", "max"]
#: Functions of floats, those that the dialect has as one operation, and the
#: rest, which piko.h writes in C++.
EXACT = ["sqrt", "abs", "floor", "ceil", "trunc"]
MATHS = ["exp", "exp2", "log", "log2", "sin", "cos", "tan", "asin", "acos", "atan",
         "cbrt", "rsqrt", "round"]
MATHS2 = ["pow", "atan2", "copysign"]
COMPARISONS = ["<", "<=", ">", ">=", "==", "!="]


class Scope:
    """The names that an expression or statement may use. A scope inside
    another sees its names; what is before a parallelFor (`level`) may be
    read in it, but not assigned."""

    def __init__(self, maker, phase, outer=None, **changes):
        self.maker, self.phase, self.outer = maker, phase, outer
        self.variables, self.records, self.arrays = [], [], []
        for name in ("level", "updating", "loops", "bins", "reads", "stage",
                     "uniform", "multiplicity", "syncs", "has_size", "is_pure", "returns"):
            setattr(self, name, getattr(outer, name) if outer else None)
        for name, value in changes.items():
            setattr(self, name, value)

    def all(self, what):
        found, scope = [], self
        while scope:
            found += [(*entry, scope.level) for entry in getattr(scope, what)]
            scope = scope.outer
        return found


class Expressions:
    """Makes random expressions; `random` and `on` come from the generator."""

    def literal(self, kind):
        r = self.random
        if kind == "b1":
            return Lit("b1", r.random() < 0.5)
        if r.random() < 0.5:
            if kind in FLOATS:
                return Lit(kind, r.randrange(-64, 640) / 64)
            return Lit(kind, r.randrange(0, 40))
        specials = LITERALS[kind]
        if not self.on("float-specials") or r.random() < 0.6:
            specials = [v for v in specials if not isinstance(v, str)
                        and (kind not in FLOATS or 1e-30 < abs(v) < 1e20 or v == 0)]
        value = r.choice(specials)
        if kind in FLOATS and (isinstance(value, str) or (value and abs(value) < 1e-30)):
            self.use("float-specials")
        return Lit(kind, value)

    def expr(self, kind, scope, depth=None):
        r = self.random
        if depth is None:
            depth = r.choice([1, 2, 2, 3])
        if depth <= 0 or r.random() < 0.12:
            return self.leaf(kind, scope)
        if kind == "b1":
            return self.boolean(scope, depth)
        if r.random() < 0.1:
            return Op(kind, "select", [self.expr("b1", scope, depth - 1),
                                       self.expr(kind, scope, depth - 1),
                                       self.expr(kind, scope, depth - 1)])
        if r.random() < 0.2:
            return self.cast(kind, scope, depth)
        if kind in FLOATS:
            return self.real(kind, scope, depth)
        name = r.choice(ARITHMETIC)
        operands = [self.expr(kind, scope, depth - 1), self.expr(kind, scope, depth - 2)]
        if name in ("<<", ">>"):
            self.use("shifts")
        if name in ("/", "%"):
            self.use("integer-division")
            if r.random() < 0.4:  # divides under a test of the divisor
                return Op(kind, "divif", [operands[0], self.leaf(kind, scope)])
        if name in "+-*" and kind in ("i32", "i64"):
            self.use("wrapping")
        if self.on("bit-tricks") and kind in ("u32", "u64") and r.random() < 0.15:
            self.use("bit-tricks")
            if kind == "u32" and r.random() < 0.5:
                return Op("u32", "bits", [self.expr("f32", scope, depth - 1)])
            return Op(kind, r.choice(["popcount", "rotate"]), [operands[0]])
        return Op(kind, name, operands)

    def boolean(self, scope, depth):
        r = self.random
        kind = r.choice(["i32", "i32", "u32", "f32", "i64", "u64", "f64"])
        if r.random() < 0.6:
            if kind in FLOATS:
                self.use("float-comparison")
            return Op("b1", r.choice(COMPARISONS), [self.expr(kind, scope, depth - 1),
                                                    self.expr(kind, scope, depth - 1)])
        if r.random() < 0.4:
            # A test of some bits, which is neither always true nor false.
            bits = self.expr("u32", scope, depth - 1)
            mask = Op("u32", "&", [bits, Lit("u32", r.choice([1, 2, 3, 5, 8]))])
            return Op("b1", r.choice(["==", "!="]), [mask, Lit("u32", 0)])
        if r.random() < 0.3:
            return Op("b1", "not", [self.expr("b1", scope, depth - 1)])
        return Op("b1", r.choice(["and", "or"]), [self.expr("b1", scope, depth - 1),
                                                  self.expr("b1", scope, depth - 1)])

    def real(self, kind, scope, depth):
        r = self.random
        choice = r.random()
        a = lambda: self.expr(kind, scope, depth - 1)
        if kind == "f32" and choice < 0.12:
            return Op(kind, r.choice(EXACT), [a()])
        if kind == "f32" and choice < 0.18:
            self.use("fma")
            return Op(kind, "fma", [a(), a(), a()])
        if kind == "f32" and choice < 0.3 and self.on("maths"):
            self.use("maths")
            if r.random() < 0.3:
                return Op(kind, r.choice(MATHS2), [a(), a()])
            return Op(kind, r.choice(MATHS), [a()])
        if kind == "f32" and choice < 0.33 and self.on("bit-tricks"):
            self.use("bit-tricks")
            return Op("f32", "frombits", [self.expr("u32", scope, depth - 1)])
        if choice < 0.4:
            return Op(kind, r.choice(["min", "max"]), [a(), a()])
        if choice < 0.45:
            return Op(kind, "neg", [a()])
        return Op(kind, r.choice(["+", "-", "*", "*", "/"]), [a(), a()])

    def cast(self, kind, scope, depth):
        """From another type; `narrow` is int(int8_t(x)) and the like."""
        r = self.random
        self.use("casts")
        others = [k for k in (*INTEGERS, *FLOATS, "b1") if k != kind]
        if kind in FLOATS:
            return Op(kind, "cast", [self.expr(r.choice(others), scope, depth - 1)])
        if kind == "i32" and r.random() < 0.3:
            self.use("narrow-casts")
            return Op("i32", r.choice(["i8", "u8", "i16", "u16"]),
                      [self.expr("i32", scope, depth - 1)])
        if kind == "u32" and r.random() < 0.2:
            self.use("toInt")
            return Op("u32", "toUint", [self.expr("f32", scope, depth - 1)])
        if kind in ("i32", "i64") and r.random() < 0.3:
            self.use("toInt")
            return Op(kind, "toInt", [self.expr("f32", scope, depth - 1)])
        other = r.choice(others)
        if other in FLOATS:
            self.use("float-to-int")
        return Op(kind, "cast", [self.expr(other, scope, depth - 1)])

    def leaf(self, kind, scope):
        """A variable, a field, a query, a load, or a literal."""
        r = self.random
        makers = []
        for name, type, *_ in scope.all("variables"):
            if type == kind:
                makers += [lambda name=name: Var(kind, name)] * 3
        for name, record, *_ in scope.all("records"):
            leaves = [l for l in record.leaves if wide(l.kind) == kind]
            if leaves:
                makers += [lambda n=name, ls=leaves: self.get(n, r.choice(ls), scope)] * 3
        if not scope.uniform:
            for name, type, length, *_ in scope.all("arrays"):
                if type == kind:
                    makers.append(lambda n=name, l=length: Element(
                        kind, n, l, self.index(scope)))
        if kind == "i32":
            makers += [lambda: Query("i32", "domain", r.randrange(self.rank))] * 2
            if scope.bins:
                self.use("bin-queries")
                makers += [lambda: Query("i32", "bin"),
                           lambda: Query("i32", "lo", r.randrange(self.rank)),
                           lambda: Query("i32", "hi", r.randrange(self.rank))]
            if scope.has_size:
                makers.append(lambda: Query("i32", "size"))
        for state in scope.reads or []:
            leaves = [l for l in state.record.leaves if wide(l.kind) == kind]
            if leaves:
                makers.append(lambda s=state, ls=leaves: self.load(s, r.choice(ls), scope))
        if not makers or r.random() < 0.2:
            return self.literal(kind)
        return r.choice(makers)()

    def index(self, scope):
        return self.expr("i32", scope, 1)

    def get(self, name, leaf, scope):
        index = None
        if leaf.count:
            self.use("record-arrays")
            index = self.index(scope) if self.on("dynamic-elements") else \
                Lit("i32", self.random.randrange(leaf.count))
        if leaf.kind in ("i8", "u8", "i16", "u16", "b1", "f64", "i64", "u64"):
            self.use("field-" + leaf.kind)
        if "." in leaf.path:
            self.use("nested-records")
        return Get(wide(leaf.kind), name, leaf, index)

    def load(self, state, leaf, scope):
        self.use("constants" if state.kind == "constant" else "state-reads")
        n = {"constant": 0, "buffer": 1, "image": self.rank}[state.kind]
        # An element is in range; what is computed for it is simple.
        at = [self.expr("i32", Scope(self, scope.phase, scope, reads=[]), 1)
              for _ in range(n)]
        index = None
        if leaf.count:
            index = Lit("i32", self.random.randrange(leaf.count))
        return Load(wide(leaf.kind), state, leaf, at, index)
