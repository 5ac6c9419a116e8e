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

from phases import *

#: All that can be turned on and off. What a pipeline used is counted under
#: these names and finer ones.
FEATURES = [
    "joins", "several-ports", "collecting", "endStage", "endBin", "lists", "batch",
    "everyBin", "dynamic-schedule", "parallelFor", "nested-parallel", "sync",
    "lanes-of-iterations", "precision",
    "collectives", "gather", "cycles", "unordered", "fetch-atomics", "float-atomics",
    "updates", "atomics", "stores", "maths", "bit-tricks", "float-specials",
    "dynamic-elements", "loop-jumps", "early-returns", "switches", "lambdas",
    "helpers", "template-stages", "local-arrays", "appends", "twin-stages", "chains",
    "many-inputs", "selections", "shading",
]
#: What the dialect's printer does not write: C++ that the front end removes.
CPP_ONLY = {"maths", "loop-jumps", "early-returns", "switches", "lambdas", "helpers",
            "template-stages", "bit-tricks", "dynamic-elements", "local-arrays",
            "appends"}

#: What the printer of the dialect does not write yet.
NOT_IN_TEXT = {"lists", "parallelFor", "gather", "dynamic-schedule", "fetch-atomics",
               "chains"}

DOMAINS = {1: [1, 3, 7, 40, 65], 2: [1, 3, 7, 13, 17], 3: [1, 2, 5, 7], 4: [1, 2, 3, 5]}
LIMIT = 20000  # calls of Process, about


class Generator(Phases):
    def __init__(self, seed, features, name):
        self.random = random.Random(seed)
        self.features, self.used = features, set()
        self.names, self.name = 0, name
        self.operations = {}
        self.selections = {}
        self.nonempty = set()
        self.links = {}  # of stages in a chain

    def on(self, feature):
        return feature in self.features

    def use(self, *features):
        self.used.update(features)

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
            self.choose_lanes(stage, self.links.get(i))
            self.choose_precision(stage)
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

    def count_entries(self, pipe):
        """At how many stages of one cycle primitives come in."""
        ways = [self.reachable(pipe, i) for i in range(len(pipe.stages))]
        cycles = {frozenset(j for j in ways[i] if i in ways[j])
                  for i in range(len(pipe.stages)) if i in ways[i]}
        return max([0] + [sum(i in pipe.sources or any(
            e.consumer == i and e.producer not in cycle for e in pipe.edges)
            for i in cycle) for cycle in cycles])

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
        if self.count_entries(pipe) > 1:
            self.use("several-entries")
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
