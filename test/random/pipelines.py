# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Random pipelines: records, state, a graph, and for each stage its bins,
directives and bodies.

The rules of docs/Language.md that make a result determined are kept by
construction:

* each image has one stage that updates or stores it, or is only changed by
  atomics; a place has one kind of atomic;
* state that is written is read only by stages that wait for all its writers;
* a stage waits only for stages that it cannot reach, by edges or waits;
* each way round a cycle has an edge on which `hops` is counted down;
* what follows an unordered stage changes state only by integer atomics;
* of two stages of one type, none updates or stores state.
"""

import random
from dataclasses import replace

from chains import *

#: All that can be turned on and off. What a pipeline used is counted under
#: these names and finer ones.
FEATURES = [
    "joins", "several-ports", "collecting", "endStage", "endBin", "lists", "batch",
    "everyBin", "dynamic-schedule", "parallelFor", "nested-parallel", "sync",
    "collectives", "gather", "cycles", "unordered", "fetch-atomics", "float-atomics",
    "updates", "atomics", "stores", "maths", "bit-tricks", "float-specials",
    "dynamic-elements", "loop-jumps", "early-returns", "switches", "lambdas",
    "helpers", "template-stages", "local-arrays", "twin-stages", "chains",
]
#: What the dialect's printer does not write: C++ that the front end removes.
CPP_ONLY = {"maths", "loop-jumps", "early-returns", "switches", "lambdas", "helpers",
            "template-stages", "bit-tricks", "dynamic-elements", "local-arrays"}

#: What the printer of the dialect does not write yet.
NOT_IN_TEXT = {"lists", "parallelFor", "gather", "dynamic-schedule", "fetch-atomics",
               "chains"}

DOMAINS = {1: [1, 3, 7, 40, 65], 2: [1, 3, 7, 13, 17], 3: [1, 2, 5, 7], 4: [1, 2, 3, 5]}
LIMIT = 20000  # calls of Process, about


class Generator(Chains):
    def __init__(self, seed, features, name):
        self.random = random.Random(seed)
        self.features, self.used = features, set()
        self.names, self.name = 0, name
        self.operations = {}
        self.nonempty = set()
        self.links = {}  # of stages in a chain

    def on(self, feature):
        return feature in self.features

    def use(self, *features):
        self.used.update(features)

    # --- Records and state ---------------------------------------------------

    def record(self, name, fixed=(), count=None):
        r = self.random
        members = [Member(*m) for m in fixed]
        kinds = ["i32", "i32", "u32", "f32", "f32", "f64", "i64", "u64", "i8", "u8", "i16",
                 "u16", "b1"]
        for i in range(count if count is not None else r.randint(1, 4)):
            choice = r.random()
            if choice < 0.12:
                inner = Record(f"{name}In{i}", [Member("a", r.choice(kinds)),
                                                Member("b", r.choice(kinds))])
                members.append(Member(f"n{i}", inner, r.choice([0, 0, 2])))
            elif choice < 0.22:
                self.use("glm-fields")
                members.append(Member(f"g{i}", f"vec{r.randint(2, 4)}"))
            else:
                count_ = r.choice([0, 0, 0, 0, 2, 3])
                members.append(Member(f"f{i}", r.choice(kinds), count_))
        r.shuffle(members)
        return Record(name, members)

    def make_records(self):
        r = self.random
        fixed = [("hops", "i32"), ("x", "i32"), ("y", "u32"), ("w", "f32")]
        records = [self.record(f"R{i}", fixed) for i in range(r.choice([1, 1, 2, 3]))]
        return records

    def make_state(self):
        r = self.random
        state = []
        for i in range(r.randint(0, 2)):
            record = Record("", scalar=r.choice(["i32", "f32", "u32", "f64", "i64"])) \
                if r.random() < 0.5 else self.record(f"C{i}")
            state.append(State(f"constant{i}", "constant", record))
        for i in range(r.randint(0, 1)):
            state.append(State(f"table{i}", "buffer", self.record(f"T{i}")))
        for i in range(r.randint(1, 2)):
            kinds = r.sample(["i32", "u32", "i64", "u64"], r.randint(1, 3))
            record = Record(f"H{i}", [Member(f"s{j}", k) for j, k in enumerate(kinds)])
            if r.random() < 0.3:
                record = Record("", scalar=kinds[0])
            state.append(State(f"shared{i}", r.choice(["buffer", "buffer", "image"]),
                               record))
        return state

    def pixel(self, name):
        record = self.record(name, [("h", "u32")], self.random.randint(0, 3))
        for m in record.members:
            if not isinstance(m.kind, Record) and not m.count and m.kind in SIZES:
                if self.random.random() < 0.4:
                    m.default = 1 if m.kind == "b1" else self.random.randrange(8)
        return record

    # --- The graph -------------------------------------------------------------

    def make_graph(self, pipe):
        r = self.random
        n = r.choice([1, 2, 2, 3, 3, 4, 5])
        order = list(range(n))
        for i in range(n):
            ports = 0 if i == n - 1 else r.choice([0, 1, 1, 1, 2, 2])
            if not self.on("several-ports"):
                ports = min(ports, 1)
            bins = self.make_bins() if i == 0 or r.random() < 0.6 else pipe.stages[-1].bins
            pipe.stages.append(Stage(f"S{i}", bins, r.choice([1, 8, 32, 64]),
                                     r.choice(pipe.records), []))
            pipe.stages[i].outputs = [None] * ports
            if self.on("template-stages") and r.random() < 0.15:
                self.use("template-stages")
                pipe.stages[i].template = r.choice([3, -7, 100])
        fed = set()
        for i, stage in enumerate(pipe.stages):
            for port in range(len(stage.outputs)):
                to = r.randint(i + 1, n - 1)
                if to in fed and not self.on("joins"):
                    fresh = [t for t in range(i + 1, n) if t not in fed]
                    if not fresh:
                        stage.outputs = stage.outputs[:port]
                        break
                    to = fresh[0]
                fed.add(to)
                pipe.edges.append(Edge(i, port, to))
        if self.on("cycles") and r.random() < 0.25:
            self.add_back_edges(pipe)
        pipe.sources = [i for i in range(n) if i not in {e.consumer for e in pipe.edges
                                                         if e.producer < e.consumer}]
        if r.random() < 0.2 and self.on("joins"):
            pipe.sources.append(r.randrange(n))
        r.shuffle(pipe.sources)
        for edge in pipe.edges:
            pipe.stages[edge.producer].outputs[edge.port] = \
                pipe.stages[edge.consumer].input
        r.shuffle(pipe.edges)

    def add_back_edges(self, pipe):
        r = self.random
        for _ in range(r.choice([1, 1, 2])):
            i = r.randrange(len(pipe.stages))
            if len(pipe.stages[i].outputs) > 2:
                continue
            reach = [j for j in range(i + 1) if i in self.reachable(pipe, j) or i == j]
            to = r.choice(reach)
            self.use("self-loops" if to == i else "long-cycles")
            pipe.edges.append(Edge(i, len(pipe.stages[i].outputs), to))
            pipe.stages[i].outputs.append(None)

    @staticmethod
    def reachable(pipe, stage, waits=()):
        """The stages that a stage comes before, by edges and waits."""
        found, work = set(), [stage]
        while work:
            at = work.pop()
            following = [e.consumer for e in pipe.edges if e.producer == at] + \
                [b for a, b in waits if a == at]
            for to in following:
                if to not in found:
                    found.add(to)
                    work.append(to)
        return found

    def make_bins(self):
        r = self.random
        sizes = []
        for d in range(self.rank):
            extent = self.domain[d]
            size = r.choice([0, 0, 1, 2, 3, 4, 5, 8, 16])
            # Not too many bins.
            while size and -(-extent // size) > (24, 24, 5, 4, 3)[self.rank]:
                size *= 2
            sizes.append(size)
        if r.random() < 0.15:
            sizes = [0] * self.rank
        return sizes

    def bin_count(self, stage):
        count = 1
        for extent, size in zip(self.domain, stage.bins):
            count *= 1 if size == 0 else -(-extent // size)
        return count

    # --- A stage -----------------------------------------------------------------

    def describe(self, pipe, index):
        """Decides what a stage is before its bodies are made."""
        r = self.random
        stage = pipe.stages[index]
        # What collects is not fused into a stage, so that there is less of it in
        # most chains; in the others, what waits for its bin follows it.
        inside = index in self.links
        share = self.collecting_share if inside else 1
        if self.on("lists") and r.random() < 0.3 * share:
            stage.is_list = True
            self.use("lists")
        choices = [j for j in range(len(pipe.stages))
                   if j != index and j not in self.reachable(pipe, index, self.waits)
                   and index in range(len(pipe.stages))]
        # Nobody waits for a stage of its own cycle, or for one behind it.
        if choices and self.on("endStage") and r.random() < (0.045 if inside else 0.3):
            for target in r.sample(choices, min(len(choices), r.choice([1, 1, 2]))):
                self.waits.append((target, index))
                stage.schedule.append(Directive("endStage", stage=target))
                self.use("endStage")
        if self.on("endBin") and r.random() < 0.12 * share:
            stage.schedule.append(Directive("endBin"))
            self.use("endBin")

    def make_schedule(self, stage, scope, link=None):
        r = self.random
        policies = ["LoadBalance", "DirectMap", "Serialize", "All"]

        def specify():
            policy = r.choice(policies)
            self.use("schedule-" + policy)
            value = None
            if policy == "All" and r.random() < 0.7:
                self.use("tile-split")
                value = lit(r.choice([1, 3, 16, 100]))
            return Directive("specifySchedule", policy, value)

        out = []
        if link and link.schedule is not None:
            out += [replace(d) for d in link.schedule]
        elif r.random() < 0.6:
            if self.on("dynamic-schedule") and r.random() < 0.3:
                self.use("dynamic-schedule")
                out.append(If(self.expr("b1", scope, 2), [specify()], [specify()]))
            else:
                out.append(specify())
        if stage.is_list and self.on("batch") and r.random() < 0.4:
            self.use("batch")
            if self.on("dynamic-schedule") and r.random() < 0.4:
                self.use("dynamic-batch")
                size = op("+", op("&", self.expr("i32", scope, 2), lit(7)), lit(1))
            else:
                size = lit(r.choice([1, 2, 3, 16, 1000]))
            out.append(Directive("batch", value=size))
        if stage.is_list and self.on("everyBin") and r.random() < 0.4:
            self.use("everyBin")
            directive = Directive("everyBin")
            if self.on("dynamic-schedule") and r.random() < 0.4:
                self.use("dynamic-everyBin")
                directive = If(self.expr("b1", scope, 2), [directive])
            out.append(directive)
        stage.schedule += out

    def make_assign_phase(self, pipe, index):
        """Also how many bins a primitive can be in."""
        r = self.random
        stage = pipe.stages[index]
        bins = self.bin_count(stage)
        producers = [pipe.stages[e.producer] for e in pipe.edges if e.consumer == index]
        previous = producers and index not in pipe.sources and \
            all(p.bins == stage.bins for p in producers)
        if all(b == 0 for b in stage.bins) and r.random() < 0.6:
            self.use("no-assign")
            if index in self.links:
                self.chain_no_assign(index)
            return 1
        scope = Scope(self, "assign", None, level=0, multiplicity=1, reads=self.readable)
        scope.records.append(("p", stage.input))
        if stage.input.scalar:
            scope.records = [("p", stage.input)]
        stage.assign = self.body(scope, r.randint(0, 2), 1)
        made = self.chain_assign(pipe, index, scope) if index in self.links else None
        if made:
            stage.assign += made
            return 1
        kind = r.choice(["to", "to", "to", "box", "floatbox", "all", "several", "cond"] +
                        (["previous"] * 4 if previous else []))
        if kind == "all" and bins > 6:
            kind = "to"
        if kind == "several":
            self.use("assign-several")
            stage.assign += [If(self.expr("b1", scope, 2), self.bins("to", scope),
                                self.bins("box", scope)), *self.bins("to", scope)]
            return min(bins, 9)
        if kind == "cond":
            self.use("assign-in-loop")
            var = self.fresh("k")
            inner = self.inside(scope)
            inner.variables.append((var, "i32"))
            stage.assign.append(For(var, op("&", self.expr("i32", scope, 2), lit(3)),
                                    self.bins("to", inner)))
            return min(bins, 3)
        made = self.bins(kind, scope)
        if r.random() < 0.25:
            self.use("culling")
            made = [If(self.expr("b1", scope, 2), made)]
        stage.assign += made
        return {"to": 1, "previous": 1, "all": bins}.get(kind, min(bins, 8))

    def bins(self, kind, scope):
        r = self.random
        self.use("assign-" + kind)
        if kind in ("all", "previous"):
            return [Bins(kind)]
        cells = self.cells_of(scope)
        if kind == "to":
            if r.random() < 0.3:  # outside at times: culled
                cells[0] = op("+", cells[0], lit(r.choice([-1, 1, 3])))
            return [Bins("to", cells)]
        if kind == "box":
            near = [op("-", c, lit(r.choice([0, 0, 1, 2]))) for c in cells]
            far = [op("+", c, lit(r.choice([-1, 0, 0, 1, 2]))) for c in cells]
            return [Bins("box", near, far)]
        real = [Op("f32", "cast", [c], solid=True) for c in cells]
        span = Op("f32", "finite", [self.expr("f32", scope, 2)], solid=True)
        near = [Op("f32", "-", [c, Lit("f32", r.choice([0.0, 0.5, 1.25]), solid=True)],
                   solid=True) for c in real]
        far = [Op("f32", "+", [c, span], solid=True) for c in real]
        return [Bins("floatbox", near, far)]

    def make_process(self, pipe, index, calls_per_bin):
        r = self.random
        stage = pipe.stages[index]
        self.stage, self.stage_number = stage, index
        self.bounds = {}
        self.most_emits = r.choice([1, 2, 4]) if index in self.links else None
        scope = Scope(self, "process", None, level=0, multiplicity=1, bins=True,
                      reads=self.reads[index], has_size=stage.is_list or None)
        body = []
        if stage.template:
            scope.variables.append(("K", "i32"))
        if not stage.is_list:
            scope.records.append(("p", stage.input))
        else:
            body += self.list_loop(scope)
        if self.on("gather") and r.random() < 0.3:
            body += self.gather(scope)
        body += self.body(scope, r.randint(1, 3))
        if self.on("parallelFor") and r.random() < 0.4:
            body += self.make_parallel(scope)
        body += self.pixels(scope, calls_per_bin)
        for state, how in self.writes:
            if how == "update" and not any(
                    isinstance(s, Update) and s.image is state for s in walk(body)):
                body += self.update(state, self.own_cell(scope), scope)
            if how == "store-serial":
                serial = Get("i32", "p", stage.input.leaf("serial"), solid=True)
                body += self.store(state, [serial], scope)
        for port in range(len(stage.outputs)):
            if port not in self.bounds:
                body += self.emission(port, scope)
        for state, how in self.writes:
            if how == "ticket":
                body += self.ticket(state, scope)
        stage.process = body

    def list_loop(self, scope):
        """A loop over the list, whose variables the rest of the body sees."""
        kind = self.random.choice(["i32", "f32", "u64"])
        total, var, element = self.fresh("v"), self.fresh("k"), self.fresh("e")
        scope.variables.append((total, kind))
        inner = self.inside(scope, loops=True)
        inner.variables.append((var, "i32"))
        if not self.stage.input.scalar:
            inner.records.append((element, self.stage.input))
        body = [Copy(element, self.stage.input, "", Var("i32", var, solid=True), solid=True),
                Assign(total, Op(kind, "+", [Op(kind, "*", [Var(kind, total), Lit(kind, 3)]),
                                             self.expr(kind, inner, 2)]))]
        body += self.body(inner, self.random.randint(0, 2), 1)
        return [Let(total, kind, Lit(kind, 1)), For(var, None, body, list=True)]

    def pixels(self, scope, calls_per_bin):
        """What only a parallelForPixels may do: store or update each pixel of
        the bin once."""
        stored = [s for s, how in self.writes if how == "store-pixels"]
        updated = [s for s, how in self.writes if how == "update"]
        cells = 1
        for extent, size in zip(self.domain, self.stage.bins):
            cells *= min(size, extent) if size else extent
        if not stored and (not self.on("parallelFor") or calls_per_bin * cells > 3000
                           or self.random.random() > 0.3):
            return []
        self.use("pixels-in-list" if scope.has_size else "pixels-in-one")
        var = self.fresh("at")
        inner = self.inside(scope, level=scope.level + 1,
                            multiplicity=scope.multiplicity * cells)
        at = []
        for d in range(self.rank):
            inner.variables.append((f"{var}[{d}]", "i32"))
            at.append(Var("i32", f"{var}[{d}]", solid=True))
        body = self.body(inner, 1, 1) if cells < 64 else []
        if stored:
            body += self.store(stored[0], at, inner)
        elif updated:
            body += self.update(updated[0], at, inner)
        return [Parallel(var, None, body)]

    def ticket(self, state, scope):
        """Unordered: each call draws a number; that it is drawn is written, and
        who drew it is not."""
        self.use("fetch-atomics")
        name = self.fresh("v")
        out = [Atomic("atomicAdd", state, [lit(0)], state.record.leaf("next"),
                      Lit("i32", 1, solid=True), name, solid=True)]
        drawn = Var("i32", name, solid=True)
        out.append(Atomic("atomicAdd", state, [op("&", drawn, lit(63))],
                          state.record.leaf("drawn"), Lit("i32", 1, solid=True)))
        # With one operand in all calls, what they get is the same set in any order.
        mark = state.record.leaf("mark")
        kind, old = self.random.choice(
            ["atomicAdd", "atomicMin", "atomicMax", "atomicAnd", "atomicOr",
             "atomicXor"]), self.fresh("v")
        self.use(f"{kind}Fetch-{mark.kind}")
        out.append(Atomic(kind, state, [lit(0)], mark, self.literal(mark.kind), old,
                          solid=True))
        seen = Op("i32", "cast", [Var(mark.kind, old, solid=True)], solid=True)
        out.append(Atomic("atomicAdd", state, [op("&", seen, lit(63))],
                          state.record.leaf("seen"), Lit("i32", 1, solid=True)))
        if self.on("float-atomics"):
            for name, kind in [("exact", "f32"), ("exact_wide", "f64")]:
                self.use("float-atomics-" + kind)
                # Sums of small whole numbers are exact in any order, from where
                # piko-compare lets fields of these names begin.
                whole = Op(kind, "cast", [op("&", self.expr("i32", scope, 2), lit(7))],
                           solid=True)
                at = [op("&", self.expr("i32", scope, 1), lit(63))]
                out.append(Atomic("atomicAdd", state, at, state.record.leaf(name), whole,
                                  solid=True))
        return out

    # --- All of it -----------------------------------------------------------------

    def share_state(self, pipe, bounds):
        """Who writes what, and who may read it: `writes` and `reads` of each
        stage. What a stage reads is never written by one that it does not wait
        for."""
        r = self.random
        self.stage_writes = [[] for _ in pipe.stages]
        self.readable = [s for s in pipe.state
                         if s.kind == "constant" or s.name.startswith("table")]
        shared = [s for s in pipe.state if s.name.startswith("shared")]
        writers = {}
        unordered = {i for i, s in enumerate(pipe.stages) if any(
            isinstance(d, Directive) and d.kind == "unordered" for d in s.schedule)}
        loose = set(unordered)
        for i in unordered:
            loose |= self.reachable(pipe, i)
        for i, stage in enumerate(pipe.stages):
            for s in shared:
                if r.random() < 0.7:
                    self.stage_writes[i].append((s, "atomic"))
                    writers.setdefault(s.name, set()).add(i)
            if i in loose:
                if i in unordered and self.on("fetch-atomics"):
                    state = State(f"tickets{i}", "buffer", Record(
                        f"Tickets{i}", [Member("next", "i32"), Member("drawn", "i32"),
                                        Member("mark", r.choice(INTEGERS)),
                                        Member("seen", "i32"), Member("exact", "f32"),
                                        Member("exact_wide", "f64")]))
                    pipe.state.append(state)
                    self.stage_writes[i].append((state, "ticket"))
                continue
            if self.on("updates") and r.random() < 0.7 or len(pipe.stages) == 1:
                how = "update"
                in_cycle = i in self.reachable(pipe, i)
                if stage.is_list and self.on("parallelFor") and self.on("stores") and \
                        not in_cycle and r.random() < 0.4 and not any(
                            isinstance(d, Directive) and d.kind == "batch"
                            for s in stage.schedule for d in walk(s)):
                    how = "store-pixels"
                image = State(f"image{i}", "image", self.pixel(f"Pixel{i}"))
                pipe.state.append(image)
                self.stage_writes[i].append((image, how))
                writers[image.name] = {i}
            if self.on("stores") and not stage.is_list and bounds[i] == 1 and \
                    i in pipe.sources and pipe.sources.count(i) == 1 and \
                    not any(e.consumer == i for e in pipe.edges) and r.random() < 0.5:
                source = pipe.sources.index(i)
                if not stage.input.leaf("serial"):
                    stage.input.members.append(Member("serial", "i32"))
                buffer = State(f"kept{i}", "buffer",
                               r.choice([Record("", scalar="f32"), self.record(f"K{i}")]),
                               source)
                pipe.state.append(buffer)
                self.stage_writes[i].append((buffer, "store-serial"))
                writers[buffer.name] = {i}
        self.reads = []
        for i, stage in enumerate(pipe.stages):
            reads = list(self.readable)
            waited = {a for a, b in self.waits if b == i}
            for s in pipe.state:
                who = writers.get(s.name)
                if who and who <= waited and i not in who and not (who & loose):
                    reads += [s] * 2
                    if s.source >= 0:  # so that there is an element to read
                        self.nonempty.add(s.source)
                    self.use("reads-after-wait")
            self.reads.append(reads)

    def count_calls(self, pipe, bounds, emits):
        """About how often Process is called for one input of each source."""
        arriving = [float(pipe.sources.count(i)) for i in range(len(pipe.stages))]
        first = list(arriving)
        for _ in range(12 if any(i in self.reachable(pipe, i)
                                 for i in range(len(pipe.stages))) else len(pipe.stages)):
            following = list(first)
            for e in pipe.edges:
                calls = arriving[e.producer] * bounds[e.producer]
                following[e.consumer] += min(calls * emits[e.producer].get(e.port, 0), 1e9)
            arriving = following
        return sum(a * b for a, b in zip(arriving, bounds))

    def generate(self):
        r = self.random
        rank = r.choice([1, 2, 2, 2, 3, 4])
        self.use(f"rank-{rank}")
        self.rank = rank
        self.domain = [r.choice(DOMAINS[rank]) for _ in range(rank)]
        pipe = Pipeline(self.name, self.domain, self.make_records(), self.make_state())
        self.make_graph(pipe)
        if self.on("chains") and r.random() < 0.6:
            if r.random() < 0.5:  # nothing else
                pipe.stages, pipe.edges, pipe.sources = [], [], []
            self.add_chain(pipe)
        self.waits = []
        for i in range(len(pipe.stages)):
            self.describe(pipe, i)
        if self.on("unordered") and r.random() < 0.15:
            self.make_unordered(pipe)
        bounds, emits = [], []
        self.readable = [s for s in pipe.state
                         if s.kind == "constant" or s.name.startswith("table")]
        for i, stage in enumerate(pipe.stages):
            self.make_schedule(stage, Scope(
                self, "schedule", None, level=0, bins=True,
                reads=[s for s in pipe.state if s.kind == "constant"]), self.links.get(i))
            bounds.append(self.make_assign_phase(pipe, i))
        self.share_state(pipe, bounds)
        for i, stage in enumerate(pipe.stages):
            self.writes = self.stage_writes[i]
            self.ports = [(stage.outputs[e.port], e.consumer <= i, self.link_of(e))
                          for e in sorted((e for e in pipe.edges if e.producer == i),
                                          key=lambda e: e.port)]
            with self.fewer_barriers(i):
                self.make_process(pipe, i, 1 if stage.is_list else 30)
            emits.append(self.bounds)
        if self.on("twin-stages") and r.random() < 0.3:
            self.add_twin(pipe, bounds, emits)
        self.finish(pipe, bounds, emits)
        pipe.used = self.used
        return pipe

    def add_twin(self, pipe, bounds, emits):
        """A second stage of one type. It takes over an edge to the first or has a
        source of its own, and emits to the same stages."""
        r = self.random
        candidates = [i for i, writes in enumerate(self.stage_writes)
                      if i not in self.reachable(pipe, i)
                      and not (i in self.links and self.links[i].fed)
                      and all(how in ("atomic", "ticket") for _, how in writes)]
        if not candidates:
            return
        i = r.choice(candidates)
        stage, twin = pipe.stages[i], len(pipe.stages)
        into = [e for e in pipe.edges if e.consumer == i]
        if into and len(into) + pipe.sources.count(i) > 1:
            self.use("twin-by-edge")
            r.choice(into).consumer = twin
        elif any(isinstance(s, Bins) and s.kind == "previous"
                 for s in walk(stage.assign or [])):
            return
        else:
            self.use("twin-by-source")
            pipe.sources.append(twin)
        self.use("twin-stages")
        pipe.edges += [Edge(twin, e.port, e.consumer) for e in pipe.edges
                       if e.producer == i]
        pipe.stages.append(replace(stage, name=f"{stage.name}Twin", twin_of=stage,
                                   outputs=list(stage.outputs)))
        bounds.append(bounds[i])
        emits.append(emits[i])

    def make_unordered(self, pipe):
        """Makes a stage unordered, of which nobody later sees the order."""
        r = self.random
        candidates = [i for i in range(len(pipe.stages)) if not any(
            pipe.stages[j].is_list or i == j
            for j in self.reachable(pipe, i)) and not pipe.stages[i].is_list]
        if candidates:
            i = r.choice(candidates)
            pipe.stages[i].schedule.append(Directive("unordered"))
            self.use("unordered")
            if i in self.links and r.random() < 0.6:
                self.use("unordered-chains")
                for j in self.reachable(pipe, i) & set(self.links):
                    pipe.stages[j].schedule.append(Directive("unordered"))

    def finish(self, pipe, bounds, emits):
        r = self.random
        calls = max(self.count_calls(pipe, bounds, emits), 1)
        most = max(1, int(LIMIT / calls))
        for i in range(len(pipe.sources)):
            n = min(r.choice([0, 1, 2, 17, 60, 150, 300]), most)
            pipe.counts.append(max(n, 1) if i in self.nonempty else n)
        if not any(pipe.counts):
            pipe.counts[0] = min(40, most)
        pipe.input_seed = r.randrange(1 << 30)
        self.count_shapes(pipe)

    def count_shapes(self, pipe):
        """Counts what the graph and its grids look like."""
        self.use("one-source" if len(pipe.sources) == 1 else "several-sources")
        drains = sum(not s.outputs for s in pipe.stages)
        self.use("one-drain" if drains == 1 else "several-drains")
        into = [sum(e.consumer == i for e in pipe.edges) for i in range(len(pipe.stages))]
        if max(into) > 1:
            self.use("joins")
        if any(into[i] and i in pipe.sources for i in range(len(pipe.stages))):
            self.use("source-and-edge")
        if any(len(s.outputs) > 1 for s in pipe.stages):
            self.use("several-ports")
        for s in pipe.stages:
            if s.is_list and any(e.consumer == pipe.stages.index(s) and
                                 s in [pipe.stages[j] for j in self.reachable(
                                     pipe, pipe.stages.index(s))] for e in pipe.edges):
                self.use("rounds")
            if all(b == 0 for b in s.bins):
                self.use("whole-domain")
            elif 0 in s.bins:
                self.use("whole-in-one-dimension")
            if any(b and e % b for b, e in zip(s.bins, self.domain)):
                self.use("partial-bins")
        for n in pipe.counts:
            self.use("empty-source" if n == 0 else
                     "one-primitive" if n == 1 else "many-primitives")


def generate(seed, features, name):
    return Generator(seed, features, name).generate()
