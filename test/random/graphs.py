# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Records, state, and the graph of a random pipeline."""

from chains import *


class Graphs(Chains):
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
        if self.on("many-inputs") and self.on("joins") and self.on("several-ports") and \
                n > 1 and r.random() < 0.05:
            self.add_many_edges(pipe)
        if self.on("cycles") and r.random() < 0.25:
            self.add_back_edges(pipe)
            if self.on("joins") and r.random() < 0.6:  # come in at other stages, too
                pipe.sources = [i for i in range(n) if i in self.reachable(pipe, i)
                                and r.random() < 0.5]
        pipe.sources += [i for i in range(n) if i not in {e.consumer for e in pipe.edges
                                                          if e.producer < e.consumer}]
        if r.random() < 0.2 and self.on("joins"):
            pipe.sources.append(r.randrange(n))
        r.shuffle(pipe.sources)
        for edge in pipe.edges:
            pipe.stages[edge.producer].outputs[edge.port] = \
                pipe.stages[edge.consumer].input
        r.shuffle(pipe.edges)

    def add_many_edges(self, pipe):
        """More than are merged at a time, from any stages to one after them."""
        r = self.random
        self.use("many-inputs")
        to = r.randrange(1, len(pipe.stages))
        for _ in range(r.choice([9, 10, 17])):
            outputs = pipe.stages[i := r.randrange(to)].outputs
            pipe.edges.append(Edge(i, len(outputs), to))
            outputs.append(None)

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
        if r.random() < (0.3 if self.on("shading") else 0.15):
            sizes = [0] * self.rank
        return sizes

    def bin_count(self, stage):
        count = 1
        for extent, size in zip(self.domain, stage.bins):
            count *= 1 if size == 0 else -(-extent // size)
        return count
