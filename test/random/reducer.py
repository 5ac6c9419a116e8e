# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Takes a failing pipeline apart as long as it fails in the same way.

An edit is (place, kind, argument); the place is a node's number in the order of
`walk`, or -1 for the pipeline itself. Many edits are tried in one file, and
those that work are then tried together, from the back, so that the places in
front stay right.
"""

import copy
from dataclasses import fields

import cpp
from model import *
from runner import case_of, kind_of, options_of

BATCH = 40


# --- Is it still a program? --------------------------------------------------


class Invalid(Exception):
    pass


def expect(condition):
    if not condition:
        raise Invalid


class Checker:
    """Names are declared, barriers are in a parallelFor, jumps in a loop."""

    def __init__(self, stage):
        self.known = {"K"} if stage.template else set()

    def body(self, body, names, parallel, loop):
        names = set(names)
        for s in body:
            self.statement(s, names, parallel, loop)

    def expressions(self, s, names):
        for f in fields(s):
            value = getattr(s, f.name)
            for x in value if isinstance(value, list) else [value]:
                if isinstance(x, Expr):
                    self.expr(x, names)

    def expr(self, x, names):
        name = getattr(x, "base", "") if isinstance(x, Get) else \
            x.name if isinstance(x, Var) else getattr(x, "array", "")
        expect(not name or name.split("[")[0] in names)
        inner = names | {x.var} if isinstance(x, Gather) else names
        self.expressions(x, inner)

    def statement(self, s, names, parallel, loop):
        self.expressions(s, names)
        for base in (getattr(s, "base", ""), getattr(s, "array", "")):
            expect(not base or base in names)
        if isinstance(s, (Emit, Store)):
            expect(s.record in names)
        if isinstance(s, Assign):
            expect(s.name in names)
        if isinstance(s, (Sync, Collective)):
            expect(parallel == 1)
        if isinstance(s, Jump):
            expect(loop or s.kind == "return")
        if isinstance(s, If):
            self.body(s.then, names, parallel, loop)
            self.body(s.other, names, parallel, loop)
        if isinstance(s, Switch):
            for case in s.cases:
                self.body(case, names, parallel, loop)
        if isinstance(s, For):
            self.body(s.body, names | {s.var}, parallel, True)
        if isinstance(s, Parallel):
            self.body(s.body, names | {s.var}, parallel + 1, False)
        if isinstance(s, Update):
            px = cpp.CppPrinter.pixel_name(s)
            self.body(s.body, names | {px}, parallel, False)
            if s.result:
                self.expr(s.result, names | {px} | {
                    b.name for b in s.body if isinstance(b, (Let, Copy))})
        if isinstance(s, (Let, Copy, Array, Collective, Lambda, Update, Atomic)):
            if s.name:
                names.add(s.name)


def is_valid(pipe):
    try:
        expect(pipe.stages and pipe.sources and len(pipe.counts) == len(pipe.sources))
        fed = set(pipe.sources)
        for _ in pipe.stages:
            fed |= {e.consumer for e in pipe.edges if e.producer in fed}
        expect(len(fed) == len(pipe.stages))
        for i, stage in enumerate(pipe.stages):
            expect(not stage.twin_of or any(s is stage.twin_of for s in pipe.stages))
            checker = Checker(stage)
            checker.body(stage.assign or [], checker.known | {"p"}, 0, False)
            checker.body(stage.schedule, checker.known, 0, False)
            checker.body(stage.process,
                         checker.known | (set() if stage.is_list else {"p"}), 0, False)
            for port in range(len(stage.outputs)):
                expect(any(e.producer == i and e.port == port for e in pipe.edges))
            expect(stage.assign is not None or not any(stage.bins))
        return True
    except Invalid:
        return False


# --- Edits --------------------------------------------------------------------


def lists_of(node):
    """The lists of statements in a node."""
    for f in fields(node):
        value = getattr(node, f.name)
        if isinstance(value, list) and value and isinstance(value[0], Stmt):
            yield f.name
        if f.name == "cases":
            yield from ()


def simpler(x):
    """What an expression may become."""
    if x.solid:
        return
    same = [o for f in fields(x) for o in (
        getattr(x, f.name) if isinstance(getattr(x, f.name), list)
        else [getattr(x, f.name)]) if isinstance(o, Expr) and o.type == x.type]
    if not isinstance(x, Lit):
        yield "literal", 1
        for i in range(len(same)):
            yield "operand", i
    elif x.value not in (0, 1, True, False):
        yield "literal", 1


def edits_of(pipe):
    for stage in pipe.stages:
        yield -1, "stage", stage.name
        if stage.assign is not None and any(stage.bins):
            yield -1, "bins", stage.name
        if stage.assign is not None and not any(stage.bins):
            yield -1, "assign", stage.name
        if stage.template:
            yield -1, "template", stage.name
        for part in ("assign", "schedule", "process"):
            body = getattr(stage, part) or []
            for size in sorted({len(body), (len(body) + 1) // 2, 1}, reverse=True):
                for at in range(0, len(body), max(size, 1)):
                    yield -1, "cut", (stage.name, part, at, size)
    for i in range(len(pipe.sources)):
        yield -1, "source", i
        for n in (0, 1, 2, pipe.counts[i] // 2, pipe.counts[i] - 1):
            if 0 <= n < pipe.counts[i]:
                yield -1, "count", (i, n)
    for d in range(pipe.rank):
        for n in (1, 2, pipe.domain[d] // 2):
            if 0 < n < pipe.domain[d]:
                yield -1, "domain", (d, n)
    for i, node in enumerate(walk(pipe)):
        for name in lists_of(node):
            body = getattr(node, name)
            for at in range(len(body)):
                if not (isinstance(body[at], Put) and body[at].solid):
                    yield i, "remove", (name, at)
            if name in ("then", "body", "other") and not isinstance(node, Update) and \
                    not node.solid:
                yield i, "unwrap", name
        if isinstance(node, Switch):
            for c, case in enumerate(node.cases):
                for at in range(len(case)):
                    yield i, "case", (c, at)
        if isinstance(node, Expr):
            for kind, argument in simpler(node):
                yield i, kind, argument
    for state in pipe.state:
        yield -1, "state", state.name
    for record in pipe.records + [s.record for s in pipe.state]:
        for m in record.members:
            yield -1, "member", (record.name, m.name)


def replace(pipe, old, new):
    """Puts `new`, a list for statements, in the place of a node."""
    holders = [(s, part) for s in pipe.stages for part in ("assign", "schedule", "process")
               if getattr(s, part)]
    holders += [(n, f.name) for n in walk(pipe) for f in fields(n)]
    for holder, name in holders:
        value = getattr(holder, name)
        if value is old:
            setattr(holder, name, new[0] if isinstance(new, list) else new)
            return
        for list_ in ([value] + value if isinstance(value, list) else []):
            if isinstance(list_, list):
                for i, item in enumerate(list_):
                    if item is old:
                        list_[i:i + 1] = new if isinstance(new, list) else [new]
                        return


def remove_stage(pipe, index):
    """Removes a stage, what it is fed by, and who waits for it."""
    for edge in [e for e in pipe.edges if e.consumer == index and e.producer != index]:
        producer = pipe.stages[edge.producer]
        producer.outputs.pop(edge.port)
        producer.process = without_port(producer.process, edge.port)
        pipe.edges.remove(edge)
        for other in pipe.edges:
            if other.producer == edge.producer and other.port > edge.port:
                other.port -= 1
    pipe.edges = [e for e in pipe.edges if e.producer != index]
    keep = [i for i, s in enumerate(pipe.sources) if s != index]
    pipe.counts = [pipe.counts[i] for i in keep]
    pipe.sources = [pipe.sources[i] for i in keep]
    for state in pipe.state:
        if state.source >= 0:
            state.source = keep.index(state.source) if state.source in keep else -1
    down = lambda i: i - (i > index)
    pipe.sources = [down(s) for s in pipe.sources]
    for e in pipe.edges:
        e.producer, e.consumer = down(e.producer), down(e.consumer)
    pipe.stages.pop(index)
    for stage in pipe.stages:
        stage.schedule = [d for d in stage.schedule
                          if not (isinstance(d, Directive) and d.kind == "endStage"
                                  and d.stage == index)]
        for d in stage.schedule:
            if isinstance(d, Directive) and d.kind == "endStage":
                d.stage = down(d.stage)


def without_port(body, port):
    """The statements without the emissions to a port."""
    out = []
    for s in body:
        if isinstance(s, Emit):
            if s.port == port:
                continue
            s.port -= s.port > port
        for f in fields(s):
            value = getattr(s, f.name)
            if isinstance(value, list) and value and isinstance(value[0], Stmt):
                setattr(s, f.name, without_port(value, port))
        if isinstance(s, Switch):
            s.cases = [without_port(c, port) for c in s.cases]
        out.append(s)
    return out


def apply(pipe, edit):
    place, kind, argument = edit
    if place >= 0:
        node = next((n for i, n in enumerate(walk(pipe)) if i == place), None)
        expect(node is not None)
        # An edit further back may have put another node here.
        if kind == "remove":
            name, at = argument
            expect(at < len(getattr(node, name, [])))
            getattr(node, name).pop(at)
        elif kind == "unwrap":
            expect(hasattr(node, argument))
            replace(pipe, node, list(getattr(node, argument)))
        elif kind == "case":
            case, at = argument
            expect(isinstance(node, Switch))
            expect(case < len(node.cases) and at < len(node.cases[case]))
            node.cases[case].pop(at)
        elif kind == "literal":
            expect(isinstance(node, Expr))
            replace(pipe, node, Lit(node.type, True if node.type == "b1" else argument))
        else:
            expect(isinstance(node, Expr))
            same = [o for f in fields(node) for o in (
                getattr(node, f.name) if isinstance(getattr(node, f.name), list)
                else [getattr(node, f.name)]) if isinstance(o, Expr) and o.type == node.type]
            expect(argument < len(same))
            replace(pipe, node, same[argument])
        return
    stages = {s.name: i for i, s in enumerate(pipe.stages)}
    if kind in ("stage", "bins", "assign", "template"):
        expect(argument in stages)
        stage = pipe.stages[stages[argument]]
        if kind == "stage":
            remove_stage(pipe, stages[argument])
        elif kind == "bins":
            stage.bins = [0] * pipe.rank
        elif kind == "template":
            stage.template = 0
        else:
            stage.assign = None
    elif kind == "cut":
        name, part, at, size = argument
        expect(name in stages)
        statements = getattr(pipe.stages[stages[name]], part)
        expect(statements is not None)
        del statements[at:at + size]
    elif kind == "source":
        expect(argument < len(pipe.sources) and len(pipe.sources) > 1)
        expect(all(s.source < argument for s in pipe.state))
        pipe.sources.pop(argument)
        pipe.counts.pop(argument)
    elif kind == "count":
        expect(argument[0] < len(pipe.counts))
        pipe.counts[argument[0]] = argument[1]
    elif kind == "domain":
        pipe.domain[argument[0]] = argument[1]
    elif kind == "state":
        used = {getattr(n, "state", None) and getattr(n.state, "name", "")
                for n in walk(pipe)} | {n.image.name for n in walk(pipe)
                                        if isinstance(n, Update)}
        expect(argument not in used)
        pipe.state = [s for s in pipe.state if s.name != argument]
    elif kind == "member":
        record, name = argument
        head = lambda leaf: leaf.path.split(".")[0].replace("[]", "")
        expect(not any(getattr(n, "leaf", None) and head(n.leaf) == name
                       for n in walk(pipe)))
        for r in pipe.records + [s.record for s in pipe.state]:
            if r.name == record:
                expect(len(r.members) > 1 or name not in [m.name for m in r.members])
                r.members = [m for m in r.members if m.name != name]


def edited(pipe, edits):
    """The pipeline after some edits, the ones furthest back first; or None."""
    made = copy.deepcopy(pipe)
    try:
        for edit in sorted(edits, key=lambda e: -e[0]):
            apply(made, edit)
    except Invalid:
        return None
    return made if is_valid(made) else None


# --- The search ---------------------------------------------------------------


def try_edits(pipe, edits, runner, kind):
    """The edits that leave the failure as it was."""
    candidates = [(e, edited(pipe, e)) for e in edits]
    candidates = [(e, p) for e, p in candidates if p]
    for i, (_, made) in enumerate(candidates):
        made.name = f"P{i}"
    if not candidates:
        return []
    verdicts = runner.run([p for _, p in candidates])
    return [(e, p) for (e, p), v in zip(candidates, verdicts) if kind_of(v) == kind]


def write(pipe, verdict, runner):
    comment = "".join(f"// {line}\n" for line in verdict.splitlines()[:6])
    command = " ".join(["// piko-compare %s", case_of(pipe), *options_of(runner.passes)])
    return f"{command}\n{comment}" + cpp.write_file([pipe])


def reduce(pipe, runner):
    """Ever shorter files that fail as a pipeline does; none if it does not."""
    verdict = runner.run([pipe])[0]
    if verdict.startswith(("equal", "the reference stops")):
        return
    yield write(pipe, verdict, runner)
    kind = kind_of(verdict)
    progress = True
    while progress:
        progress = False
        at = 0
        edits = list(edits_of(pipe))
        while at < len(edits):
            batch = []
            while at < len(edits) and len(batch) < BATCH:
                if edited(pipe, [edits[at]]):
                    batch.append([edits[at]])
                at += 1
            good = try_edits(pipe, batch, runner, kind)
            if not good:
                continue
            all_edits = [e for edit, _ in good for e in edit]
            halves = [all_edits, all_edits[::2], all_edits[1::2],
                      all_edits[:len(all_edits) // 2], all_edits[len(all_edits) // 2:]]
            together = try_edits(pipe, [h for h in halves if len(h) > 1], runner, kind)
            size = lambda p: len(list(walk(p))) + sum(p.counts) / 100 + \
                sum(p.domain) / 10 + 20 * len(p.stages) + len(p.state)
            pipe = min([p for _, p in good + together], key=size)
            pipe.name = "P0"
            progress = True
            yield write(pipe, verdict, runner)
            place = at / len(edits)
            edits = list(edits_of(pipe))
            at = int(place * len(edits))
    yield write(pipe, runner.run([pipe])[0], runner)
