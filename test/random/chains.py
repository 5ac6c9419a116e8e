# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Chains: stages with the same bins, each fed by one other, whose primitives
mostly stay in the bin that they are emitted from. These are what the compiler
fuses, if it sees that they stay.

A stage's *cells* say where a primitive is that it processes: "position" (in its
fields c0, c1, ...) or "function" (computed from x, y and w, alike in the whole
chain). They are only said where that cell is in the bin for certain, so that the
stage may update the pixel there.
"""

import random
from contextlib import contextmanager
from dataclasses import dataclass

from statements import *

#: What a chain's function of the bin may read, in every record of a chain.
KEPT = Record("Kept", [Member("x", "i32"), Member("y", "u32"), Member("w", "f32")])


@dataclass
class Link:
    """A stage of a chain. `fed` says what reaches it: primitives whose position
    is in the bin ("range"), those with x, y and w of the producer's ("function"),
    others ("anyhow"), or, for the first stage, "" for all that reaches it."""

    fed: str = ""
    cells: str = ""
    schedule: object = None  # directives, or None for any


class Chains(Statements):
    def add_chain(self, pipe):
        """After a stage that there is, or a new one with a source."""
        r = self.random
        self.use("chains")
        self.function_seed = r.random()
        self.collecting_share = r.choice([0.15, 0.15, 1.5])
        self.constant = [s for s in pipe.state
                         if s.kind == "constant" or s.name.startswith("table")]
        kind = r.choice(["i32"] * 6 + ["i64", "i16", "u32"])
        fixed = [(m.name, m.kind) for m in KEPT.members] + [("hops", "i32")] + \
            [(f"c{d}", kind) for d in range(self.rank)]
        records = [self.record(f"N{i}", fixed) for i in range(r.choice([1, 1, 2]))]
        pipe.records += records
        heads = [i for i in range(len(pipe.stages)) if i not in self.reachable(pipe, i)
                 and len(pipe.stages[i].outputs) < 3]
        if heads and r.random() < 0.3:
            chain = [r.choice(heads)]
        else:
            chain = [len(pipe.stages)]
            pipe.sources.insert(r.randint(0, len(pipe.sources)), len(pipe.stages))
            self.add_stage(pipe, self.make_bins(), r.choice(records))
        schedules = self.chain_schedules()
        self.links[chain[0]] = Link(schedule=schedules[0])
        for _ in range(r.randint(1, 4)):
            producer = chain[-1] if r.random() < 0.75 else r.choice(chain)
            fed = r.choice(["range"] * 6 + ["function"] * 3 + ["anyhow"])
            self.use("chain-" + fed)
            self.links[len(pipe.stages)] = Link(fed, schedule=schedules[1])
            chain.append(len(pipe.stages))
            self.add_stage(pipe, pipe.stages[producer].bins, r.choice(records), producer)
        if r.random() < 0.25:
            self.use("chain-leaves-bins")
            self.add_stage(pipe, self.make_bins(), r.choice(pipe.records), r.choice(chain))

    def add_stage(self, pipe, bins, record, producer=None):
        r = self.random
        if producer is not None:
            outputs = pipe.stages[producer].outputs
            pipe.edges.append(Edge(producer, len(outputs), len(pipe.stages)))
            outputs.append(record)
        pipe.stages.append(Stage(f"S{len(pipe.stages)}", bins, r.choice([1, 8, 32, 64]),
                                 record, []))

    def chain_schedules(self):
        """For the first stage and for the others."""
        r = self.random
        policy = r.choice(["DirectMap", "Serialize", "All"])
        split = lit(r.choice([1, 3, 16])) if policy == "All" and r.random() < 0.7 else None
        alike = [Directive("specifySchedule", policy, split)]
        return r.choice([([], []), ([], []), (alike, alike), (alike, alike), (alike, []),
                         (None, None)])

    # --- Cells -----------------------------------------------------------------

    def cells_of(self, scope):
        """Cells of the domain, computed from anything."""
        cells = []
        for d in range(self.rank):
            cell = Op("u32", "cast", [self.expr("i32", scope, 2)], solid=True)
            domain = Op("u32", "cast", [Query("i32", "domain", d, solid=True)], solid=True)
            extent = Op("u32", "umod", [cell, domain], solid=True)
            cells.append(Op("i32", "cast", [extent], solid=True))
        return cells

    def function(self):
        """The cell of p by the chain's function: the same text each time."""
        kept, self.random = self.random, random.Random(self.function_seed)
        scope = Scope(self, "assign", level=0, reads=self.constant)
        scope.records.append(("p", KEPT))
        cells = self.cells_of(scope)
        self.random = kept
        for node in walk(cells):
            node.solid = True
        return cells

    def position(self, record):
        out = []
        for d in range(self.rank):
            leaf = record.leaf(f"c{d}")
            value = Get(wide(leaf.kind), "p", leaf, solid=True)
            out.append(value if value.type == "i32" else
                       Op("i32", "cast", [value], solid=True))
        return out

    def own_pixel(self, scope):
        """The cell where the stage's primitive is, if that is known."""
        link = self.links.get(self.stage_number)
        if not link or not link.cells or self.random.random() > 0.7 or \
                not any(name == "p" for name, *_ in scope.all("records")):
            return None
        self.use("own-pixels")
        return self.function() if link.cells == "function" else \
            self.position(self.stage.input)

    def chain_no_assign(self, index):
        """One bin is the whole domain."""
        link = self.links[index]
        link.cells = "position" if link.fed == "range" else ""

    def chain_assign(self, pipe, index, scope):
        """The assignment of a stage of a chain; None for that of any stage."""
        r = self.random
        link, stage = self.links[index], pipe.stages[index]
        producer = next((e.producer for e in pipe.edges if e.consumer == index), None)
        if link.fed == "function" and pipe.stages[producer].is_list:
            link.fed = "range"
        handed_on = {"": "", "anyhow": "", "range": "position"}.get(link.fed)
        if link.fed == "function":
            handed_on = self.links[producer].cells == "function" and "function"
        kinds = {"": ["function", "function", ""],
                 "range": ["previous", "position", "position", "position"],
                 "function": ["previous", "function", "function", "function"],
                 "anyhow": ["previous", "position", "function"]}[link.fed]
        kind = r.choice(kinds)
        if not kind:
            return None
        self.use("chain-by-" + kind)
        link.cells = handed_on if kind == "previous" else kind
        if kind == "previous":
            made = [Bins("previous")]
        elif kind == "function":
            made = [Bins(r.choice(["to", "at"]), self.function())]
        else:
            made = [Bins(r.choice(["to", "at"]) if link.fed == "range" else "to",
                         self.position(stage.input))]
        if r.random() < 0.3:
            made = [If(self.expr("b1", scope, 2), made)]
        return made

    def link_of(self, edge):
        """What leads from stage to stage in a chain."""
        link = self.links.get(edge.consumer)
        return link if link and link.fed else None

    @contextmanager
    def fewer_barriers(self, index):
        """Iterations that meet are not fused."""
        kept = self.features
        if index in self.links and self.random.random() < 0.9:
            self.features = kept - {"sync", "collectives"}
        yield
        self.features = kept

    # --- Emissions -------------------------------------------------------------

    def hand_on(self, port, record, link, scope):
        """A primitive through a port to the next stage of a chain."""
        r = self.random
        if port in self.bounds and \
                self.bounds[port] + scope.multiplicity > self.most_emits:
            return self.make_let(scope)
        own = any(name == "p" for name, *_ in scope.all("records"))
        around, times = [], 1  # what the emission is put into
        cells = []
        inner = self.inside(scope)
        for d in range(self.rank):
            cell, loop = self.cell_of_next(d, link, own, around, inner,
                                           scope.multiplicity * times)
            times *= loop
            cells.append(cell)
        self.bounds[port] = self.bounds.get(port, 0) + scope.multiplicity * times
        name = self.fresh("q")
        base = "p" if own and self.stage.input is record and r.random() < 0.8 else ""
        out = [Copy(name, record, base, solid=True)]
        inner.records.append((name, record))
        keep = {m.name for m in KEPT.members} if link.fed == "function" else set()
        out += [s for s in self.set_fields(name, record, inner)
                if s.leaf.path not in keep]
        for field in sorted(keep) if own and not base else []:
            leaf = record.leaf(field)
            value = Get(leaf.kind, "p", self.stage.input.leaf(field), solid=True)
            out.append(Put(name, leaf, value, solid=True))
        for d, cell in enumerate(cells):
            if cell is not None:
                leaf = record.leaf(f"c{d}")
                value = cell if wide(leaf.kind) == "i32" else \
                    Op(leaf.kind, "cast", [cell], solid=True)
                out.append(Put(name, leaf, value, solid=True))
        emit = [Emit(port, name)]
        out += [If(self.expr("b1", inner, 2), emit)] if r.random() < 0.3 else emit
        for before, wrap in reversed(around):
            out = before + [wrap(out)]
        return out

    def cell_of_next(self, d, link, own, around, inner, times):
        """A coordinate, and how often its loop, put into `around`, goes around."""
        r = self.random
        lo = Query("i32", "lo", d, solid=True)
        hi = Query("i32", "hi", d, solid=True)
        last = op("-", hi, lit(1))
        if link.fed != "range":
            return self.expr("i32", inner, 2), 1
        styles = ["clamp", "clamp", "wrap", "guard", "loop"]
        mine = self.links.get(self.stage_number)
        if own and mine and mine.cells == "position":
            styles += ["pass"] * 8
        style = r.choice(styles)
        self.use("chain-" + style)
        any_cell = self.expr("i32", inner, 1)
        if own and self.stage.input.leaf("x"):  # not a constant
            any_cell = op("+", Get("i32", "p", self.stage.input.leaf("x")),
                          op("&", any_cell, lit(7)))
        if style == "pass":
            return self.position(self.stage.input)[d], 1
        if style == "clamp":
            if r.random() < 0.05:
                return op("max", op("min", any_cell, last), lo), 1
            return op("min", op("max", any_cell, lo), last), 1
        if style == "wrap":
            span = Op("u32", "cast", [op("-", hi, lo)], solid=True)
            rest = Op("u32", "umod", [Op("u32", "cast", [any_cell], solid=True), span],
                      solid=True)
            return op("+", lo, Op("i32", "cast", [rest], solid=True)), 1
        if style == "guard":
            name = self.fresh("v")
            inside = [Op("b1", ">=", [Var("i32", name, solid=True), lo], solid=True),
                      Op("b1", "<", [Var("i32", name, solid=True), hi], solid=True)]
            value = op("&", any_cell, lit(r.choice([3, 7, 15])))
            test = Op("b1", "and", inside, solid=True)
            around.append(([Let(name, "i32", value, solid=True)],
                           lambda body: If(test, body, solid=True)))
            return Var("i32", name, solid=True), 1
        name = self.fresh("k")
        size, before = self.stage.bins[d] or self.domain[d], []
        if size * times <= 8 and r.random() < 0.5:
            first, bound = lo, hi
        else:
            size = r.choice([1, 2, 3])
            start = self.fresh("v")
            before = [Let(start, "i32", any_cell, solid=True)]
            first = op("max", Var("i32", start, solid=True), lo)
            bound = op("min", op("+", Var("i32", start, solid=True), lit(size)), hi)
        around.append((before, lambda body: For(name, bound, body, first=first,
                                                solid=True)))
        return Var("i32", name, solid=True), size
