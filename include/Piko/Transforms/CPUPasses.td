// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes on loops over units of work on the CPU: what they test and fetch, and
// the order of their iterations.

#ifndef PIKO_TRANSFORMS_CPUPASSES_TD
#define PIKO_TRANSFORMS_CPUPASSES_TD

include "mlir/Pass/PassBase.td"

def Prefetch : Pass<"piko-prefetch", "::piko::PipelineOp"> {
  let summary = "Prefetch what later primitives refer to";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: software prefetching of indirect accesses. Loops over the primitives of a
    bin that read state at fields of the primitive prefetch these elements 8 primitives
    ahead (`piko.prefetch`), and primitives 16 ahead (`piko.cpu.prefetch_item`).
    Primitives that refer to nothing are prefetched if they are scattered and have more
    than 16 bytes. Loops over rows whose pixels read up to three places, each from the
    one before, prefetch in stages: the last a row ahead, each earlier one a row
    further. Buffers that the nearest caches hold have no stage.

    **Guarantees** that nothing changes but time: no prefetch fails, and the reads that
    lead to one stay inside their buffers.

    Before:
    ```
    scf.for %i = %begin to %end step %one {
      %t = piko.storage.item %bins[%i] ...
      %k = piko.get %t "vertex" ...
      ... piko.load @vertices[%k : i32] "x" : f32 ...
    ```
    After:
    ```
    scf.for %i = %begin to %end step %one {
      %far = ...                        // %i + 16
      piko.cpu.prefetch_item %bins[%far] : !piko.bins<@Triangle>
      %near = ...                       // %i + 8, or the last one
      %s = piko.storage.item %bins[%near] ...
      %j = piko.get %s "vertex" ...
      piko.prefetch @vertices[%j : i32]
      %t = piko.storage.item %bins[%i] ...
    ```

    **Limits**: computed indices of primitives, stages with one bin for all, reads on
    the much longer side of a condition, state that a loop over rows changes, and boxes
    have no prefetches.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def HoistBounds : Pass<"piko-hoist-bounds", "::piko::PipelineOp"> {
  let summary = "Test the indices of a loop before it";
  let description = [{
    **Requires** loops over units (`piko-form-units`); last before
    `convert-piko-to-scf`, as nests stand there twice after it.

    **Does**: loop versioning by interval arithmetic. It takes nests of loops, outermost
    first, in which the range of each tested index is known before the nest: sums,
    products, minima, maxima, choices and remainders of invariants and counts, and
    quotients, shifts and masks by constants. Where a test before the nest finds all
    inside, a copy runs, whose accesses are `checked` and whose remainders are not
    tested; else the nest runs as it was. An innermost loop gets consecutive indices, so
    that LLVM can form vectors.

    **Guarantees** the same accesses in order, and the same errors.

    Before:
    ```
    scf.while (%j = %zero) { %j < %n } do {
      %i = arith.addi %base, %j : i32
      %x = piko.load @lights[%i : i32] "x" : f32
    ```
    After:
    ```
    scf.if %all_inside {
      scf.while (%j = %zero) { %j < %n } do {
        %i = arith.addi %wide_base, %wide_j : index
        %x = piko.load checked @lights[%i : index] "x" : f32
    } else {
      // as before
    }
    ```

    **Limits**: with another index, as one of 32 bits from a buffer, only inner loops
    are looked at. Larger nests than the options say stay. A loop that counts down, or
    not by one, has no range.
  }];
  let options = [
    Option<"maxOperations", "max-operations", "int64_t", "64",
           "How many operations an innermost loop may have to stand there twice">,
    Option<"maxNestOperations", "max-nest-operations", "int64_t", "128",
           "The same of a nest of loops">];
}

def HoistLoads : Pass<"piko-hoist-loads", "::piko::PipelineOp"> {
  let summary = "Read before a loop what its condition reads";
  let description = [{
    **Requires** loops over units (`piko-form-units`); before `piko-hoist-bounds` and
    `piko-plan-vectors`, which look for loops with a bound that is known before them.

    **Does**: loop-invariant code motion. A loop's condition may read a number from
    state without an index, as an extent that the user keeps with a buffer. If the
    kernel does not change it, it is read before the loop, with what is computed from it
    alone.

    **Guarantees** the same numbers: such a read cannot fail, and a condition is
    evaluated at least once.

    Before:
    ```
    scf.while (%x = %zero) : (i32) -> i32 {
      %width = piko.load @width "value" : i32
      %more = arith.cmpi slt, %x, %width : i32
      scf.condition(%more) %x : i32
    } do { ... }
    ```
    After:
    ```
    %width = piko.load @width "value" : i32
    scf.while (%x = %zero) : (i32) -> i32 {
      %more = arith.cmpi slt, %x, %width : i32
      scf.condition(%more) %x : i32
    } do { ... }
    ```

    **Limits**: elements of arrays and buffers stay, as their indices are tested; so
    does what a loop's body reads, which LLVM moves.
  }];
}

def IfConvert : Pass<"piko-if-convert", "::piko::PipelineOp"> {
  let summary = "Choose values without branches";
  let description = [{
    **Requires** loops over units (`piko-form-units`); before `piko-plan-vectors`,
    which then counts no branches to mask.

    **Does**: if-conversion. It takes `scf.if` and `scf.index_switch` whose arms only
    read fields and compare, convert and choose integers. What the arms hold moves
    before the choice, and each result becomes an `arith.select`. `vector[axis]` and
    `h == 12 || h == 14 ? x : z` come as such switches, and what they choose by is often
    not predictable.

    **Guarantees** the same values.

    Before:
    ```
    %x = scf.index_switch %axis -> f32
    case 0 {
      scf.yield %a : f32
    }
    default {
      scf.yield %b : f32
    }
    ```
    After:
    ```
    %is_0 = arith.cmpi eq, %axis, %zero : index
    %x = arith.select %is_0, %a, %b : f32
    ```

    **Limits**: arms that do arithmetic, compare floats, read state or have an effect
    stay, as do those of a choice without results.
  }];
  let options = [
    Option<"maxCases", "max-cases", "int64_t", "4",
           "How many cases, but for the default, a switch may have">,
    Option<"maxOperations", "max-operations", "int64_t", "8",
           "How many operations the arms may have together">];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def MergeBounds : Pass<"piko-merge-bounds", "::piko::PipelineOp"> {
  let summary = "Test the index of an element once for all of its fields";
  let description = [{
    **Requires** access to state that is tested (`convert-piko-to-scf`).

    **Does**: merges tests with the same condition, each of which guards a read of the
    same buffer or image, into the first one. So an element has one branch, and one
    address, also where lanes read in different places. Reads of the element under
    further conditions join if the record is no larger than a cache line. Tests that
    guard writes to the same state become the last of them, so that lanes can write its
    fields at once.

    **Guarantees** the same numbers: of what the kernel changes, nothing between two
    tests writes the field of a read that joins, or uses that of a write. Errors, whose
    text names the index but no field, keep their order.

    Before:
    ```
    %x = scf.if %inside -> (f32) {
      %1 = piko.load checked @mesh[%i : i32] "x" : f32
      scf.yield %1 : f32
    } else { ... }
    %square = arith.mulf %x, %x : f32
    %y = scf.if %inside -> (f32) {
      %2 = piko.load checked @mesh[%i : i32] "y" : f32
      scf.yield %2 : f32
    } else { ... }
    ```
    After:
    ```
    %xy:2 = scf.if %inside -> (f32, f32) {
      %1 = piko.load checked @mesh[%i : i32] "x" : f32
      %2 = piko.load checked @mesh[%i : i32] "y" : f32
      scf.yield %1, %2 : f32, f32
    } else { ... }
    %square = arith.mulf %xy#0, %xy#0 : f32
    ```

    **Limits**: conditional reads of state that the kernel changes keep their tests; so
    do writes with another test between them.
  }];
}

def CombineBounds : Pass<"piko-combine-bounds", "::piko::PipelineOp"> {
  let summary = "Test independent indices at once";
  let description = [{
    **Requires** access to state that is tested (`convert-piko-to-scf`), once for an
    element (`piko-merge-bounds`).

    **Does**: tests of a block that need nothing of each other's elements become one: a
    vote (`piko.cpu.vote`) that all hold guards the reads of all; where it fails, each
    has its own test. So look-ups in tables have a branch for each level. A vote is by
    all lanes, so no read waits for the mask that a test makes: a test that is alone
    becomes one, too. Sizes that one index is compared with become their minimum, which
    is the same for a whole loop, and indices with one size their maximum.

    **Guarantees** the same numbers and the same errors: nothing that may change what a
    test reads stands between it and the first.

    Before:
    ```
    %x = scf.if %i_inside -> (i32) {
      %1 = piko.load checked @table[%i : i32] "value" : i32
      scf.yield %1 : i32
    } else { ... }
    %y = scf.if %j_inside -> (i32) {
      %2 = piko.load checked @table[%j : i32] "value" : i32
      scf.yield %2 : i32
    } else { ... }
    ```
    After:
    ```
    %largest = arith.maxui %i, %j : i32
    %inside = arith.cmpi ult, %largest_index, %n : index
    %all = piko.cpu.vote %inside
    %xy:2 = scf.if %all -> (i32, i32) {
      %1 = piko.load checked @table[%i : i32] "value" : i32
      %2 = piko.load checked @table[%j : i32] "value" : i32
      scf.yield %1, %2 : i32, i32
    } else {
      // as before
    }
    ```

    **Limits**: indices must vary with the same loops, so that what lanes share stays
    scalar. No read passes a loop or a condition that is no test.
  }];
  let options = [
    Option<"maxTests", "max-tests", "size_t", "8",
           "How many tests become one">];
  let dependentDialects = ["::mlir::arith::ArithDialect", "::mlir::scf::SCFDialect",
                           "::piko::PikoDialect"];
}

def ThreadJumps : Pass<"piko-thread-jumps", "::piko::PipelineOp"> {
  let summary = "Put work under the conditions that need it";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`).

    **Does**: short-circuit evaluation and jump threading, which undo what earlier
    passes put before conditions to see through them. Of a conjunction, the half that
    takes work (`min-weight`), the right one first, moves under the other half, and
    with it what only the sides use. A condition that is known, and does nothing, on one
    side of an earlier one moves into the other side. So lanes of which none passes the
    first test do nothing else. A test whether any bit of a float is set goes where a
    condition around it has found that the float is not 0.

    **Guarantees** the same results: what moves has no effects, or moves past nothing
    that has.

    Before:
    ```
    %isSeen = arith.cmpf ogt, %depth, %zero : f32
    %both = arith.andi %isInside, %isSeen : i1
    %key = scf.if %both -> (i32) {
      %1 = arith.bitcast %depth : f32 to i32
      scf.yield %1 : i32
    } else {
      scf.yield %c0 : i32
    }
    %any = arith.cmpi ne, %key, %c0 : i32
    scf.if %any {
      piko.atomic max_signed @seen[%i : index] "key", %key : i32
    }
    ```
    After, where the depth takes some work:
    ```
    scf.if %isInside {
      %isSeen = arith.cmpf ogt, %depth, %zero : f32
      scf.if %isSeen {
        %1 = arith.bitcast %depth : f32 to i32
        piko.atomic max_signed @seen[%i : index] "key", %1 : i32
      }
    }
    ```

    **Limits**: conditions with results are not threaded.
  }];
  let options = [
    Option<"minWeight", "min-weight", "int64_t", /*default=*/"4",
           "the least work, in instructions, that is worth a branch">];
}

def TabulateInvariants : Pass<"piko-tabulate-invariants", "::piko::PipelineOp"> {
  let summary = "Compute once what each iteration of an inner loop computes alike";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`); best after `piko-vectorize`,
    where what lanes share is scalar.

    **Does**: loop-invariant code motion by scalar expansion. A float in an inner loop,
    such as one over lights, may take a root or a division, and follow from the
    iteration's number and from state that the kernel does not change. A loop before all
    others then computes it for each iteration into an array, from which the inner loop
    reads it. With fewer than 32 iterations, more than 1,024, or more than the state has
    elements, the loop runs as it was.

    **Guarantees** the same bits.

    Before:
    ```
    scf.for %y = %lo to %hi step %one {
      scf.for %i = %zero to %n step %one {
        %x = piko.load checked @lights[%i : index] "x" : f32
        %length = math.sqrt %x : f32
    ```
    After:
    ```
    scf.for %i = %zero to %count step %one {
      %x = piko.load checked @lights[%i : index] "x" : f32
      %root = math.sqrt %x : f32
      memref.store %root, %lengths[%i] : memref<1024xf32>
    }
    scf.for %y = %lo to %hi step %one {
      scf.for %i = %zero to %n step %one {
        %length = scf.if %fits -> (f32) {
          %root = memref.load %lengths[%i] : memref<1024xf32>
    ```

    **Limits**: loops that count from 0 by one, up to a number that does not change, and
    of state the elements of the iterations' own numbers.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def UnrollAndJam : Pass<"piko-unroll-and-jam", "::piko::PipelineOp"> {
  let summary = "Let iterations of a loop share the loop inside of it";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`); best after
    `piko-merge-bounds`, where accesses need no test.

    **Does**: unroll-and-jam by four. It takes loops that end with an inner loop which
    changes the same elements in each outer iteration, as sums of products of matrices
    do. Four outer iterations share one run of the inner loop, and a copy hands what it
    stores to the next. So each element is loaded and stored once for four. The
    remainder runs as it was.

    **Guarantees** the same bits: all changes of an element are in one iteration of the
    inner loop, and keep their order there.

    Before:
    ```
    scf.for %k = %zero to %n step %one {
      %a = piko.load checked @a[%k : index] "v" : f32
      scf.for %j = %zero to %m step %one {
        %i = arith.addi %row, %j : index
        %old = piko.load checked @c[%j : index] "v" : f32
    ```
    After:
    ```
    scf.for %k = %zero to %end step %four {
      %a0 = piko.load checked @a[%k : index] "v" : f32
      %a1 = piko.load checked @a[%k1 : index] "v" : f32
      ...
      scf.for %j = %zero to %m step %one {
        %old = piko.load checked @c[%j : index] "v" : f32
        ...
      }
    }
    scf.for %k = %end to %n step %one { ... }
    ```

    **Limits**: both loops count by one, up to invariants. The inner one has up to 24
    operations, no control flow, no tested index, and at least six iterations as far as
    is known. What changes is indexed by its count, or by sums of that and invariants.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ReduceUpdates : Pass<"piko-reduce-updates", "::mlir::ModuleOp"> {
  let summary = "Let threads share a bin where updates are reductions";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: lets threads share a bin that is the whole domain, which one thread runs
    otherwise, in lineage order. Where all updates of a kernel are arg-min reductions,
    each thread gets private images (`piko.cpu.private_images`), and notes in an
    internal one which unit changed a pixel last. When the kernel ends, the runtime
    selects what is first by the key, then by the unit. Images whose numbers each change
    by one commutative integer operation are changed by `piko.atomic` instead. Remarks
    say what is selected, or what is in the way.

    **Guarantees** the same bits and errors: of equal keys, the first in lineage order
    is kept, or the last.

    Before:
    ```
    %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Dot>
    ...
      %closer = piko.update @depth[%x, %y : i32, i32] in %bin {
      ^bb0(%old: f32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new : f32] results [%less : i1]
      } -> i1
    ```
    After:
    ```
    %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Dot>
    %shared = piko.cpu.private_images @depth by [0] ["olt"] carries []
      keeps [array<i64: 0>] unit @depth.unit of %writer
    ...
      %closer = piko.update @depth[%x, %y : i32, i32] in %bin {
        ...
      } -> i1
      scf.if %closer {
        scf.if %shared {
          piko.update @depth.unit[%x, %y : i32, i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%u : i32]
          }
        }
      }
    ```

    **Limits**: phases that take lists, stages that host others, schedules that
    serialize and checked pipelines stay on one thread. At run time, the bin stays there
    if primitives are few or memory is limited.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def Privatize : Pass<"piko-privatize", "::piko::PipelineOp"> {
  let summary = "Reduce to private copies of state, without locks";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: privatization of reductions. Where a kernel only changes a field of a
    buffer or an image by `piko.atomic` of one kind, on integers and without results,
    each thread gets a copy (`piko.cpu.private_copy`), which it changes without locks.
    When the kernel ends, the runtime combines the changed parts of all copies with the
    state, in parallel, and resets them. The first thread has the state itself. Remarks
    say what has copies, or what is in the way.

    **Guarantees** the same bits and the same errors: these operations commute and
    associate, and nothing reads the field before the kernel ends.

    Before:
    ```
    scf.forall (%unit) in (%units) {
      %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Dot>
      ...
        piko.atomic add checked @counts[%i : i32] "value", %one : i32
    ```
    After:
    ```
    scf.forall (%unit) in (%units) {
      %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Dot>
      %copy = piko.cpu.private_copy add @counts "value" of %writer
      ...
        piko.atomic add checked @counts[%i : i32] "value", %one in %copy : i32
    ```

    **Limits**: at run time, there are no copies for more than 8 threads, for state of
    more than 64 MiB, under a limit of memory, or where few primitives come for a large
    state.
  }];
}

#endif // PIKO_TRANSFORMS_CPUPASSES_TD
