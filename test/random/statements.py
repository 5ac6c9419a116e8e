# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Random bodies of phases.

What keeps a body valid is written where it is made: updates are at cells that
are cut to the bin, plain stores go to elements that are the call's own, loops
count to small numbers, and an emission on a way back in a cycle counts `hops`
down.
"""

from expressions import *

SCALARS = [*INTEGERS, "i32", "u32", "f32", "f32", "f64", "b1"]


def lit(value):
    return Lit("i32", value, solid=True)


def op(name, *operands, type="i32"):
    return Op(type, name, list(operands), solid=True)


class Statements(Expressions):
    """Makes random statements; `stage`, `ports` and `writes` describe the stage
    that is being made."""

    def fresh(self, stem):
        self.names += 1
        return f"{stem}{self.names}"

    def inside(self, scope, **changes):
        return Scope(self, scope.phase, scope, **changes)

    def body(self, scope, count, depth=2):
        """Some statements, and what only a stage's kind of state allows."""
        out = []
        for _ in range(count):
            out += self.statement(scope, depth)
        return out

    def statement(self, scope, depth):
        r = self.random
        kinds = ["let"] * 4 + ["assign"] * 3
        if depth > 0:
            kinds += ["if"] * 2 + ["for"]
            if self.on("switches") and not scope.syncs:
                kinds.append("switch")
        if scope.phase == "process" and not scope.updating:
            kinds += ["emit"] * 4 + ["write"] * 3
            if self.on("local-arrays"):
                kinds.append("array")
            if self.on("appends") and not scope.loops:
                kinds += ["append"] * 2
            if self.on("updates"):
                kinds += ["update"] * 3
        if self.on("lambdas"):
            kinds.append("lambda")
        if self.on("helpers"):
            kinds.append("helper")
        return getattr(self, "make_" + r.choice(kinds))(scope, depth)

    # --- Plain C++ -----------------------------------------------------------

    def make_let(self, scope, depth=0):
        kind = self.random.choice(SCALARS)
        value = self.expr(kind, scope)
        name = self.fresh("v")
        scope.variables.append((name, kind))
        return [Let(name, kind, value)]

    def make_assign(self, scope, depth=0):
        own = [(n, k) for n, k, level in scope.all("variables")
               if level == scope.level and n.startswith("v")]
        if scope.updating or not own:
            return self.make_let(scope)
        name, kind = self.random.choice(own)
        return [Assign(name, self.expr(kind, scope))]

    def make_if(self, scope, depth):
        r = self.random
        test = self.expr("b1", scope, 2)
        then = self.body(self.inside(scope), r.randint(1, 2), depth - 1)
        other = self.body(self.inside(scope), r.randint(0, 1), depth - 1)
        if self.on("early-returns") and not scope.loops and r.random() < 0.15 \
                and not scope.updating and scope.phase == "process" and scope.level == 0:
            self.use("early-returns")
            then.append(Jump("return"))
        elif scope.updating and self.on("early-returns") and r.random() < 0.3:
            self.use("update-returns")
            value = self.expr(scope.returns, scope, 2) if scope.returns else None
            then.append(Jump("return", value))
        elif scope.loops and self.on("loop-jumps") and r.random() < 0.4:
            self.use("loop-jumps")
            then.append(Jump(r.choice(["break", "continue"])))
        return [If(test, then, other)]

    def make_for(self, scope, depth):
        self.use("loops")
        times = self.random.choice([2, 3, 4])
        inner = self.inside(scope, loops=True, multiplicity=scope.multiplicity * times)
        var = self.fresh("k")
        inner.variables.append((var, "i32"))
        bound = lit(times) if self.random.random() < 0.4 else \
            op("&", self.expr("i32", scope, 1), lit(3 if times == 4 else 1))
        if times == 3:
            bound = lit(3)
        return [For(var, bound, self.body(inner, self.random.randint(1, 2), depth - 1))]

    def make_switch(self, scope, depth):
        self.use("switches")
        r = self.random
        count = r.randint(2, 4)
        cases = [self.body(self.inside(scope, loops=None), 1, depth - 1)
                 for _ in range(count)]
        falls = [r.random() < 0.35 for _ in range(count)]
        return [Switch(self.expr("i32", scope, 2), cases, falls)]

    def make_lambda(self, scope, depth=0):
        self.use("lambdas")
        kind = self.random.choice(["i32", "f32", "u64"])
        name = self.fresh("v")
        made = Lambda(name, kind, self.expr("b1", scope, 2), self.expr(kind, scope, 2),
                      self.expr(kind, scope, 2))
        scope.variables.append((name, kind))
        return [made]

    def make_helper(self, scope, depth=0):
        self.use("helpers")
        kind = self.random.choice(["i32", "f32", "u32"])
        name = self.random.choice(["helper", "templated", "countdown"])
        if name == "templated":
            self.use("templates")
        value = Op(kind, name, [self.expr(kind, scope, 2), self.expr("i32", scope, 1)])
        var = self.fresh("v")
        scope.variables.append((var, kind))
        return [Let(var, kind, value)]

    def make_array(self, scope, depth):
        """An array of this call or iteration, filled and then read anywhere."""
        r = self.random
        self.use("local-arrays")
        kind = r.choice(["i32", "f32", "u64", "f64"])
        length = r.choice([2, 3, 4, 8])
        name, var = self.fresh("a"), self.fresh("k")
        inner = self.inside(scope, loops=True)
        inner.variables.append((var, "i32"))
        fill = For(var, lit(length), [Set(name, length, Var("i32", var, solid=True),
                                          self.expr(kind, inner, 2))], solid=True)
        out = [Array(name, kind, length), fill]
        scope.arrays.append((name, kind, length))
        for _ in range(r.randint(0, 2)):
            out.append(Set(name, length, self.index(scope), self.expr(kind, scope, 2)))
        return out

    def make_append(self, scope, depth=0):
        """A list that a loop appends to, and what it has is read anywhere."""
        r = self.random
        self.use("appends")
        kind = r.choice(["i32", "f32", "u64", "f64"])
        length = r.choice([5, 20, 70])
        name, fill, var, count = (self.fresh(stem) for stem in "akkn")
        inner = self.inside(scope, loops=True)
        inner.variables.append((var, "i32"))
        length_of = Var("i32", count, solid=True)
        test = self.expr("b1", inner, 2)
        if r.random() < 0.4:
            room = Op("b1", "<", [length_of, lit(r.choice([3, length // 2]))])
            test = Op("b1", "and", [test, room] if r.random() < 0.5 else [room, test])
        push = [Set(name, length, length_of, self.expr(kind, inner, 2)),
                Assign(count, op("+", length_of, lit(1)))]
        out = [Array(name, kind, length),
               For(fill, lit(length), [Set(name, length, Var("i32", fill, solid=True),
                                           Lit(kind, 1))], solid=True),
               Let(count, "i32", lit(0)),
               For(var, lit(length), [If(test, push)])]
        scope.arrays.append((name, kind, length))
        scope.variables.append((count, "i32"))
        return out

    # --- Emissions -----------------------------------------------------------

    def set_fields(self, name, record, scope, share=0.5):
        out = []
        for leaf in record.leaves:
            if leaf.path in ("hops", "serial") or self.random.random() > share:
                continue
            index = None
            if leaf.count:
                index = self.index(scope) if self.on("dynamic-elements") else \
                    Lit("i32", self.random.randrange(leaf.count))
            out.append(Put(name, leaf, self.expr(wide(leaf.kind), scope, 2), index))
        return out

    def make_emit(self, scope, depth):
        if not self.ports:
            return self.make_update(scope, depth) if self.on("updates") \
                else self.make_write(scope, depth)
        return self.emission(self.random.randrange(len(self.ports)), scope)

    def emission(self, port, scope):
        """A primitive through a port. On a way back its hops are counted down,
        and it is not emitted when they are used up."""
        r = self.random
        record, is_back, link = self.ports[port]
        if link:
            return self.hand_on(port, record, link, scope)
        same = [e for e in scope.all("records") if e[1] is record]
        counted = [e for e in scope.all("records") if e[1].leaf("hops")
                   and not e[0].startswith("q")]
        if is_back and not counted:
            return self.make_let(scope)
        self.bounds[port] = self.bounds.get(port, 0) + scope.multiplicity
        name = self.fresh("q")
        base = r.choice(same)[0] if same and r.random() < 0.8 else ""
        out = [Copy(name, record, base)]
        inner = self.inside(scope)
        if record.scalar:
            out = [Copy(name, record), Put(name, record.leaves[0],
                                           self.expr(wide(record.scalar), scope))]
        else:
            inner.records.append((name, record))
            out += self.set_fields(name, record, inner)
        hops = record.leaf("hops")
        if hops:
            left = lit(0)
            if counted:
                # One hop if a call emits many: each of three would make as many
                # of each, on the way back or on an edge that leads to it.
                many = self.bounds[port] > 8
                left = op("&", Get("i32", counted[0][0], counted[0][1].leaf("hops"),
                                   solid=True), lit(1 if many else 3))
            value = op("-", left, lit(1)) if is_back else left
            out.append(Put(name, hops, value, solid=True))
            if is_back:
                test = Op("b1", ">", [left, lit(0)], solid=True)
                return [If(test, out + [Emit(port, name)], solid=True)]
        if r.random() < 0.3:
            return [If(self.expr("b1", scope, 2), out + [Emit(port, name)])]
        return out + [Emit(port, name)]

    # --- State ---------------------------------------------------------------

    def own_cell(self, scope):
        """A cell of the bin, as expressions and, if it needs one, a test."""
        cells = []
        for d in range(self.rank):
            lo = Query("i32", "lo", d, solid=True)
            hi = op("-", Query("i32", "hi", d, solid=True), lit(1))
            at = self.expr("i32", scope, 1)
            cells.append(op("min", op("max", at, lo), hi))
        return cells

    def make_update(self, scope, depth):
        images = [s for s, how in self.writes if how == "update"]
        if not images or scope.level:
            return self.make_write(scope, depth)
        at = self.own_pixel(scope) or self.own_cell(scope)
        return self.update(self.random.choice(images), at, scope)

    def select(self, image, at, scope):
        """Keeps what is first by a key: all updates of an image have one, and set
        the same numbers. Null if it has none."""
        r = self.random
        if image.name not in self.selections:
            places = [l for l in image.record.leaves
                      if l.kind in ("i32", "u32", "i64", "u64", "f32", "f64")]
            chosen = self.on("selections") and places and r.random() < 0.5
            self.selections[image.name] = chosen and (
                r.choice(places), r.choice(["<", "<=", ">", ">="]),
                [l for l in image.record.leaves if r.random() < 0.6],
                [r.randint(1, 31) / 16 for _ in range(3)]
                if self.on("shading") and r.random() < 0.7 else None)
        if not self.selections[image.name]:
            return None
        self.use("selections")
        leaf, comparison, others, shaded = self.selections[image.name]
        key, px = self.fresh("v"), self.fresh("px")
        before = [Let(key, leaf.kind, self.expr(leaf.kind, scope))]
        light, shading = self.shade(shaded, scope) if shaded else ("", [])
        index = Lit("i32", 0) if leaf.count else None
        body = [Put(px, leaf, Var(leaf.kind, key), index)]
        for other in others:
            if other.path != leaf.path:
                value = self.of_light(light, wide(other.kind)) if shaded else \
                    self.expr(wide(other.kind), scope, 2)
                body.append(Put(px, other, value, Lit("i32", 0) if other.count else None))
        scope.variables.append((key, leaf.kind))
        old = Get(leaf.kind, px, leaf, index)
        test = Op("b1", comparison, [Var(leaf.kind, key), old])
        return before + shading + [Update(image, at, [If(test, body)])]

    def shade(self, weights, scope):
        """A sum that takes a loop, and that only what is seen needs; the same for
        all updates of an image, but for what it begins with."""
        self.use("shading")
        light, turn = self.fresh("v"), self.fresh("k")
        a, b, c = (Lit("f32", weight) for weight in weights)
        real = lambda name, *operands: Op("f32", name, list(operands))
        was = Var("f32", light)
        wave = real("+", real("*", was, a), real("*", Op("f32", "cast", [
            Var("i32", turn)]), b))
        value = real("/", wave, real("+", real("*", wave, wave), c))
        return light, [Let(light, "f32", self.expr("f32", scope, 2)),
                       For(turn, lit(7), [Assign(light, real("+", value, a))])]

    def of_light(self, light, kind):
        """Such a sum as a number of another kind."""
        value = Var("f32", light)
        if kind == "b1":
            return Op("b1", "<", [value, Lit("f32", 0.5)])
        if kind in FLOATS:
            return value if kind == "f32" else Op(kind, "cast", [value])
        value = Op("i32", "toInt", [Op("f32", "*", [value, Lit("f32", 64.0)])])
        return value if kind == "i32" else Op(kind, "cast", [value])

    def update(self, image, at, scope):
        selects = self.select(image, at, scope)
        if selects:
            return selects
        self.use("updates")
        r = self.random
        px = self.fresh("px")
        kind = r.choice(["b1", "i32", "f32", "u64"]) if r.random() < 0.5 else None
        inner = self.inside(scope, updating=True, loops=None, returns=kind)
        inner.records = [(px, image.record)]
        body = []
        for leaf in image.record.leaves:
            # Not commutative, and loses nothing.
            index = Lit("i32", r.randrange(leaf.count)) if leaf.count else None
            type = wide(leaf.kind)
            old = Get(type, px, leaf, index)
            if type == "b1":
                value = Op("b1", "!=", [old, self.expr("b1", inner, 2)])
            elif type in FLOATS:
                half = Op(type, "*", [old, Lit(type, 0.5)])
                value = Op(type, "+", [half, self.expr(type, inner, 2)])
            else:
                old = Op(type, "*", [old, Lit(type, 31)])
                value = Op(type, "+", [old, self.expr(type, inner, 2)])
            body.append(Put(px, leaf, value, index))
        if r.random() < 0.4:
            body = [If(self.expr("b1", inner, 2), body)] + self.body(
                self.inside(inner), r.randint(0, 2), 2)
        result, name = None, ""
        if kind:
            self.use("update-results")
            result, name = self.expr(kind, inner, 2), self.fresh("v")
            scope.variables.append((name, kind))
        return [Update(image, at, body, result, name)]

    def make_write(self, scope, depth):
        """An integer atomic on what the stage shares."""
        shared = [(s, how) for s, how in self.writes if how.startswith("atomic")]
        if not shared or not self.on("atomics"):
            return self.make_let(scope)
        state, how = self.random.choice(shared)
        places = [l for l in state.record.leaves if l.kind in INTEGERS and not l.count]
        leaf = self.random.choice(places)
        # One operation for each place, whoever performs it.
        name = self.operations.setdefault((state.name, leaf.path), self.random.choice(
            ["atomicAdd", "atomicMin", "atomicMax", "atomicAnd", "atomicOr", "atomicXor"]))
        self.use(f"{name}-{leaf.kind}")
        self.use("atomics-" + state.kind)
        n = 1 if state.kind == "buffer" else self.rank
        at = [self.expr("i32", scope, 2) for _ in range(n)]
        return [Atomic(name, state, at, leaf, self.expr(leaf.kind, scope))]

    def store(self, state, at, scope):
        self.use("stores-" + state.kind)
        name = self.fresh("q")
        inner = self.inside(scope)
        inner.records.append((name, state.record))
        out = [Copy(name, state.record)]
        if state.record.scalar:
            kind = wide(state.record.scalar)
            out.append(Put(name, state.record.leaves[0], self.expr(kind, scope)))
        else:
            out += self.set_fields(name, state.record, inner, 0.8)
        return out + [Store(state, at, name)]

    # --- parallelFor -----------------------------------------------------------

    def make_parallel(self, scope, nested=False):
        """A parallelFor before which nothing is assigned in it."""
        r = self.random
        self.use("parallel-in-list" if scope.has_size else "parallel-in-one")
        if nested:
            self.use("nested-parallel")
        var = self.fresh("i")
        if scope.has_size and r.random() < 0.6 and not nested:
            self.use("parallel-over-list")
            bound, times = Query("i32", "size", solid=True), 1
            over_list = True
        else:
            times = r.choice([1, 3, 7, 16])  # also as many as a vector has lanes
            bound = lit(times) if r.random() < 0.5 else \
                op("&", self.expr("i32", scope, 1), lit(times))
            over_list = False
        inner = self.inside(scope, level=scope.level + 1, loops=None,
                            multiplicity=scope.multiplicity * times)
        inner.variables.append((var, "i32"))
        before = []
        if over_list:
            name = self.fresh("e")
            before.append(Copy(name, self.stage.input, "", Var("i32", var, solid=True),
                               solid=True))
            if not self.stage.input.scalar:
                inner.records.append((name, self.stage.input))
            inner.element = True
        body = []
        arrays = []
        for _ in range(r.randint(1, 3)):
            choice = r.random()
            if choice < 0.3 and self.on("sync") and not nested:
                body += self.exchange(var, bound, over_list, scope, inner, arrays)
            elif choice < 0.45 and self.on("collectives") and not nested:
                body += self.collective(inner)
            elif choice < 0.6 and not nested and self.on("nested-parallel"):
                body += self.make_parallel(inner, nested=True)
            else:
                body += self.statement(inner, 1)
        if self.on("sync") and not nested and r.random() < 0.3:
            body += self.uniform_sync(scope, inner)
        return arrays + [Parallel(var, bound, before + body)]

    def exchange(self, var, bound, over_list, outer, inner, arrays):
        """Iterations hand a value to others through a shared array: each writes
        its own element and, after a barrier, reads any."""
        self.use("sync")
        self.use("shared-arrays")
        r = self.random
        kind, length = r.choice(["i32", "f32", "i64"]), 16
        if over_list:
            return [Sync()]
        name = self.fresh("a")
        arrays.append(Array(name, kind, length))
        clear = self.fresh("k")
        arrays.append(For(clear, lit(length), [
            Set(name, length, Var("i32", clear, solid=True), Lit(kind, 0))], solid=True))
        out = [Set(name, length, Var("i32", var, solid=True), self.expr(kind, inner),
                   solid=True), Sync(solid=True)]
        result = self.fresh("v")
        out.append(Let(result, kind, Element(kind, name, length, self.index(inner))))
        inner.variables.append((result, kind))
        if r.random() < 0.5:
            out += [Sync(solid=True), Set(name, length, Var("i32", var, solid=True),
                                          self.expr(kind, inner), solid=True),
                    Sync(solid=True)]
            again = self.fresh("v")
            out.append(Let(again, kind, Element(kind, name, length, self.index(inner))))
            inner.variables.append((again, kind))
        return out

    def uniform_sync(self, outer, inner):
        """A barrier inside a loop or a condition that all iterations share."""
        self.use("sync-in-control-flow")
        r = self.random
        scope = self.inside(inner, syncs=True)
        body = self.body(scope, 1, 0)
        body += [Sync()] if r.random() < 0.5 or not self.on("collectives") \
            else self.collective(scope)
        body += self.body(scope, 1, 0)
        if r.random() < 0.5:
            return [If(self.expr("b1", outer, 2), body)]
        var = self.fresh("k")
        scope.variables.append((var, "i32"))
        return [For(var, lit(r.choice([1, 2, 3])), body)]

    def collective(self, scope):
        r = self.random
        kind = r.choice(["any", "all", "count", "reduce", "scan", "sort", "reduce", "scan"])
        self.use("collective-" + kind)
        value_type = {"any": "b1", "all": "b1", "count": "b1"}.get(
            kind, r.choice(["i32", "f32", "u64", "f64", "f32"]))
        if kind in ("reduce", "scan", "sort"):
            self.use("collective-" + ("float" if value_type in FLOATS else "int"))
        type = {"any": "b1", "all": "b1", "count": "i64", "sort": "i64"}.get(
            kind, value_type)
        name = self.fresh("v")
        value = self.expr(value_type, scope)
        scope.variables.append((name, type))
        return [Collective(kind, name, type, value, r.choice(self.operators(value_type)))]

    @staticmethod
    def operators(kind):
        return ["+", "*", "min", "max"] + (["-"] if kind in FLOATS else ["^", "-"])

    def gather(self, scope):
        """any, all, count or reduce over a range, outside parallelFor."""
        r = self.random
        kind = r.choice(["any", "all", "count", "reduce", "reduce"])
        self.use("gather-" + kind)
        value_type = "b1" if kind != "reduce" else r.choice(["i32", "f32", "u64", "f64"])
        var, name = self.fresh("i"), self.fresh("v")
        inner = self.inside(scope, level=scope.level + 1)
        inner.variables.append((var, "i32"))
        bound = Query("i32", "size", solid=True) if scope.has_size and r.random() < 0.6 \
            else op("&", self.expr("i32", scope, 1), lit(r.choice([3, 7, 15])))
        value = self.expr(value_type, inner)
        if isinstance(bound, Query) and not self.stage.input.scalar:
            leaves = [l for l in self.stage.input.leaves
                      if wide(l.kind) == value_type and not l.count]
            if leaves:
                value = Item(value_type, r.choice(leaves), Var("i32", var, solid=True))
        type = {"any": "b1", "all": "b1", "count": "i64"}.get(kind, value_type)
        made = Gather(type, kind, var, bound, value, r.choice(self.operators(value_type)))
        scope.variables.append((name, type))
        return [Let(name, type, made)]
