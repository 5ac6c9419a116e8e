// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes on loops over units of work on the CPU: what they test and fetch, and
// the order of their turns.

#ifndef PIKO_TRANSFORMS_CPUPASSES_TD
#define PIKO_TRANSFORMS_CPUPASSES_TD

include "mlir/Pass/PassBase.td"

def Prefetch : Pass<"piko-prefetch", "::piko::PipelineOp"> {
  let summary = "Ask for what later primitives refer to";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: a loop over the primitives of a bin that reads state at indices
    which are fields of the primitive asks for the elements of a primitive
    further on (`piko.prefetch`), and for a primitive still further on
    (`piko.cpu.prefetch_item`): neither lies in memory in the order of the bin
    (S. Ainsworth and T. M. Jones, "Software Prefetching for Indirect Memory
    Accesses", 2017). Where primitives refer to nothing, they are asked for
    themselves, if they were put into the bin from others, and have more than 16
    bytes: smaller ones are copied into order. A stage with one bin for all takes
    its primitives as they were made, whose neighbours mostly refer to the same;
    it is left alone.

    A loop over rows of pixels that reads a place from memory, as the number of
    the triangle that is seen, asks in stages, a row further on for each read on
    the way: for the corners of triangles of the next row, for the triangles of
    the row behind it, and for the numbers of the third one. Of pixels that refer
    to the same as those of the row before, nothing is asked. There is no stage
    for buffers that the nearest caches hold (4 MiB), nor for what pixels read at
    their own place if it is less than 1 MiB: in larger images each row of a bin
    is on a page of its own, where no hardware prefetcher follows.

    **Guarantees** that nothing changes but time: a prefetch reads nothing and
    cannot fail.

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

    **Limits**: of primitives, indices that are computed, and those of reads that
    only the much longer side of a condition does, are not followed. Of pixels,
    only reads of buffers are, and of state that the loop does not change, not in
    boxes nor for each primitive.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def HoistBounds : Pass<"piko-hoist-bounds", "::piko::PipelineOp"> {
  let summary = "Test the indices of a loop in front of it";
  let description = [{
    **Requires** loops over units (`piko-form-units`); last before `convert-piko-to-scf`, because
    behind it loops stand there twice.

    **Does**: takes nests of loops, outermost first, in which the range of each
    index that is tested is known in front: sums, products, minima, maxima,
    choices and remainders of numbers that do not change and of counts by one, and
    their quotients, shifts and masks by constants.
    Interval arithmetic in front of the nest finds the least and the greatest
    index, and a test whether all are inside, and nothing wraps around; then a
    copy of the nest runs whose accesses are `checked`, and whose divisions that
    are known to have a result are not tested either. An innermost loop in which
    each index is a sum with the count at most once gets indices that LLVM sees
    to be in a row, so that it can form vectors. Otherwise the nest runs as it
    was.

    **Guarantees** the same accesses in the same order, and the same errors.

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

    **Limits**: a nest with another index, as one of 32 bits that is read from a
    buffer, stays, and the loops inside it are looked at; long nests, and those in
    which nothing is tested, stay, too. A loop that counts down, or by another
    number than one, has no range.
  }];
  let options = [
    Option<"maxOperations", "max-operations", "int64_t", "64",
           "How many operations an innermost loop may have to stand there twice">,
    Option<"maxNestOperations", "max-nest-operations", "int64_t", "128",
           "The same of a nest of loops">];
}

def HoistLoads : Pass<"piko-hoist-loads", "::piko::PipelineOp"> {
  let summary = "Read in front of a loop what its condition reads";
  let description = [{
    **Requires** loops over units (`piko-form-units`); before `piko-hoist-bounds`
    and `piko-vectorize`, which look for loops that count to a number that they
    know in front.

    **Does**: a number that a loop's condition reads from state without an index,
    and that the kernel does not change, as an extent that the user keeps with a
    buffer, is read in front of the loop, with what is computed from it alone.

    **Guarantees** the same numbers: such a read cannot fail, and a condition is
    found at least once.

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

    **Limits**: elements of arrays and buffers stay, as their indices are tested;
    so does what is read behind a loop's condition, which LLVM moves.
  }];
}

def IfConvert : Pass<"piko-if-convert", "::piko::PipelineOp"> {
  let summary = "Choose values without branches";
  let description = [{
    **Requires** loops over units (`piko-form-units`); before `piko-vectorize`, which has no branches
    to mask then.

    **Does**: takes `scf.if` and `scf.index_switch` whose arms do nothing but
    read fields, compare, convert and choose, moves what the arms hold in front,
    and chooses each result by `arith.select`. `vector[axis]` and `h == 12 || h
    == 14 ? x : z` come as such switches, and what they choose by is often not
    predictable.

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

    **Limits**: arms that compute with floats, read state or have an effect stay,
    as do those of a choice without results.
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

    **Does**: of the tests that have the same outcome, each of which guards a read
    of the same buffer or image, the first one guards all of the reads. So there is
    one branch for an element, and its address is computed once, also where lanes
    read elements in different places. What is read of the same element behind a
    condition is read along, if the record is not larger than a line of the cache.
    Tests that guard writes to fields of the same element become the last of them,
    so that lanes can write these at once.

    **Guarantees** the same numbers: what the kernel changes is read at the place of
    the first only where nothing in between writes the field, and written at that of
    the last only where nothing in between uses it; and the same errors, whose text
    names the index but no field, in the same order.

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

    **Limits**: reads in conditions of state that the kernel changes keep their
    tests; so do writes with another test between them.
  }];
}

def ThreadJumps : Pass<"piko-thread-jumps", "::piko::PipelineOp"> {
  let summary = "Put work behind the conditions that need it";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`).

    **Does**: short-circuit evaluation and jump threading, which undo what earlier
    passes put in front of conditions to see through them. Of a conjunction, the
    right half, or else the left one, if it takes work, moves behind the other,
    with what else serves only the sides. A condition that is known on one side of an earlier one, and does
    nothing there, moves into the other side. So lanes of which none passes the
    first test do nothing else. A condition that asks whether any bit of a number
    is set, which bits of a float are that one around it compares with 0, goes.

    **Guarantees** the same results: what moves has no effects, or moves past
    nothing that has.

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

    **Limits**: conditions with results do not move behind others.
  }];
  let options = [
    Option<"minWeight", "min-weight", "int64_t", /*default=*/"4",
           "the least work, in instructions, that is worth a branch">];
}

def TabulateInvariants : Pass<"piko-tabulate-invariants", "::piko::PipelineOp"> {
  let summary = "Compute once what each turn of an inner loop computes alike";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`); best behind
    `piko-vectorize`, where what lanes share is scalar.

    **Does**: where an inner loop, as one over lights, is in others, as those over
    pixels, and a number that takes a root or a division follows from the turn's
    own number and from state that the kernel does not change, such as the length
    of a light's direction, a loop in front of all others computes it for each turn
    into an array (scalar expansion), from which the inner loop reads it. With fewer
    than 32 turns, or more than 1,024, the loop runs as it was.

    **Guarantees** the same bits: what is read is what was computed, and the places
    read are those of the loop's own turns.

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

    **Limits**: loops that count from 0 by one, up to a number that does not
    change, and of state the elements of the turns' own numbers.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def UnrollAndJam : Pass<"piko-unroll-and-jam", "::piko::PipelineOp"> {
  let summary = "Let turns of a loop share the loop inside of it";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`); best behind
    `piko-merge-bounds`, where accesses need no test.

    **Does**: where a loop ends with an inner one, whose turns change the same
    elements in each turn of the outer loop, as sums of products of matrices do,
    four turns of the outer loop share one run of the inner one: what a copy stores
    is handed on to the next, so that each element is loaded and stored once for
    four. What is left over runs as it was.

    **Guarantees** the same bits: turns that change the same element do so in their
    order, because it is the same turn of the inner loop in which they do. Private
    arrays are treated as state is.

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

    **Limits**: both loops count up by one, to numbers that neither changes; the
    inner one has up to 24 operations, no control flow and no test of an index,
    and is not known to turn less than six times.
    An index of what is changed must be the inner count, or a sum of it and of
    what neither loop changes; a remark says where it is not.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ReduceUpdates : Pass<"piko-reduce-updates", "::mlir::ModuleOp"> {
  let summary = "Let threads share a bin where updates are reductions";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: updates of a pixel run in order of lineage, so that one thread runs a
    bin that is the whole domain, unless each primitive updates one pixel that is
    known before (`piko-own-pixels`). Where all that the kernel's updates do is an
    arg-min reduction, threads share the bin. Each gets images of its own
    (`piko.cpu.private_images`), and notes in one more, an internal one, by which
    unit of work a pixel was changed last. When the kernel ends, the runtime
    selects for each pixel what is first by the key, and among equal keys by the
    unit, in parallel, by a function that `convert-piko-to-llvm` makes. The first
    thread has the state itself.

    An update selects if it gives numbers of the pixel other values on one
    condition, which compares new numbers with those that they replace: `<`, `<=`,
    `>` and `>=`, and what is compared where they are equal, if that is an integer.
    What it overwrites without any condition keeps the last. Other images may be
    overwritten, at the same pixel, where the update says that it has changed
    something; what is computed there must not fail, and must not leave anything
    else behind, as it may be done for what another thread's primitives replace.

    Images whose numbers are all changed by one integer operation that commutes and
    associates, such as a sum, are changed by `piko.atomic` instead, which
    `piko-privatize` may give private copies.

    **Guarantees** the same bits and the same errors: of what is equal by the key
    the first in order of lineage is kept, or the last, on any number of threads.

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

    **Limits**: phases that take lists, stages that host others, and schedules that
    serialize stay on one thread. Whether sharing is worth the memory, and the time
    to combine, is known when the pipeline runs: under a limit of memory, and where
    few primitives come for a large domain, one thread runs the bin. Remarks say
    what is selected, and what is in the way.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def Privatize : Pass<"piko-privatize", "::piko::PipelineOp"> {
  let summary = "Reduce to private copies of state, without locks";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: where all that a kernel does to a field of a buffer or an image is
    `piko.atomic` of one kind, on integers and without results, each thread gets
    a copy of its own (`piko.cpu.private_copy`), to which it reads and writes
    without locks. When the kernel ends, the runtime combines the copies with the
    state, in parallel, and leaves in them what changes nothing, so that the next
    launch finds them as they must be. It does so for runs of elements that have
    been written to, by a function that `convert-piko-to-llvm` makes for the field
    and the kind. The first thread has the state itself: on one thread there is no
    copy. This is the privatization of reductions of parallelizing compilers.

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

    **Limits**: whether copies are worth their memory, and the time to combine
    them, is known when the pipeline runs: there are none for more than 8 threads,
    for state of more than 64 MiB, under a limit of memory, and where few
    primitives come for a large state. Remarks say what has copies and what is in
    the way of others.
  }];
}

#endif // PIKO_TRANSFORMS_CPUPASSES_TD
