// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes on stages and their phases.

#ifndef PIKO_TRANSFORMS_AUTHOREDPASSES_TD
#define PIKO_TRANSFORMS_AUTHOREDPASSES_TD

include "mlir/Pass/PassBase.td"

def ApplyPrecision : Pass<"piko-apply-precision", "::piko::PipelineOp"> {
  let summary = "Compute in each process phase as precisely as its stage says";
  let description = [{
    **Requires** the authored level, before stages are fused.

    **Does**, in a process phase that says `precision contracted`: turns each addition
    or subtraction of a product into a `math.fma`. In a phase that says
    `precision relaxed`, before that and in f32: turns each division into a product
    with a reciprocal, a constant or a `piko.approximate_reciprocal`. The reciprocal
    of a square root is a `piko.approximate_rsqrt`. A `math.sqrt` becomes a
    `piko.approximate_sqrt`.

    **Guarantees** that no precision is left, and that what is computed is written
    down: no later pass, vector form or number of threads changes a bit of it.
    Divisions by 0 and by infinities, roots of these and of negative numbers, and NaNs
    give what they do in `strict`.

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
  let summary = "Put the work of a loop under its condition";
  let description = [{
    **Requires** nothing in particular: it works on `scf` in any operation.

    **Does**: exchanges the arms of an `scf.if` whose first does nothing. Makes an
    `scf.if` of an `scf.index_switch` of a truth value. Makes truth values of the
    flags that arms yield as numbers. Makes a conjunction of a truth value that one
    arm yields where the other yields false, if it can be computed before. Moves the
    work of an `scf.while` that stands before the condition, in an `scf.if` with that
    condition, after it.

    **Guarantees** the same effects in the same order. Loops that were made of
    branches, with `<=`, with `break` or `continue`, then have a simple condition,
    which other passes expect.

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

    **Limits**: where a condition is known only after an effect, as with a `break`
    after an emission, the work stays before it.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def UpliftPixelLoops : Pass<"piko-uplift-pixel-loops", "::piko::PipelineOp"> {
  let summary = "Uplift counted loops over pixels to piko.parallel_pixels";
  let description = [{
    **Requires** the authored level, and loops as `piko-normalize-loops` leaves them.

    **Does**: turns a nest of counted loops in a process phase into a
    `piko.parallel_pixels`. The nest has a loop for each dimension of the pipeline,
    whose counter is a coordinate of a pixel of the bin. Pure operations between the
    loops move into the body. A test around the body that keeps the pixel in the bin
    becomes part of the box.

    Iterations hand nothing on and leave the loop nowhere. They change state by
    updates and stores of their own pixel, and by atomics that give nothing. They read
    what the loop changes at their own pixel only, and store to their own arrays.

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

    **Limits**: loops count by 1 upwards, x in y. A remark says what is in the way of
    other nests over pixels.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def OrderStages : Pass<"piko-order-stages", "::piko::PipelineOp"> {
  let summary = "Put the stages into the order in which they run";
  let description = [{
    **Requires** the authored level.

    **Does**: cuts the graph of stages into linear branches, at convergence,
    divergence and waits. Moves the stages so that branches stand in descending
    distance of their first stage from the drain. A branch comes later if it depends,
    by an edge or by `end_stage`, on one that has not come yet. The stages of a cycle
    of edges are taken together, in order of declaration. Numbers the stages
    (`lineage`) by the language's own rule: producers and stages waited for first,
    otherwise as declared.

    **Guarantees** that each stage stands after all stages that feed it or that it
    waits for, but for those on a cycle with it.

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

    **Limits**: a stage that waits for itself or for one that it feeds is an error.
    Stages that wait for each other are, too.
  }];
}

def InferDirectives : Pass<"piko-infer-directives", "::piko::PipelineOp"> {
  let summary = "Write down directives that hold without being said";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`).

    **Does**: turns the only `piko.assign_to` of an assign phase into a
    `piko.assign_previous` where the bin is proved to be that which the primitive was
    emitted from. *By range*: linear inequalities show that wherever a primitive is
    emitted, its cell lies between the bounds of the producer's bin. *By function*:
    the bin is computed from fields, handed on unchanged, as the producer's was from
    its own. A condition around the assignment stays.

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

    **Limits**: producers and the stage have bins of one size, and the stage has no
    source. On a cycle only what was proved for stages before it is used. Arithmetic
    that may wrap around proves nothing. A remark says which coordinate is not proved,
    and at which bound.
  }];
}

def PreSchedule : Pass<"piko-pre-schedule", "::piko::PipelineOp"> {
  let summary = "Make directives of schedules that say the same of every bin";
  let description = [{
    **Requires** the authored level; best after canonicalization.

    **Does**: follows all ways through the `dynamic` body of each schedule. Where they
    end with the same directives, these become the schedule's own, and the body is
    erased. A schedule without a body that is `direct_map`, `serialize` or `all` becomes
    `resolved`: who runs a bin is known when it is joined, and kernels ask no scheduler.
    Of `direct_map`, a CPU's thread takes its own units first (`piko.units =
    #piko<units mapped>`), and a GPU's block `b` of `n` those of number `b`, `b + n`, ... Of
    `serialize`, one loop runs all; of `all`, any thread takes the next.

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

    **Limits**: a schedule that depends on its bin or on constants keeps its body, which
    runs for each bin before the pipeline does; so does one that would fail. A remark
    says why.
  }];
}

def FuseStages : Pass<"piko-fuse-stages", "::piko::PipelineOp"> {
  let summary = "Run a stage where its primitives are emitted";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`); best
    after `piko-infer-directives`.

    **Does**: makes a stage part of the one that feeds it (loop fusion). Each
    `piko.emit` becomes the consumer's process phase, under the conditions of its
    assign phase, with numbers in place of fields. Both run for the same bin
    (`piko.assign_previous`) on the same core. One edge and no source lead to the
    consumer. It has no schedule, or one of the producer's kind that is not
    `load_balance`.

    A consumer with loops that is fed from a loop, and emits further, stays apart
    (loop fission). `after` lets `piko-fuse-kernels` put a list between the two, from
    which vectors are full.

    **Guarantees** that updates of a pixel and emissions keep their lineage order.

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

    **Limits**: stages on a cycle, that collect, with iterations that meet, or with
    more than `max-copies` copies stay. A remark gives the reason for each edge.
  }];
  let options = [
    Option<"maxCopies", "max-copies", "int64_t", "4",
           "To how many places a stage may be copied">,
    Option<"fission", "fission", "bool", "true",
           "Leave apart what is better run after its producer">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::ub::UBDialect"];
}

def TestEarly : Pass<"piko-test-early", "::piko::PipelineOp"> {
  let summary = "Move work under the test that decides whether it is needed";
  let description = [{
    **Requires** the authored level; best after `piko-fuse-stages`, which brings a
    test and the work before it together.

    **Does**: moves what a process phase computes into the one branch that uses it.
    The work then comes after whatever decides about the branch, such as the update of
    a depth. So a fragment that fails the depth test is not shaded.

    **Guarantees** that what moves has no effect and reads no state that the phase
    writes, so that results stay as they are. The test may be written in any way: it
    is not repeated, but stays where it is.

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
    stays. What two branches need stays, too.
  }];
}

def ProveBounds : Pass<"piko-prove-bounds", "::piko::PipelineOp"> {
  let summary = "Find indices that need no test when the pipeline runs";
  let description = [{
    **Requires** the authored level. It runs last: an access that moved out of the
    condition that proves something about it would be wrong after this.

    **Does**: marks accesses to buffers, images and lists as `checked` where each
    index is at least 0 and less than the extent. Marks updates, and loads and stores
    of images, with `piko.inside` where their coordinates lie between the bounds of
    the bin. Both are proved as in `piko-infer-directives`. What a `piko.contract`
    says of the host's numbers is known of them, also where stages emit them
    unchanged; not in checking mode. A read that fails gives 0: a buffer that
    contracts are about can be read there, even if it is empty.

    **Guarantees** that no access that is marked is outside.

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

    **Limits**: what follows otherwise from the contents of buffers, or from constants
    that the host sets, is not known. Nor is it known of a buffer, as it is of the domain, that
    it has an element at all. An index that is clamped to it, or a remainder, is
    therefore tested. A remark names each access that is, and with contracts one counts
    them.
  }];
}

def OwnPixels : Pass<"piko-own-pixels", "::piko::PipelineOp"> {
  let summary = "Find which pixel a primitive updates, so that bins can be divided";
  let description = [{
    **Requires** the authored level.

    **Does**: where all updates of a stage are at one pixel that follows from the
    primitive's fields and constants alone, copies that computation to the start of
    the assign phase, with a `piko.owner` after it. The stage then gets tiles of
    `tile` cells a side. Threads that each take tiles of a bin still update every
    pixel in lineage order. Bins that are no larger than a tile get none.

    **Guarantees** that the pixels that a stage changes, and the order in which it
    does so, stay as they are.

    Before:
    ```
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @depth[%x, %y : i32, i32] { ... }
    ```
    After, before it:
    ```
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.owner [%x, %y : i32, i32]
      %zero = arith.constant 0 : index
      piko.assign_to %zero
    ```

    **Limits**: updates at several pixels, at one that is read from a buffer or an
    image, or of a list, are refused with a remark. One thread then takes each bin.
  }];
  let options = [
    Option<"tile", "tile", "int64_t", "32",
           "Side of a tile, in cells of the domain">];
}

def EliminateSchedules
    : Pass<"piko-eliminate-schedules", "::piko::PipelineOp"> {
  let summary = "Erase schedules that ask for no more than load balancing";
  let description = [{
    **Requires** the authored or the kernels level; best after `piko-fuse-stages`,
    which leaves a consumer apart that asks for `load_balance`.

    **Does**: erases schedules that say `load_balance` and no more, which is what a
    stage without a schedule has. One that also waits, takes batches, runs for every
    bin, gives up an order or says its lanes becomes `resolved`. Kernels then ask no
    scheduler. On a CPU, threads count units by an atomic addition (`piko.units =
    #piko<units shared>`). On a GPU, a block has one unit, and the hardware begins it,
    as long as a grid has enough blocks.

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

    **Limits**: a schedule with a `dynamic` body stays, because the runtime has to
    look at each bin.
  }];
}

#endif // PIKO_TRANSFORMS_AUTHOREDPASSES_TD
