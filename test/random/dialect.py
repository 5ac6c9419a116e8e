# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Pipelines as text of the piko dialect, at the authored level, for those that
were made without the features of pipelines.CPP_ONLY.

Variables become values. A key names what changes: a variable, or a number of a
record; what changes in a branch or a loop leaves it as a result.
"""

import struct

from model import *

TYPES = {"b1": "i1", "i8": "i8", "u8": "i8", "i16": "i16", "u16": "i16", "i32": "i32",
         "u32": "i32", "i64": "i64", "u64": "i64", "f32": "f32", "f64": "f64"}
MEMORY = {**TYPES, "b1": "i8"}
ATOMICS = {"atomicAdd": "add", "atomicAnd": "and", "atomicOr": "or", "atomicXor": "xor",
           "atomicMin": "min", "atomicMax": "max"}
POLICIES = {"LoadBalance": "load_balance", "DirectMap": "direct_map",
            "Serialize": "serialize", "All": "all"}
PREDICATES = {"<": "lt", "<=": "le", ">": "gt", ">=": "ge"}


def is_signed(kind):
    return kind[0] == "i"


def attribute(kind, value):
    """A constant of a scalar type, as an attribute's value."""
    if kind == "b1":
        return "true" if value else "false"
    if kind in FLOATS:
        bits = struct.pack(">f" if kind == "f32" else ">d", float(value))
        return "0x" + bits.hex().upper()
    if value >= 1 << (8 * SIZES[kind] - 1):
        value -= 1 << 8 * SIZES[kind]
    return str(value)


class DialectPrinter:
    def __init__(self, pipe):
        self.pipe, self.out, self.depth, self.count = pipe, [], 0, 0
        self.env = {}

    def line(self, text):
        self.out.append("  " * self.depth + text)

    def value(self, text, type=None):
        """A new value of an operation."""
        self.count += 1
        name = f"%{self.count}"
        self.line(f"{name} = {text}")
        return name

    def captured(self, make):
        """The lines that `make` writes, and the values that it leaves."""
        saved, self.out = self.out, []
        env = dict(self.env)
        self.depth += 1
        result = make()
        self.depth -= 1
        lines, self.out = self.out, saved
        after, self.env = self.env, env
        return lines, after, result

    # --- Numbers ---------------------------------------------------------------

    def constant(self, kind, value):
        return self.value(f"arith.constant {attribute(kind, value)}" +
                          ("" if kind == "b1" else f" : {TYPES[kind]}"))

    def binary(self, op, a, b, kind):
        return self.value(f"arith.{op} {a}, {b} : {TYPES[kind]}")

    def compare(self, op, a, b, kind):
        if kind in FLOATS:
            predicate = {"==": "oeq", "!=": "une"}.get(op) or "o" + PREDICATES[op]
            return self.value(f"arith.cmpf {predicate}, {a}, {b} : {TYPES[kind]}")
        predicate = {"==": "eq", "!=": "ne"}.get(op) or \
            ("s" if is_signed(kind) else "u") + PREDICATES[op]
        return self.value(f"arith.cmpi {predicate}, {a}, {b} : {TYPES[kind]}")

    def select(self, test, a, b, kind):
        return self.value(f"arith.select {test}, {a}, {b} : {TYPES[kind]}")

    def convert(self, value, source, kind):
        """What a C++ cast gives."""
        a, b = TYPES[source], TYPES[kind]
        if source == kind:
            return value
        if kind == "b1":
            return self.compare("!=", value, self.constant(source, 0), source)
        if source in FLOATS and kind in FLOATS:
            return self.value(f"arith.{'extf' if kind == 'f64' else 'truncf'} "
                              f"{value} : {a} to {b}")
        if source in FLOATS:
            return self.saturate(value, source, kind)
        signed = is_signed(source)
        if kind in FLOATS:
            return self.value(f"arith.{'sitofp' if signed else 'uitofp'} {value} "
                              f": {a} to {b}")
        if SIZES[source] == SIZES[kind] and source != "b1":
            return value
        if source == "b1" or SIZES[source] < SIZES[kind]:
            return self.value(f"arith.{'extsi' if signed else 'extui'} {value} "
                              f": {a} to {b}")
        return self.value(f"arith.trunci {value} : {a} to {b}")

    def saturate(self, value, source, kind):
        bits = 8 * SIZES[kind] - is_signed(kind)
        low = -(2**bits) if is_signed(kind) else 0
        op = "fptosi" if is_signed(kind) else "fptoui"
        inside = self.value(f"arith.{op} {value} : {TYPES[source]} to {TYPES[kind]}")
        high = self.compare(">=", value, self.constant(source, 2.0**bits), source)
        inside = self.select(high, self.constant(kind, 2**bits - 1), inside, kind)
        under = self.compare("<=", value, self.constant(source, low), source)
        inside = self.select(under, self.constant(kind, low), inside, kind)
        number = self.compare("==", value, value, source)
        return self.select(number, inside, self.constant(kind, 0), kind)

    # --- Expressions -------------------------------------------------------------

    def e(self, x):
        return getattr(self, "e_" + type(x).__name__)(x)

    def e_Lit(self, x):
        return self.constant(x.type, x.value)

    def e_Var(self, x):
        return self.env[x.name]

    def widened(self, value, leaf):
        if leaf.kind == "b1":
            zero = self.value("arith.constant 0 : i8")
            return self.value(f"arith.cmpi ne, {value}, {zero} : i8")
        return self.convert(value, leaf.kind, wide(leaf.kind))

    def narrowed(self, value, leaf):
        if leaf.kind == "b1":
            return self.value(f"arith.extui {value} : i1 to i8")
        return self.convert(value, wide(leaf.kind), leaf.kind)

    def field(self, leaf, index):
        name = f'"{leaf.symbol or "value"}"'
        if not leaf.count:
            return name
        at = self.value(f"arith.constant {index.value % leaf.count} : index")
        return f"{name}[{at}]"

    def key(self, base, leaf, index):
        return (base, leaf.path, index.value % leaf.count if leaf.count else 0)

    def e_Get(self, x):
        if x.base == "p":
            field = self.field(x.leaf, x.index)
            record = self.symbol(self.stage.input)
            got = self.value(f"piko.get %p {field} : !piko.prim<{record}> -> "
                             f"{MEMORY[x.leaf.kind]}")
        else:
            got = self.env[self.key(x.base, x.leaf, x.index)]
        return self.widened(got, x.leaf)

    def index_to_i32(self, text):
        return self.value(f"arith.index_cast {self.value(text)} : index to i32")

    def e_Query(self, x):
        if x.kind == "domain":
            return self.index_to_i32(f"piko.domain[{x.dim}]")
        if x.kind == "bin":
            return self.index_to_i32("piko.bin")
        return self.index_to_i32(f"piko.bin_{x.kind} {self.value('piko.bin')}[{x.dim}]")

    def place(self, state, at, fixed=False):
        if state.kind == "constant":
            return f"@{state.name}"
        indices = []
        for d, a in enumerate(at):
            index = self.e(a)
            if not fixed:
                extent = self.index_to_i32(f"piko.extent @{state.name}[{d}]")
                index = self.binary("remui", index, extent, "u32")
            indices.append(index)
        return f"@{state.name}[{', '.join(indices)} : {', '.join(['i32'] * len(at))}]"

    def e_Load(self, x):
        place = self.place(x.state, x.at)
        field = self.field(x.leaf, x.index)
        return self.widened(self.value(f"piko.load {place} {field} : "
                                       f"{MEMORY[x.leaf.kind]}"), x.leaf)

    def e_Op(self, x):
        a = [self.e(o) for o in x.operands]
        k, n = x.type, x.name
        source = x.operands[0].type
        real, signed = k in FLOATS, is_signed(k)
        if n in PREDICATES or n in ("==", "!="):
            return self.compare(n, a[0], a[1], source)
        if real and n in ("+", "-", "*", "/"):
            return self.binary({"+": "addf", "-": "subf", "*": "mulf", "/": "divf"}[n],
                               a[0], a[1], k)
        simple = {"+": "addi", "-": "subi", "*": "muli", "&": "andi", "|": "ori",
                  "^": "xori", "and": "andi", "or": "ori", "umod": "remui"}
        if n in simple:
            return self.binary(simple[n], a[0], a[1], k)
        if n in ("<<", ">>"):
            by = self.binary("andi", a[1], self.constant(k, 8 * SIZES[k] - 1), k)
            op = "shli" if n == "<<" else "shrsi" if signed else "shrui"
            return self.binary(op, a[0], by, k)
        if n in ("/", "%"):
            by = self.binary("andi", a[1], self.constant(k, 15), k)
            by = self.binary("addi", by, self.constant(k, 1), k)
            return self.binary(("div" if n == "/" else "rem") +
                               ("si" if signed else "ui"), a[0], by, k)
        if n == "divif":
            test = self.compare(">", a[1], self.constant(k, 0), k)
            self.count += 1
            name = f"%{self.count}"
            self.line(f"{name} = scf.if {test} -> ({TYPES[k]}) {{")
            divided = self.binary("divsi" if signed else "divui", a[0], a[1], k)
            self.line(f"  scf.yield {divided} : {TYPES[k]}")
            self.line("} else {")
            self.line(f"  scf.yield {a[0]} : {TYPES[k]}")
            self.line("}")
            return name
        if n == "select":
            return self.select(a[0], a[1], a[2], k)
        if n == "not":
            return self.binary("xori", a[0], self.constant("b1", True), "b1")
        if n == "neg":
            return self.value(f"arith.negf {a[0]} : {TYPES[k]}")
        if n in ("cast", "toInt", "toUint"):
            return self.convert(a[0], source, k)
        if n in ("i8", "u8", "i16", "u16"):
            return self.convert(self.convert(a[0], "i32", n), n, "i32")
        if n in ("min", "max"):
            b_is_it = self.compare("<", *(a[::-1] if n == "min" else a), k)
            return self.select(b_is_it, a[1], a[0], k)
        if n == "fma":
            return self.value(f"math.fma {', '.join(a)} : {TYPES[k]}")
        if n == "finite":
            above = self.compare(">", a[0], self.constant(k, 0.0), k)
            below = self.compare("<", a[0], self.constant(k, 3.0), k)
            both = self.binary("andi", above, below, "b1")
            return self.select(both, a[0], self.constant(k, 0.75), k)
        name = {"abs": "absf"}.get(n, n)
        return self.value(f"math.{name} {a[0]} : {TYPES[k]}")

    # --- Statements ----------------------------------------------------------------

    def body(self, body):
        for s in body:
            getattr(self, "s_" + type(s).__name__)(s)

    def s_Let(self, s):
        self.env[s.name] = self.e(s.value)
        self.types[s.name] = TYPES[s.type]

    def s_Assign(self, s):
        self.env[s.name] = self.e(s.value)

    def numbers(self, record):
        for leaf in record.leaves:
            for i in range(leaf.count or 1):
                yield leaf, Lit("i32", i)

    def s_Copy(self, s):
        for leaf, i in self.numbers(s.record):
            key = self.key(s.name, leaf, i)
            self.types[key] = MEMORY[leaf.kind]
            if not s.base:
                self.env[key] = self.value("arith.constant " + (
                    attribute(leaf.kind, 0) if leaf.kind in FLOATS else "0") +
                    f" : {MEMORY[leaf.kind]}")
            elif s.base == "p":
                self.env[key] = self.value(
                    f"piko.get %p {self.field(leaf, i)} : !piko.prim<"
                    f"{self.symbol(self.stage.input)}> -> {MEMORY[leaf.kind]}")
            else:
                self.env[key] = self.env[self.key(s.base, leaf, i)]

    def s_Put(self, s):
        self.env[self.key(s.base, s.leaf, s.index)] = \
            self.narrowed(self.e(s.value), s.leaf)

    def changes(self, *afters):
        """The keys that were there before and have another value after."""
        return [k for k in self.env if any(a[k] != self.env[k] for a in afters)]

    def results(self, keys):
        """New values for what leaves a region."""
        names = []
        for key in keys:
            self.count += 1
            names.append(f"%{self.count}")
        return names

    def yields(self, lines, after, keys):
        types = ", ".join(self.types[k] for k in keys)
        values = ", ".join(after[k] for k in keys)
        for line in lines:
            self.out.append(line)
        if keys:
            self.line(f"  scf.yield {values} : {types}")

    def s_If(self, s):
        test = self.e(s.test)
        then, after, _ = self.captured(lambda: self.body(s.then))
        other, after2, _ = self.captured(lambda: self.body(s.other))
        keys = self.changes(after, after2)
        names = self.results(keys)
        types = ", ".join(self.types[k] for k in keys)
        self.line((f"{', '.join(names)} = " if keys else "") + f"scf.if {test}" +
                  (f" -> ({types})" if keys else "") + " {")
        self.yields(then, after, keys)
        self.line("} else {")
        self.yields(other, after2, keys)
        self.line("}")
        self.env.update(zip(keys, names))

    def s_For(self, s):
        zero, one = self.constant("i32", 0), self.constant("i32", 1)
        bound = self.e(s.bound)
        self.types[s.var] = "i32"

        def run():
            self.env[s.var] = f"%{s.var}"
            self.body(s.body)

        # Once to see what changes, and once for good.
        _, after, _ = self.captured(run)
        keys = self.changes(after)
        names, arguments = self.results(keys), self.results(keys)
        initial = [self.env[k] for k in keys]

        def run_with_arguments():
            self.env.update(zip(keys, arguments))
            run()

        lines, after, _ = self.captured(run_with_arguments)
        types = ", ".join(self.types[k] for k in keys)
        carried = ", ".join(f"{a} = {i}" for a, i in zip(arguments, initial))
        self.line((f"{', '.join(names)} = " if keys else "") +
                  f"scf.for %{s.var} = {zero} to {bound} step {one}" +
                  (f" iter_args({carried}) -> ({types})" if keys else "") + " : i32 {")
        self.yields(lines, after, keys)
        self.line("}")
        self.env.update(zip(keys, names))

    def s_Emit(self, s):
        record = self.stage.outputs[s.port]
        numbers = [(self.env[self.key(s.record, l, i)], MEMORY[l.kind])
                   for l, i in self.numbers(record)]
        self.line(f"piko.emit {s.port} ({', '.join(v for v, _ in numbers)}) : "
                  f"{', '.join(t for _, t in numbers)}")

    def s_Update(self, s):
        at = ", ".join(self.e(a) for a in s.at)
        types = ", ".join(["i32"] * len(s.at))
        px = next((n.base for n in walk(s.body) if getattr(n, "base", "").startswith("px")),
                  "px")
        numbers = list(self.numbers(s.image.record))
        arguments = self.results(numbers)

        def run():
            for (leaf, i), name in zip(numbers, arguments):
                self.env[self.key(px, leaf, i)] = name
                self.types[self.key(px, leaf, i)] = MEMORY[leaf.kind]
            self.body(s.body)
            return self.e(s.result) if s.result else None

        lines, after, result = self.captured(run)
        prefix, suffix = "", ""
        if s.name:
            name = self.results([0])[0]
            prefix, suffix = f"{name} = ", f" -> {TYPES[s.result.type]}"
        self.line(f"{prefix}piko.update @{s.image.name}[{at} : {types}] {{")
        pixel = [(after[self.key(px, l, i)], MEMORY[l.kind]) for l, i in numbers]
        self.line("^bb0(" + ", ".join(f"{a}: {t}" for a, (_, t) in
                                      zip(arguments, pixel)) + "):")
        self.out += lines
        values, kinds = (", ".join(x) for x in zip(*pixel))
        self.line(f"  piko.yield [{values} : {kinds}]" +
                  (f" results [{result} : {TYPES[s.result.type]}]" if s.name else ""))
        self.line("}" + suffix)
        if s.name:
            self.env[s.name] = name
            self.types[s.name] = TYPES[s.result.type]

    def s_Atomic(self, s):
        kind = ATOMICS[s.op]
        if kind in ("min", "max"):
            kind += "_signed" if is_signed(s.leaf.kind) else "_unsigned"
        value = self.e(s.value)
        self.line(f"piko.atomic {kind} {self.place(s.state, s.at)} "
                  f"{self.field(s.leaf, None)}, {value} : {TYPES[s.leaf.kind]}")

    def s_Store(self, s):
        place = self.place(s.state, s.at, fixed=True)
        for leaf, i in self.numbers(s.state.record):
            field = self.field(leaf, i)
            self.line(f"piko.store {self.env[self.key(s.record, leaf, i)]}, {place} "
                      f"{field} : {MEMORY[leaf.kind]}")

    def s_Bins(self, s):
        if s.kind == "all":
            return self.line("piko.assign_all")
        if s.kind == "previous":
            return self.line("piko.assign_previous")
        corners = []
        for corner in (s.lo, s.hi):
            cells = [self.e(c) for c in corner]
            if s.kind == "floatbox":
                cells = [self.convert(self.value(f"math.floor {c} : f32"), "f32", "i32")
                         for c in cells]
            corners.append(", ".join(cells))
        types = ", ".join(["i32"] * len(s.lo))
        if s.kind != "to":
            to = "line" if s.kind == "line" else "box"
            return self.line(f"piko.assign_{to} [{corners[0]} : {types}] to "
                             f"[{corners[1]} : {types}]")
        bin = self.value(f"piko.bin_at {corners[0]} : {types}")
        zero = self.value("arith.constant 0 : index")
        inside = self.value(f"arith.cmpi sge, {bin}, {zero} : index")
        self.line(f"scf.if {inside} {{")
        self.line(f"  piko.assign_to {bin}")
        self.line("}")

    # --- Declarations ----------------------------------------------------------------

    def symbol(self, record):
        return f"@{self.pipe.name}_{record.scalar or record.name}"

    def write_records(self):
        done = set()
        for record in self.pipe.records + [s.record for s in self.pipe.state]:
            if self.symbol(record) in done:
                continue
            done.add(self.symbol(record))
            leaves, size, align = record.layout()
            fields = ", ".join(
                f'"{l.symbol or "value"}" : {MEMORY[l.kind]}' +
                (f"[{l.count} : {l.stride}]" if l.count else "") + f" at {l.offset}"
                for l in leaves)
            self.line(f"piko.record {self.symbol(record)} {{{fields}}} size {size} "
                      f"align {align}")

    def write_state(self, s):
        text = f"piko.{s.kind} @{s.name} : {self.symbol(s.record)}"
        if s.kind == "buffer" and s.source >= 0:
            text += f" per_source {s.source}"
        if s.kind == "image":
            text += f" rank {self.pipe.rank}"
            numbers = [(l.kind, 0 if l.default is None else l.default)
                       for l, _ in self.numbers(s.record)]
            text += " clear [" + ", ".join(
                f"{attribute(k, v) if k in FLOATS else v} : {MEMORY[k]}"
                for k, v in numbers) + "]"
        self.line(text)

    def schedule(self, stage):
        directives = {d.kind: d for d in stage.schedule}
        text = "piko.schedule load_balance"
        specify = directives.get("specifySchedule")
        if specify:
            text = f"piko.schedule {POLICIES[specify.policy]}"
            if specify.value:
                text += f" tile_split {specify.value.value}"
        targets = [self.pipe.stages[d.stage] for d in stage.schedule
                   if d.kind == "endStage"]
        waits = [f"@{s.name.lower()}" for s in self.pipe.stages
                 if s in targets or s.twin_of in targets]
        if waits:
            text += f" end_stage [{', '.join(waits)}]"
        if "endBin" in directives:
            text += " end_bin"
        if "specifyLanes" in directives:
            text += " lanes " + directives["specifyLanes"].policy.lower()
        return text

    def precision(self, stage):
        return "".join(f" precision {d.policy.lower()}" for d in stage.schedule
                       if d.kind == "specifyPrecision")

    def phase(self, name, body):
        self.env, self.types = {}, {}
        if self.stage.template:
            self.env["K"] = "%K"
            self.types["K"] = "i32"
        self.line(f"piko.{name} {{")
        self.line(f"^bb0(%p: !piko.prim<{self.symbol(self.stage.input)}>):")
        self.depth += 1
        self.body(body)
        self.line("piko.return")
        self.depth -= 1
        self.line("}")

    def write(self):
        p = self.pipe
        self.write_records()
        self.line(f"piko.pipeline @{p.name} rank {p.rank} {{")
        self.depth += 1
        for s in p.state:
            self.write_state(s)
        for s in p.sources:
            self.line(f"piko.source @{p.stages[s].name.lower()}")
        for e in p.edges:
            self.line(f"piko.edge @{p.stages[e.producer].name.lower()}[{e.port}] -> "
                      f"@{p.stages[e.consumer].name.lower()}")
        for stage in p.stages:
            self.stage = stage
            outputs = ", ".join(self.symbol(r) for r in stage.outputs)
            self.line(f"piko.stage @{stage.name.lower()} bins {stage.bins} threads "
                      f"{stage.threads} : {self.symbol(stage.input)} -> [{outputs}] {{")
            self.depth += 1
            if stage.assign is not None:
                self.phase("assign", stage.assign)
            self.line(self.schedule(stage))
            self.phase("process" + self.precision(stage), stage.process)
            self.depth -= 1
            self.line("}")
        self.depth -= 1
        self.line("}")
        return "\n".join(self.out) + "\n"


def write_file(pipes):
    return "\n".join(DialectPrinter(p).write() for p in pipes)
