# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Pipelines as C++."""

import re

from model import *

TYPES = {"b1": "bool", "i8": "int8_t", "u8": "uint8_t", "i16": "int16_t",
         "u16": "uint16_t", "i32": "int", "u32": "uint32_t", "i64": "int64_t",
         "u64": "uint64_t", "f32": "float", "f64": "double"}

#: What a stage inherits, where it is called without an object.
OF_BASE = re.compile(
    r"(?<![\w.>:])(emit|update|state|bin|binLo|binHi|domain|parallelFor|"
    r"parallelForPixels|sync|any|all|count|reduce|scan|sort|assignTo\w+|"
    r"binFromPosition|specify\w+|endBin|endStage|batch|everyBin)(<[-\w<>]+>)?(?=\()")

HEADER = """#include <piko.h>
#pragma clang diagnostic ignored "-Wall"
#pragma clang diagnostic ignored "-Winteger-overflow"
#pragma clang diagnostic ignored "-Wdivision-by-zero"
#pragma clang diagnostic ignored "-Wxor-used-as-pow"
"""

#: What bodies call. Bits and signs of NaNs differ between machines, so they
#: are not looked at.
HELPERS = {
    "bits": """inline uint32_t bits(float x) {
  return x == x ? __builtin_bit_cast(uint32_t, x) : 0u;
}
""",
    "frombits": """inline float frombits(uint32_t x) {
  return __builtin_bit_cast(float, x);
}
""",
    "copysign_": """inline float copysign_(float x, float y) {
  return y == y ? piko::copysign(x, y) : x;
}
""",
    "finite": """inline float finite(float x) {
  return x > 0.0f && x < 3.0f ? x : 0.75f;
}
""",
    "rotate": """template <class T> inline T rotate(T x) {
  return x << 5 | x >> (sizeof(T) * 8 - 5);
}
""",
    "helper": """template <class T> inline T helper(T x, int n) {
  for (int i = 0; i < 5; ++i) {
    if (i == (n & 7))
      return x;
    if (n > 3 && i > 2)
      break;
    x = x * T(3) + T(i);
  }
  return x - T(1);
}
""",
    "templated": """template <int N, class T> inline T templated(T x, int n) {
  if constexpr (N > 1)
    return templated<N - 1>(T(x + T(n)), n + 1) * T(N);
  else
    return x;
}
""",
    "countdown": """template <class T> inline T countdown(T x, int n) {
  unsigned left = unsigned(n) & 7;
  while (left--) {
    if (left == 4)
      continue;
    x = x + T(left);
  }
  return x;
}
""",
}


def literal(kind, value):
    if kind == "b1":
        return "true" if value else "false"
    if kind in FLOATS:
        f = "f" if kind == "f32" else ""
        if isinstance(value, str):
            special = {"inf": "__builtin_inf%s()" % f, "nan": '__builtin_nan%s("")' % f}
            text = special[value.lstrip("-")]
            return f"(-{text})" if value[0] == "-" else text
        text = f"{float(value)!r}{f}"
        return f"({text})" if text[0] == "-" else text
    if kind == "i32":
        return "(-2147483647 - 1)" if value == -(2**31) else \
            f"({value})" if value < 0 else str(value)
    if kind == "u32":
        return f"{value}u"
    if kind == "i64":
        return "INT64_MIN" if value == -(2**63) else f"int64_t({value})"
    return f"uint64_t({value}u)"


class CppPrinter:
    def __init__(self, pipe):
        self.pipe, self.out, self.depth = pipe, [], 0

    def line(self, text):
        self.out.append("  " * self.depth + text)

    # --- Expressions -----------------------------------------------------------

    def path(self, base, leaf, index):
        text = base + ("." + leaf.path if leaf.path else "")
        if leaf.count:
            if isinstance(index, Lit):
                at = str(index.value % leaf.count)
            else:
                at = f"uint32_t({self.e(index)}) % {leaf.count}u"
            text = text.replace("[]", f"[{at}]", 1)
        return text

    def e(self, x):
        return getattr(self, "e_" + type(x).__name__)(x)

    def e_Lit(self, x):
        return literal(x.type, x.value)

    def e_Var(self, x):
        return x.name

    def widen(self, x, text):
        return f"int({text})" if wide(x.leaf.kind) != x.leaf.kind else text

    def e_Get(self, x):
        return self.widen(x, self.path(x.base, x.leaf, x.index))

    def e_Item(self, x):
        return self.widen(x, self.path(f"list[{self.e(x.at)}]", x.leaf, x.index))

    def e_Query(self, x):
        return {"bin": "int(bin().index)", "lo": f"binLo()[{x.dim}]",
                "hi": f"binHi()[{x.dim}]", "domain": f"domain()[{x.dim}]",
                "size": "int(list.size())"}[x.kind]

    def place(self, state, at, fixed=False):
        base = f"state().{state.name}"
        if state.kind == "constant":
            return base
        if state.kind == "buffer":
            if fixed:
                return f"{base}[{self.e(at[0])}]"
            return f"{base}[uint32_t({self.e(at[0])}) % uint32_t({base}.size())]"
        return f"{base}({self.cell(at, fixed)})"

    def cell(self, at, fixed):
        cells = [self.e(a) if fixed else
                 f"int(uint32_t({self.e(a)}) % uint32_t(domain()[{d}]))"
                 for d, a in enumerate(at)]
        return f"glm::ivec{len(at)}({', '.join(cells)})"

    def e_Load(self, x):
        return self.widen(x, self.path(self.place(x.state, x.at), x.leaf, x.index))

    def e_Element(self, x):
        return f"{x.array}[uint32_t({self.e(x.at)}) % {x.length}u]"

    def e_Op(self, x):
        a = [self.e(o) for o in x.operands]
        c, n = TYPES[x.type], x.name
        if n in ("<", "<=", ">", ">=", "==", "!=", "+", "-", "*", "&", "|", "^"):
            return f"({a[0]} {n} {a[1]})"
        if n in ("<<", ">>"):
            return f"({a[0]} {n} ({a[1]} & {8 * SIZES[x.type] - 1}))"
        if n in ("/", "%"):
            if x.type in FLOATS:
                return f"({a[0]} {n} {a[1]})"
            return f"({a[0]} {n} (({a[1]} & 15) + 1))"
        if n == "divif":
            return f"({a[1]} > 0 ? {a[0]} / {a[1]} : {a[0]})"
        if n == "umod":
            return f"({a[0]} % {a[1]})"
        if n == "select":
            return f"({a[0]} ? {a[1]} : {a[2]})"
        if n in ("and", "or"):
            return f"({a[0]} {'&&' if n == 'and' else '||'} {a[1]})"
        if n in ("not", "neg"):
            return f"({'!' if n == 'not' else '-'}{a[0]})"
        if n == "cast":
            return f"({a[0]} != 0)" if x.type == "b1" else f"{c}({a[0]})"
        if n in ("i8", "u8", "i16", "u16"):
            return f"int({TYPES[n]}({a[0]}))"
        if n in ("min", "max"):
            return f"piko::{n}<{c}>({a[0]}, {a[1]})"
        if n == "toInt" and x.type == "i64":
            return f"piko::toInt64({a[0]})"
        if n == "popcount":
            return f"{c}(__builtin_popcountll({a[0]}))"
        if n == "copysign":
            return f"copysign_({a[0]}, {a[1]})"
        if n == "templated":
            return f"templated<3, {c}>({', '.join(a)})"
        if n in ("helper", "countdown", "rotate"):
            return f"{n}<{c}>({', '.join(a)})"
        if n in ("bits", "frombits", "finite"):
            return f"{n}({a[0]})"
        return f"piko::{n}({', '.join(a)})"

    def lambda_of(self, kind, op):
        c = TYPES[kind]
        value = f"piko::{op}<{c}>(a, b)" if op in ("min", "max") else f"{c}(a {op} b)"
        return f"[]({c} a, {c} b) {{ return {value}; }}"

    def e_Gather(self, x):
        f = f"[&](int {x.var}) {{ return {self.e(x.value)}; }}"
        n = self.e(x.n)
        if x.kind != "reduce":
            return f"{x.kind}({n}, {f})"
        c = TYPES[x.type]
        return f"reduce<{c}>({n}, {f}, {self.lambda_of(x.type, x.op)}, {c}(7))"

    # --- Statements ------------------------------------------------------------

    def block(self, body, head=None, tail=""):
        if head is not None:
            self.line(head + " {")
        self.depth += 1
        for s in body:
            getattr(self, "s_" + type(s).__name__)(s)
        self.depth -= 1
        if head is not None:
            self.line("}" + tail)

    def s_Let(self, s):
        self.line(f"{TYPES[s.type]} {s.name} = {self.e(s.value)};")

    def s_Assign(self, s):
        self.line(f"{s.name} = {self.e(s.value)};")

    def s_Copy(self, s):
        value = f" = list[{self.e(s.at)}]" if s.at else f" = {s.base}" if s.base else "{}"
        self.line(f"{self.type_of(s.record)} {s.name}{value};")

    def s_Put(self, s):
        c = TYPES[s.leaf.kind]
        value = self.e(s.value)
        if wide(s.leaf.kind) != s.leaf.kind:
            value = f"{c}({value})"
        self.line(f"{self.path(s.base, s.leaf, s.index)} = {value};")

    def s_If(self, s):
        self.block(s.then, f"if ({self.e(s.test)})")
        if s.other:
            self.out[-1] += " else {"
            self.block(s.other)
            self.line("}")

    def s_For(self, s):
        bound = "int(list.size())" if s.list else self.e(s.bound)
        first = self.e(s.first) if s.first else "0"
        self.block(s.body, f"for (int {s.var} = {first}; {s.var} < {bound}; ++{s.var})")

    def s_Jump(self, s):
        value = f" {TYPES[s.value.type]}({self.e(s.value)})" if s.value else ""
        self.line(s.kind + value + ";")

    def s_Switch(self, s):
        self.line(f"switch (uint32_t({self.e(s.value)}) % {len(s.cases)}u) {{")
        last = len(s.cases) - 1
        for i, (body, falls) in enumerate(zip(s.cases, s.falls)):
            self.block(body, f"case {i}:" if i < last else "default:")
            if i < last:
                self.line("  [[fallthrough]];" if falls else "  break;")
        self.line("}")

    def s_Emit(self, s):
        self.line(f"emit({s.record}, {s.port});")

    def s_Update(self, s):
        self.line((f"auto {s.name} = " if s.name else "") +
                  f"update(state().{s.image.name}, {self.cell(s.at, True)}, "
                  f"[&]({self.type_of(s.image.record)} &{self.pixel_name(s)}) {{")
        self.block(s.body)
        if s.result:
            self.line(f"  return {TYPES[s.result.type]}({self.e(s.result)});")
        self.line("});")

    @staticmethod
    def pixel_name(update):
        """Its body says it; a body that is reduced away needs none."""
        for node in walk([update.body, update.result] if update.result else update.body):
            base = getattr(node, "base", "")
            if base.startswith("px"):
                return base
        return "unused"

    def s_Atomic(self, s):
        place = self.path(self.place(s.state, s.at), s.leaf, None)
        fetch = "Fetch" if s.name else ""
        prefix = f"{TYPES[s.leaf.kind]} {s.name} = " if s.name else ""
        self.line(f"{prefix}piko::{s.op}{fetch}({place}, {self.e(s.value)});")

    def s_Store(self, s):
        if s.state.kind == "buffer":
            self.line(f"{self.place(s.state, s.at, True)} = {s.record};")
        else:
            self.line(f"state().{s.state.name}.store({self.cell(s.at, True)}, {s.record});")

    def s_Array(self, s):
        self.line(f"{TYPES[s.type]} {s.name}[{s.length}];")

    def s_Set(self, s):
        at = self.e(s.at) if isinstance(s.at, Var) and s.at.solid else \
            f"uint32_t({self.e(s.at)}) % {s.length}u"
        self.line(f"{s.array}[{at}] = {self.e(s.value)};")

    def s_Parallel(self, s):
        if s.bound is None:
            box = "".join(self.cell(at, True) + ", " for at in (s.lo, s.hi) if at)
            head = f"parallelForPixels({box}[&](glm::ivec{self.pipe.rank} {s.var})"
        else:
            head = f"parallelFor({self.e(s.bound)}, [&](int {s.var})"
        self.block(s.body, head, ");")

    def s_Sync(self, s):
        self.line("sync();")

    def s_Collective(self, s):
        value = self.e(s.value)
        if s.kind in ("reduce", "scan"):
            value += ", " + self.lambda_of(s.type, s.op)
        self.line(f"{TYPES[s.type]} {s.name} = {s.kind}({value});")

    def s_Lambda(self, s):
        self.line(f"{TYPES[s.type]} {s.name} = [&]() -> {TYPES[s.type]} {{")
        self.line(f"  if ({self.e(s.test)})")
        self.line(f"    return {self.e(s.early)};")
        self.line(f"  return {self.e(s.value)};")
        self.line("}();")

    def s_Bins(self, s):
        rank = self.pipe.rank
        if s.kind == "all":
            self.line("assignToAll(p);")
        elif s.kind == "previous":
            self.line("assignToPreviousBins(p);")
        elif s.kind == "to":
            self.line(f"if (piko::BinId b = binFromPosition({self.cell(s.lo, True)}); "
                      "b.index >= 0)")
            self.line("  assignToBin(p, b);")
        elif s.kind == "at":
            self.line(f"assignToBin(p, binFromPosition({self.cell(s.lo, True)}));")
        else:
            vec = "vec" if s.kind == "floatbox" else "ivec"
            to = "Line" if s.kind == "line" else "BoundingBox"
            lo, hi = (", ".join(self.e(c) for c in corner) for corner in (s.lo, s.hi))
            self.line(f"assignTo{to}(p, glm::{vec}{rank}({lo}), "
                      f"glm::{vec}{rank}({hi}));")

    def s_Directive(self, s):
        if s.kind == "specifySchedule":
            split = f", {self.e(s.value)}" if s.value else ""
            self.line(f"specifySchedule(piko::{s.policy}{split});")
        elif s.kind == "endStage":
            self.line(f"endStage<{self.type_name(self.pipe.stages[s.stage])}>();")
        elif s.kind == "batch":
            self.line(f"batch({self.e(s.value)});")
        elif s.kind == "unordered":
            self.line("specifyOrder(piko::Unordered);")
        elif s.kind == "specifyLanes":
            self.line(f"specifyLanes(piko::Lanes::{s.policy});")
        elif s.kind == "specifyPrecision":
            self.line(f"specifyPrecision(piko::Precision::{s.policy});")
        else:
            self.line(f"{s.kind}();")

    # --- Declarations ------------------------------------------------------------

    @staticmethod
    def type_of(record):
        return TYPES[record.scalar] if record.scalar else record.name

    @staticmethod
    def type_name(stage):
        stage = stage.twin_of or stage
        return f"{stage.name}<{stage.template}>" if stage.template else stage.name

    def write_record(self, record, done):
        if record.scalar or record.name in done:
            return
        done.add(record.name)
        for m in record.members:
            if isinstance(m.kind, Record):
                self.write_record(m.kind, done)
        parts = []
        for m in record.members:
            kind = m.kind.name if isinstance(m.kind, Record) else \
                f"glm::{m.kind}" if m.kind.startswith("vec") else TYPES[m.kind]
            default = "" if m.default is None else f" = {m.default}"
            parts.append(f"{kind} {m.name}{f'[{m.count}]' if m.count else ''}{default};")
        self.line(f"struct {record.name} {{ {' '.join(parts)} }};")

    def write_stage(self, stage):
        bins = ", ".join(map(str, stage.bins))
        types = ", ".join(self.type_of(r) for r in [stage.input, *stage.outputs])
        begin = len(self.out)
        if stage.template:
            self.line("template <int K>")
        threads = f"{stage.threads} + 0 * K" if stage.template else stage.threads
        self.line(f"struct {stage.name} : piko::BasicStage<piko::Bins<{bins}>, "
                  f"{threads}, {types}>, piko::Uses<State> {{")
        self.depth += 1
        if stage.assign is not None:
            self.block(stage.assign, f"void assignBin(const {self.type_of(stage.input)} &p)")
        if stage.schedule:
            self.block(stage.schedule, "void schedule(piko::BinId)")
        kind = self.type_of(stage.input)
        argument = f"const piko::List<{kind}> &list" if stage.is_list else f"const {kind} &p"
        self.block(stage.process, f"void process({argument})")
        self.depth -= 1
        self.line("};")
        if stage.template:
            # Its base depends on K.
            self.out[begin + 2:] = [
                OF_BASE.sub(lambda m: "this->" + ("template " if m[2] else "") + m[0], line)
                for line in self.out[begin + 2:]]

    def write(self):
        p = self.pipe
        self.line(f"namespace {p.name.lower()} {{")
        done = set()
        records = p.records + [s.record for s in p.state] + [s.input for s in p.stages]
        for record in records:
            self.write_record(record, done)
        members = []
        for s in p.state:
            kind = self.type_of(s.record)
            if s.kind == "buffer":
                kind = f"piko::Buffer<{kind}>"
            elif s.kind == "image":
                kind = f"piko::Image<{kind}, {p.rank}>"
            members.append(f"{kind} {s.name};")
        self.line("struct State {")
        for m in members:
            self.line("  " + m)
        self.line("};")
        types = [s for s in p.stages if not s.twin_of]
        for s in types:
            self.line(("template <int K> " if s.template else "") + f"struct {s.name};")
        for s in types:
            self.write_stage(s)
        self.line(f"struct {p.name} : piko::Pipe<State> {{")
        for s in p.stages:
            self.line(f"  {self.type_name(s)} {s.name.lower()};")
        self.line(f"  {p.name}() {{")
        for s in p.sources:
            self.line(f"    source({p.stages[s].name.lower()});")
        for e in p.edges:
            self.line(f"    connect({p.stages[e.producer].name.lower()}, {e.port}, "
                      f"{p.stages[e.consumer].name.lower()});")
        for s in p.state:
            if s.source >= 0:
                self.line(f"    allocateForSource(state().{s.name}, {s.source});")
        self.line("  }")
        self.line("};")
        self.line(f"}} // namespace {p.name.lower()}")
        return "\n".join(self.out) + "\n"


def write_file(pipes):
    text = "\n".join(CppPrinter(p).write() for p in pipes)
    helpers = [code for name, code in HELPERS.items()
               if re.search(rf"(?<![\w.:]){name}[<(]", text)]
    return HEADER + "\n" + "".join(helpers) + "\n" + text
