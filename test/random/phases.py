# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A stage of a random pipeline: its bins, directives and bodies."""

from dataclasses import replace

from graphs import *


class Phases(Graphs):
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
        # Nobody waits for a stage of its own cycle, or for one after it.
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
        if not out and not link and stage.threads == 8:
            self.use("one-lane")
            out.append(Directive("specifyLanes", "One"))
        stage.schedule += out

    def choose_lanes(self, stage, link):
        """Vectors even where they do not pay."""
        is_said = any(isinstance(d, Directive) and d.kind == "specifyLanes"
                     for d in stage.schedule)
        if is_said or link or not any(isinstance(s, Parallel)
                                     for s in walk(stage.process)):
            return
        if self.on("lanes-of-iterations") and self.random.random() < 0.6:
            self.use("lanes-of-iterations")
            stage.schedule.append(Directive("specifyLanes", "Iterations"))

    def choose_precision(self, stage):
        if self.on("precision") and self.random.random() < 0.1:
            self.use("precision")
            stage.schedule.append(Directive(
                "specifyPrecision", self.random.choice(["Contracted", "Relaxed"])))

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
            steps = [r.choice([-1, 0, 0, 1, 2]) for _ in cells]
            far = [op("+", c, lit(step)) for c, step in zip(cells, steps)]
            if steps[0] == -1:  # as a box, mostly empty
                self.use("assign-line")
                return [Bins("line", near, far)]
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
        if self.random.random() < 0.5:
            return [Parallel(var, None, body)]
        self.use("pixels-in-box")
        lo, hi = ([self.expr("i32", scope, 1) if self.random.random() < 0.3 else
                   lit(self.random.randint(-2, most)) for most in self.domain]
                  for _ in range(2))
        return [Parallel(var, None, body, lo, hi)]

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
