// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes on stages and their phases.

#ifndef PIKO_TRANSFORMS_AUTHOREDPASSES_TD
#define PIKO_TRANSFORMS_AUTHOREDPASSES_TD

include "mlir/Pass/PassBase.td"

def ApplyPrecision : Pass<"piko-apply-precision", "::piko::PipelineOp"> {
  let summary = "Compute in each process phase as precisely as its stage says";
  let description = [{
    **Requires** the authored level, with stages as they are written: the
    operations of one carry its precision through all fusions.

    **Does**, in a process phase that says `precision contracted`: makes an
    addition or a subtraction of a product a `math.fma`, whether the product is
    used elsewhere, too, or not, and also if both sides of a condition yield one. Of
    two products the left one is fused. In one that says `precision relaxed`, before that, in f32: makes a division a
    product with a reciprocal, of a constant the nearest one, otherwise a
    `piko.approximate_reciprocal` or, if the divisor is a square root, a
    `piko.approximate_rsqrt`; and a `math.sqrt` a `piko.approximate_sqrt`.
    `piko::rsqrt`, which computes in f64, is recognised.

    **Guarantees** that no precision is left, and that what is computed is
    written down: no later pass, no vector form and no number of threads changes
    a bit of it. Divisions by 0 and by infinities, roots of these and of negative
    numbers, and NaNs give what they do in `strict`. A phase that says nothing,
    `assign` and `schedule` stay as they are.

    Before:
    ```
    piko.process precision relaxed {
      ...
      %q = arith.divf %a, %x : f32
      %s = arith.addf %q, %b : f32
    ```
    After:
    ```
    piko.process {
      ...
      %r = piko.approximate_reciprocal %x : f32
      %s = math.fma %a, %r, %b : f32
    ```

    **Limits**: a sum in a loop keeps its order, though `relaxed` permits another.
    Divisors beyond 2^126 may count as infinite, and below 2^-126 as 0.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect"];
}

def NormalizeLoops : Pass<"piko-normalize-loops"> {
  let summary = "Put the work of a loop behind its condition";
  let description = [{
    **Requires** nothing in particular; it works on `scf` in any operation.

    **Does**: exchanges the arms of an `scf.if` whose first does nothing; makes an
    `scf.if` of an `scf.index_switch` of a truth value; makes truth values of the
    flags that arms yield as numbers, and conjunctions of those that an arm yields
    where the other yields false, if they can be computed in front; moves what
    stands in an `scf.if` with the loop's own condition, in front of that
    condition, behind it.

    **Guarantees** the same effects in the same order. Loops that were made of
    branches, with `<=`, with `break` or `continue`, then look like those with a
    simple condition, which other passes expect.

    Before:
    ```
    scf.while (%x = %lo) : (i32) -> i32 {
      %ends = arith.cmpi sgt, %x, %last : i32
      %more = arith.cmpi sle, %x, %last : i32
      %next = scf.if %ends -> (i32) {
        scf.yield %poison : i32
      } else {
        ...
        scf.yield %y : i32
      }
      scf.condition(%more) %next : i32
    } do { ... }
    ```
    After:
    ```
    scf.while (%x = %lo) : (i32) -> i32 {
      %more = arith.cmpi sle, %x, %last : i32
      scf.condition(%more) %x : i32
    } do {
    ^bb0(%x: i32):
      ...
      scf.yield %y : i32
    }
    ```

    **Limits**: a condition that is known only after an effect, as with a `break`
    behind an emission, stays in front of its work.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def UpliftPixelLoops : Pass<"piko-uplift-pixel-loops", "::piko::PipelineOp"> {
  let summary = "Uplift counted loops over pixels to piko.parallel_pixels";
  let description = [{
    **Requires** the authored level, and loops as `piko-normalize-loops` leaves
    them.

    **Does**: makes a `piko.parallel_pixels` of a nest of counted loops in a
    process phase, as many as the pipeline has dimensions, whose counters are the
    coordinates of a pixel of the bin, x the fastest. Pure operations between the
    loops move into the body. Iterations are independent: they hand nothing on,
    leave the loop nowhere, change state by updates and stores of their own pixel
    and by atomics that give nothing, read what the loop changes at their own
    pixel only, and store to their own arrays. A test around the whole body that
    keeps the pixel in the bin becomes a part of the box.

    **Guarantees** the same emissions and updates, in the same order.

    Before:
    ```
    scf.while (%y = %y0) : (i32) -> i32 {
      %more = arith.cmpi slt, %y, %y1 : i32
      scf.condition(%more) %y : i32
    } do {
    ^bb0(%y: i32):
      scf.while (%x = %x0) : (i32) -> i32 {
        ...
      } do {
      ^bb0(%x: i32):
        piko.emit 0 (%x, %y) : i32, i32
        ...
      }
      ...
    }
    ```
    After:
    ```
    piko.parallel_pixels (%x0, %y0) to (%x1, %y1) {
    ^bb0(%x: i32, %y: i32):
      piko.emit 0 (%x, %y) : i32, i32
      piko.yield
    }
    ```

    **Limits**: loops that count by 1 upwards, x in y. A remark says of any other
    nest of loops over pixels what is in the way.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def OrderStages : Pass<"piko-order-stages", "::piko::PipelineOp"> {
  let summary = "Put the stages into the order in which they run";
  let description = [{
    **Requires** the authored level.

    **Does**: cuts the graph into linear branches, at convergence, divergence
    and waits, and moves the stages so that branches stand in descending distance
    of their first stage from the drain; a branch comes later where it depends,
    by an edge or by `end_stage`, on one that has not come yet. The stages of a
    cycle of edges are taken together, in order of declaration. Also numbers the
    stages (`lineage`) by the language's own rule: producers and stages waited
    for first, otherwise as declared.

    **Guarantees** that each stage stands behind all stages that feed it or that
    it waits for, but for those on a cycle with it.

    Before, with `@a` feeding `@b`, and `@b` itself and `@c`:
    ```
    piko.stage @c ...
    piko.stage @b ...
    piko.stage @a ...
    ```
    After:
    ```
    piko.stage @a ... lineage 0 ...
    piko.stage @b ... lineage 1 ...
    piko.stage @c ... lineage 2 ...
    ```

    **Limits**: a stage that waits for itself or for one that it feeds gets an
    error, as do stages that wait for each other.
  }];
}

def InferDirectives : Pass<"piko-infer-directives", "::piko::PipelineOp"> {
  let summary = "Write down directives that hold without being said";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`).

    **Does**: turns the one `piko.assign_to` of an assign phase into a
    `piko.assign_previous` where it is proved that the bin is that which the
    primitive was emitted from. There are two proofs. *By range*: the bin is that
    of a cell, and wherever a producer emits a primitive the cell's coordinates
    lie between the bounds of the producer's bin. That follows from a system of
    linear inequalities: of loops and how their arguments change from turn to
    turn, of conditions on the way, minima and maxima, quotients, remainders,
    shifts and masks, of floats that are whole numbers, of truth values, and of
    how the producer's own bin was chosen, for the primitive or for each one of a
    list that it reads at an index in the list. *By function*: the bin is computed
    from fields as the producer's was from its own, and what goes into it is
    handed on unchanged. A condition around the assignment stays, so that a
    primitive is in at most that bin.

    **Guarantees** that every primitive stays in the same bins.

    Before, where `@shade` has bins by `x` and hands `x` on:
    ```
    piko.stage @test bins [8] ... {
      piko.assign {
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %b = piko.bin_at %x : i32
        piko.assign_to %b
    ```
    After:
    ```
        piko.assign_previous inferred
    ```

    **Limits**: producers and the stage have bins of one size, and the stage has
    no source. On a cycle only what was proved for stages before it is used.
    Arithmetic that may wrap around proves nothing: of `hi + 1` with any `hi`
    nothing is known, of `min(hi, end - 1) + 1` all. A remark says which
    coordinate could not be proved to be inside, where, and at which bound.
  }];
}

def PreSchedule : Pass<"piko-pre-schedule", "::piko::PipelineOp"> {
  let summary = "Choose cores before there are bins";
  let description = [{
    **Requires** the authored level; best after canonicalization, which folds
    what a schedule computes.

    **Does**: follows all ways through the `dynamic` body of each schedule. Where
    they all end with the same directives, these become the schedule's own, and
    the body is erased. A schedule without a body that is `direct_map`,
    `serialize` or `all` becomes `resolved`: the core that a bin runs on follows
    from its number when primitives are assigned. So nothing runs for each bin,
    `piko-fuse-stages`, which needs to know the kind, sees it, and the kernel's
    loop is one in which a thread takes its own units of work (`direct_map`), a
    sequential one (`serialize`) or OpenMP's dynamic one (`all`). What is not
    resolved asks the runtime's scheduler for each unit.

    **Guarantees** that each bin has the directives that it had.

    Before:
    ```
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %serialize = arith.constant 2 : i32
      %none = arith.constant 0 : i64
      scf.if %c {
        piko.set_schedule %serialize tile_split %none
      } else {
        piko.set_schedule %serialize tile_split %none
      }
      piko.return
    }
    ```
    After:
    ```
    piko.schedule serialize resolved
    ```

    **Limits**: a schedule that depends on its bin or on the state's constants
    keeps its body, which runs for each bin, before the pipeline does; a remark
    says what it depends on. So does one that would end with an error.
  }];
}

def FuseStages : Pass<"piko-fuse-stages", "::piko::PipelineOp"> {
  let summary = "Run a stage where its primitives are emitted";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`);
    best after `piko-infer-directives`.

    **Does**: makes a stage part of the one that feeds it, so that both have one
    kernel and no primitive is stored between them: each `piko.emit` becomes the
    body of the consumer's process phase, inside the conditions of its assign
    phase, with the emitted numbers in place of fields. Both have bins of one
    size, one edge and no source lead to the consumer, its only assignment is
    `piko.assign_previous` (or one bin is the whole domain), it does not wait,
    and both schedules put a bin onto the same core: they are `direct_map`,
    `serialize` or `all` alike, or the consumer has none. `load_balance` on the
    consumer keeps it apart, because it asks for any core.

    **Guarantees** that updates of a pixel and emissions keep their lineage
    order. The stage notes in `fused` whose phases it holds, and each access to
    state whose phase it is from.

    A consumer with loops, which what a producer emits in a loop would be put
    into, is left apart if it emits in turn: it runs `behind`, so that
    `piko-fuse-kernels` makes one kernel of both, with a list of the bin between
    them (loop fission). From the list, lanes of vectors are full.

    Before:
    ```
    piko.edge @a[0] -> @b
    piko.stage @a bins [8] threads 64 : @F -> [@F] {
      piko.process { ... piko.emit 0 (%x) : i32 ... }
    }
    piko.stage @b bins [8] threads 64 : @F -> [] {
      piko.assign { ... piko.assign_previous ... }
      piko.process { ... piko.get %f "x" ... }
    }
    ```
    After:
    ```
    piko.stage @a bins [8] threads 64 fused ["b"] : @F -> [] {
      piko.process { ... the body of @b on %x ... }
    }
    ```

    **Limits**: a stage on a cycle, one that collects (see `piko-fuse-kernels`)
    and one whose iterations meet at barriers are not fused. Neither is one that
    would be copied to more than `max-copies` places. A remark gives the reason
    for each edge that stays.
  }];
  let options = [
    Option<"maxCopies", "max-copies", "int64_t", "4",
           "To how many places a stage may be copied">,
    Option<"fission", "fission", "bool", "true",
           "Leave apart what is better run behind its producer">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::ub::UBDialect"];
}

def TestEarly : Pass<"piko-test-early", "::piko::PipelineOp"> {
  let summary = "Move work behind the test that decides whether it is needed";
  let description = [{
    **Requires** the authored level; best after `piko-fuse-stages`, which brings
    a test and the work in front of it together.

    **Does**: moves what a process phase computes into the one branch that uses
    it, behind whatever decides about the branch, such as the update of a depth.
    So a fragment that fails the depth test is not shaded.

    **Guarantees** that what moves has no effect and reads no state that the
    phase writes, so that results stay as they are. It does not matter how the
    test is written, because it is not repeated but stays where it is.

    Before:
    ```
    %c = ...                               // the colour
    %passed = piko.update @depth[%x : i32] { ... } -> i1
    scf.if %passed {
      piko.update @color[%x : i32] { ... %c ... }
    }
    ```
    After:
    ```
    %passed = piko.update @depth[%x : i32] { ... } -> i1
    scf.if %passed {
      %c = ...
      piko.update @color[%x : i32] { ... %c ... }
    }
    ```

    **Limits**: work in one stage for a test in another that is not fused with it
    stays; so does what two branches need.
  }];
}

def ProveBounds : Pass<"piko-prove-bounds", "::piko::PipelineOp"> {
  let summary = "Find indices that need no test when the pipeline runs";
  let description = [{
    **Requires** the authored level; last, because what moves an access out of
    the condition that proves something about it would be wrong behind this.

    **Does**: marks accesses to buffers, images and lists as `checked` where each
    index is at least 0 and less than the extent, and updates (`piko.inside`)
    whose coordinates lie between the bounds of the bin; both as
    `piko-infer-directives` proves it.

    **Guarantees** that no access is outside that was not.

    Before:
    ```
    %n = piko.extent @lights[0]
    scf.for %i = %zero to %n step %one {
      %x = piko.load @lights[%i : index] "x" : f32
    ```
    After:
    ```
      %x = piko.load checked @lights[%i : index] "x" : f32
    ```

    **Limits**: what follows from the contents of buffers, or from constants that
    the host sets, is not known; nor is it known of a buffer, as it is of the
    domain, that it has an element at all, so that an index clamped to it, or a
    remainder, is still tested. A remark names each access that is.
  }];
}

def OwnPixels : Pass<"piko-own-pixels", "::piko::PipelineOp"> {
  let summary = "Find which pixel a primitive updates, so that bins can be divided";
  let description = [{
    **Requires** the authored level.

    **Does**: where all updates of a stage are at one pixel that follows from
    the primitive's fields and constants alone, copies that computation to the
    front of the assign phase, with a `piko.owner` behind it. The stage then gets tiles of
    `tile` cells a side (which bins that are smaller do not have), and threads
    that each take tiles of a bin still update every pixel in lineage order.

    **Guarantees** that the pixels that a stage changes and the order in which it
    does so stay as they are.

    Before:
    ```
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @depth[%x, %y : i32, i32] { ... }
    ```
    After, in front of it:
    ```
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.owner [%x, %y : i32, i32]
      %zero = arith.constant 0 : index
      piko.assign_to %zero
    ```

    **Limits**: an update at several pixels, at one that is read from a
    buffer or an image, or for a list, is refused with a remark; one thread then
    takes each bin.
  }];
  let options = [
    Option<"tile", "tile", "int64_t", "32",
           "Side of a tile, in cells of the domain">];
}

def EliminateSchedules
    : Pass<"piko-eliminate-schedules", "::piko::PipelineOp"> {
  let summary = "Leave load balancing to the parallel loop";
  let description = [{
    **Requires** the authored or the kernels level; best after `piko-fuse-stages`,
    for which it matters whether a stage asks for a core.

    **Does**: erases schedules that say `load_balance` and no more; one that also
    waits, takes batches or gives up an order becomes `resolved`. The kernel's
    loop over units of work is then OpenMP's own with a dynamic schedule, or a
    GPU's grid; the runtime's scheduler, which looks up who owns a unit, is not
    asked.

    **Guarantees** that the stage's bins run as before.

    Before:
    ```
    piko.stage @a bins [8, 8] threads 64 : @F -> [] {
      piko.schedule load_balance
      piko.process { ... }
    }
    ```
    After:
    ```
    piko.stage @a bins [8, 8] threads 64 : @F -> [] {
      piko.process { ... }
    }
    ```

    **Limits**: a schedule with a `dynamic` body stays with the runtime, which
    has to look at each bin.
  }];
}

#endif // PIKO_TRANSFORMS_AUTHOREDPASSES_TD
