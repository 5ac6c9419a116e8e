// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes on loops over units of work on the CPU: what of them becomes vectors.

#ifndef PIKO_TRANSFORMS_VECTORPASSES_TD
#define PIKO_TRANSFORMS_VECTORPASSES_TD

include "mlir/Pass/PassBase.td"

def NarrowIntegers : Pass<"piko-narrow-integers", "::piko::PipelineOp"> {
  let summary = "Take edge functions in 32 bits where they fit";
  let description = [{
    **Requires** loops over units (`convert-piko-to-scf`).

    **Does**: loop versioning with exact narrowing. It takes loops over pixels that use
    signs of 64-bit affine functions, as edge functions are. A test before the loop
    evaluates these at the corners of the domain, divided by a power of two that divides
    their steps. Where all fit into 32 bits, a second version computes the signs there,
    and a third one also converts from 32 bits to floats. With `lanes`, loops over
    convex shapes are strip-mined and interchanged: a strip has `lanes` columns, and the
    rows that all half-planes reach.

    **Guarantees** the same signs and numbers, also where 64 bits overflow.

    Before:
    ```
    scf.for %x = %lo to %hi step %one : i32 {
      %1 = arith.extsi %x : i32 to i64
      %2 = arith.muli %step, %1 : i64
      %edge = arith.addi %first, %2 : i64
      %isInside = arith.cmpi sge, %edge, %zero : i64
      ...
    } {piko.lanes}
    ```
    After, where `%step` is a multiple of 256:
    ```
    scf.if %fits {
      %step32 = ...
      %first32 = ...
      scf.for %x = %lo to %hi step %one : i32 {
        %1 = arith.muli %step32, %x : i32
        %edge = arith.addi %first32, %1 : i32
        %isInside = arith.cmpi sge, %edge, %zero : i32
        ...
      } {piko.lanes}
    } else {
      // as before
    }
    ```

    **Limits**: rows of boxes need `specifyLanes(Iterations)`. Loops of over 200
    operations have no third version. Interchanged pixels have no order (`piko.rows`),
    and access only their own elements of what they change.
  }];
  let dependentDialects = ["::mlir::vector::VectorDialect"];
  let options = [
    Option<"laneCount", "lanes", "int64_t", /*default=*/"0",
           "lanes of a vector, which a strip has as columns; 0: no strips">];
}

def Lockstep : Pass<"piko-lockstep", "::piko::PipelineOp"> {
  let summary = "Run iterations that meet at barriers as lanes";
  let description = [{
    **Requires** loops over units; `piko-split-loops` with `lockstep`, which leaves
    parallel loops of few iterations to this pass.

    **Does**: a `piko.parallel_for` with barriers, of up to 16 iterations, becomes one
    vector, whose lanes run in lockstep. A barrier is then nothing, a collective a
    reduction or a scan of the vector. What has no such form, or would take longer, is
    cut into loops between barriers, by loop fission.

    **Guarantees** the same order between iterations as barriers give.

    Before:
    ```
    piko.parallel_for %c16 {
    ^bb0(%i: index):
      %some = arith.cmpf olt, %v, %z : f32
      %any = piko.reduce %some : i1 { ... arith.ori ... }
      ...
    }
    ```
    After:
    ```
    %some = arith.cmpf olt, %v, %z : vector<16xf32>
    %any = vector.reduction <or>, %some : vector<16xi1> into i1
    ...
    ```

    **Limits**: a number of iterations that is known; loops around them have one version
    (`piko.barriers`).
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect",
                           "::mlir::vector::VectorDialect"];
}

def PlanVectors : Pass<"piko-plan-vectors", "::piko::PipelineOp"> {
  let summary = "Decide which loops become vectors, and shape these";
  let description = [{
    **Requires** loops over units with checked access to state (`convert-piko-to-scf`),
    and a mapping of lanes (`piko-map-lanes`).

    **Does**: compares vectors with scalar code by a cost model, unless `specifyLanes`
    decides, for loops over primitives, parallel loops, and loops in order whose
    iterations are independent. Those that win are marked for `piko-vectorize`. First,
    inner loops that lanes leave at different times are flattened, collapsed, or merged
    with those around them (loop merging with iteration delaying, `piko.cpu.elect`), and
    iterations with nothing to do taken out by stream compaction, where that pays; a
    loop that appends to lists pushes (`piko.storage.push`), to be compacted likewise. Short
    loops keep a scalar version. With a `window`, loops with close estimates have two
    versions (`piko.cpu.takes_vectors`). Remarks say why.

    **Guarantees** the same operations for each iteration, in order where it shows.

    Before:
    ```
    scf.for %x = %lo to %hi step %c1 { ... } {piko.lanes}
    ```
    After:
    ```
    scf.if %is_long {
      scf.for %x = %lo to %hi step %c1 { ... } {piko.lanes, piko.vector_lanes = 16}
    } else {
      scf.for %x = %lo to %hi step %c1 { ... }
    }
    ```

    **Limits**: loops whose iterations hand on values, other than lengths of lists, use
    views of memory, or have more than 16 KiB of arrays stay scalar.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
  let options = [
    Option<"laneCount", "lanes", "int64_t", "16",
           "Lanes of a vector: 4, 8 or 16 (default: 16)">,
    Option<"inTurns", "turns", "bool", "false",
           "only loops of what lanes do in turns, after piko-vectorize">,
    Option<"flattens", "flatten", "bool", "true",
           "flatten nests that lanes leave at different times">,
    Option<"mergeGain", "merge-gain", "double", "0.9",
           "merge nests where that is expected to take no more than this share of "
           "what else does">,
    Option<"compacts", "compact", "bool", "true",
           "compact loops of which some iterations have nothing to do">,
    Option<"window", "window", "double", "1",
           "hold a loop as vectors and as a scalar loop, of which the runtime runs "
           "what is faster, where estimates are within this factor of each other "
           "(default: 1, none)">,
    Option<"sensitivities", "sensitivities", "bool", "false",
           "print the estimates of such loops, and how they depend on the numbers "
           "of the cost model, as lines of JSON">
  ];
}

def Vectorize : Pass<"piko-vectorize", "::piko::PipelineOp"> {
  let summary = "Run primitives, or iterations, as lanes of vectors";
  let description = [{
    **Requires** loops that `piko-plan-vectors` has marked with a number of lanes.

    **Does**: runs that many iterations at once. What lanes share stays scalar; the rest
    becomes vectors, by predication. Access becomes gathers and scatters, or masked
    loads and stores of rows. What is ordered, or has no vector form, runs lane by lane,
    in a loop that `marks-turns` marks (`piko.turns`), to be planned again: the CPU's
    sequence does so twice. A mark on what cannot become vectors is an error.

    **Guarantees** the same operations for each iteration, emissions and updates in
    order, and the same bits for any number of lanes.

    Before:
    ```
    scf.for %x = %lo to %hi step %c1 {
      %z = ...
      %old = piko.load checked @depth[%x, %y : index, index] "z" : f32
      %nearer = arith.cmpf olt, %z, %old : f32
      scf.if %nearer {
        piko.store %z, checked @depth[%x, %y : index, index] "z" : f32
      }
    } {piko.lanes, piko.vector_lanes = 16}
    ```
    After:
    ```
    scf.for %x0 = %lo to %hi step %c16 {
      %mask = ...                              // lanes below %hi
      %z = ... : vector<16xf32>
      %old = piko.cpu.gather consecutive @depth[%x0, %y : index, index] "z"
        mask %mask : vector<16xi1>, vector<16xf32>
      %nearer = arith.cmpf olt, %z, %old : vector<16xf32>
      %both = arith.select %mask, %nearer, %none
      %any = vector.reduction <or>, %both
      scf.if %any {
        piko.cpu.scatter %z, consecutive @depth[%x0, %y : index, index] "z"
          mask %both : vector<16xi1>, vector<16xf32>
      }
    }
    ```

    **Limits**: 4, 8, 16 or 32 lanes.
  }];
  let options = [
    Option<"marksTurns", "marks-turns", "bool", "true",
           "mark loops of what lanes do in turns, for piko-plan-vectors">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect",
                           "::mlir::vector::VectorDialect"];
}

def DistributeLoops : Pass<"piko-distribute-loops", "::piko::PipelineOp"> {
  let summary = "Compute what loops of a primitive start from for all lanes";
  let description = [{
    **Requires** loops over units, after `piko-vectorize`: it takes the loops over
    primitives that are still scalar, but for `specifyLanes(One)`.

    **Does**: loop fission with scalar expansion. Of `lanes` primitives, a first loop
    computes what follows from each alone, such as a triangle's edges, and writes it
    into arrays. A second loop reads these, and runs the rest of each iteration. The
    first loop becomes vectors of primitives; for fewer than max(`lanes` / 4, 2) it
    stays scalar. Pure operations under conditions are speculated.

    **Guarantees** the same bits: what moves has no effects, and reads nothing that the
    kernel changes.

    Before:
    ```
    scf.for %i = %begin to %end step %one {
      %t = piko.storage.item %bins[%i]
      %x = piko.get %t "x"
      %y = piko.get %t "y"
      %area = arith.muli %x, %y : i32
      scf.for %p = %lo to %hi step %one {
        ... %area ...
      }
    }
    ```
    After, where the second line stands for vectors of lanes:
    ```
    scf.for %block = %begin to %end step %lanes {
      scf.for %i = %block to %after step %one {
        ...
        memref.store %area, %areas[%lane] : memref<16xi32>
      }
      scf.for %i = %block to %after step %one {
        %area = memref.load %areas[%lane] : memref<16xi32>
        scf.for %p = %lo to %hi step %one {
          ... %area ...
    ```

    **Limits**: the first loop must be expected to take under 60%, if every second
    primitive comes to what conditions guard. Reads of state under a condition stay
    there, as do sides that may fail or are `[[unlikely]]`.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect",
                           "::mlir::vector::VectorDialect"];
  let options = [Option<"laneCount", "lanes", "int64_t", "16",
                        "Lanes of a vector: 4, 8 or 16 (default: 16)">];
}

def ReduceStrength : Pass<"piko-reduce-strength", "::piko::PipelineOp"> {
  let summary = "Make linearly growing vectors induction variables";
  let description = [{
    **Requires** lanes (`piko-vectorize`).

    **Does**: strength reduction. It takes innermost loops, such as those over the rows
    of a strip of pixels. A vector of integers that grows by the same in each iteration,
    as the value of an edge function does, becomes an induction variable. One sum
    replaces two operations or more: broadcasts, shifts, products, sums. As many are
    taken as fit into registers.

    **Guarantees** the same bits: integers wrap around.

    Before:
    ```
    %r = scf.for %y = %lo to %hi step %one iter_args(%e = %first) -> (i32) : i32 {
      %all = vector.broadcast %e : i32 to vector<16xi32>
      %edge = arith.addi %all, %lanes : vector<16xi32>
      ... %edge ...
      %next = arith.addi %e, %slope : i32
      scf.yield %next : i32
    }
    ```
    After:
    ```
    %all = vector.broadcast %first : i32 to vector<16xi32>
    %sum = arith.addi %all, %lanes : vector<16xi32>
    %step = vector.broadcast %slope : i32 to vector<16xi32>
    %r = scf.for %y = %lo to %hi step %one iter_args(%edge = %sum)
        -> (vector<16xi32>) : i32 {
      ... %edge ...
      %next = arith.addi %edge, %step : vector<16xi32>
      scf.yield %next : vector<16xi32>
    }
    ```

    **Limits**: sums, differences, products with invariants, left shifts and broadcasts;
    up to 12 registers of 16 lanes, and 5 of fewer.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::vector::VectorDialect"];
  let options = [Option<"laneCount", "lanes", "int64_t", "16",
                        "Lanes of a vector: 4, 8 or 16 (default: 16)">];
}

def PeelVectors : Pass<"piko-peel-vectors", "::piko::PipelineOp"> {
  let summary = "Peel off the last vector of a loop, which need not be full";
  let description = [{
    **Requires** lanes (`piko-vectorize`), whose masks have the mark `piko.last_lanes`.

    **Does**: loop peeling. A loop over rows, of at most so many lanes, becomes one over
    full vectors, without a mask, and one vector with it. Loads and stores of AVX2 that
    have a mask take several times as long as those without.

    **Guarantees** the same operations in the same order.

    Before:
    ```
    scf.for %i = %lo to %hi step %c8 {
      ...
      %mask = arith.cmpi slt, %lanes, %left {piko.last_lanes} : vector<8xi32>
      ... mask %mask ...
    }
    ```
    After:
    ```
    %end = ...               // %lo, and a multiple of 8
    scf.for %i = %lo to %end step %c8 {
      ... mask %all ...
    }
    %more = arith.cmpi slt, %end, %hi : index
    scf.if %more {
      ... mask %mask ...
    }
    ```

    **Limits**: loops that load or store rows, of at most 400 operations.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect", "::mlir::scf::SCFDialect"];
  let options = [Option<"mostLanes", "most-lanes", "int64_t", "8",
                        "Of vectors with more the processor has cheap masks">];
}

def MergeGathers : Pass<"piko-merge-gathers", "::piko::PipelineOp"> {
  let summary = "Read fields of a record for all lanes at once";
  let description = [{
    **Requires** lanes (`piko-vectorize`).

    **Does**: merges gathers of words of the same elements, or of the same primitives,
    if there are three or more, or two side by side. The operation that results loads
    pieces of 16 or 8 bytes for each lane and transposes them, which takes far fewer
    instructions. Reads under conditions, by some of the lanes, join the first read: of
    primitives, and of elements whose record is no longer than a cache line. Three or
    more scatters of words of the same elements become one where the last one stands. Of
    primitives at consecutive positions one field is enough.

    **Guarantees** the same reads: of state that the kernel changes, only words that
    nothing in between writes; and the same writes.

    Before:
    ```
    %x = piko.cpu.gather @mesh[%is : vector<16xindex>] "x" mask %m
      : vector<16xi1>, vector<16xf32>
    %y = piko.cpu.gather @mesh[%is : vector<16xindex>] "y" mask %m
      : vector<16xi1>, vector<16xf32>
    %z = piko.cpu.gather @mesh[%is : vector<16xindex>] "z" mask %m
      : vector<16xi1>, vector<16xf32>
    ```
    After:
    ```
    %as = piko.cpu.elements @mesh[%is : vector<16xindex>] : vector<16xindex>
    %x, %y, %z = piko.cpu.get_fields %as ["x", "y", "z"] of @Vertex mask %m
      : vector<16xindex>, vector<16xi1>
        -> vector<16xf32>, vector<16xf32>, vector<16xf32>
    ```

    **Limits**: fields of 32 bits that are no arrays. Scatters with other access to
    their state in between stay apart.
  }];
}

def PairGathers : Pass<"piko-pair-gathers", "::piko::PipelineOp"> {
  let summary = "Read elements side by side for all lanes at once";
  let description = [{
    **Requires** lanes (`piko-vectorize`); after `piko-merge-gathers`.

    **Does**: merges gathers from a buffer of numbers whose indices are one apart, such
    as a table's entry and the next one, voxels along x or bytes of a row. One operation
    loads up to 8 bytes of each lane. A test finds whether as many elements follow in
    the buffer for all lanes, and whether two clamped indices are one apart here;
    elsewhere gathers read them. Innermost loops of up to 64 iterations in which lanes
    read consecutive elements are unrolled for it. Numbers of fewer than 32 bits, for
    which there are no gathers, are loaded lane by lane.

    **Guarantees** the same numbers in the lanes that read them.

    Before:
    ```
    %a = piko.cpu.gather @table[%is : vector<16xindex>] "value" mask %m
      : vector<16xi1>, vector<16xi32>
    %js = arith.addi %is, %ones : vector<16xi32>
    %b = piko.cpu.gather @table[%js : vector<16xindex>] "value" mask %n
      : vector<16xi1>, vector<16xi32>
    ```
    After:
    ```
    %a, %b = scf.if %are_apart -> (vector<16xi32>, vector<16xi32>) {
      ... // as before
    } else {
      %0, %1 = piko.cpu.gather_run @table[%is] "value" mask %some
        : vector<16xi32>, vector<16xi1> -> vector<16xi32>, vector<16xi32>
      scf.yield %0, %1 : vector<16xi32>, vector<16xi32>
    }
    ```

    **Limits**: 32-bit indices into buffers that the kernel does not change, of numbers
    of at most 32 bits; gathers in one block, or alone in a condition of it.
  }];
}

def UnswitchVersions : Pass<"piko-unswitch-versions", "::piko::PipelineOp"> {
  let summary = "Make a body for units that run all inner loops as scalar loops";
  let description = [{
    **Requires** versions (`piko-plan-vectors`); before `convert-piko-to-openmp`.

    **Does**: loop unswitching. The scalar version of a loop over primitives may hold
    loops in two versions itself, each chosen once for a unit. It becomes two bodies:
    one with these choices, and one for units that run all inner loops as scalar loops.
    `convert-piko-to-llvm` then makes a function of each version, so that none spills
    registers for another.

    **Guarantees** the same operations in the same order.

    Before:
    ```
    %inner = piko.cpu.takes_vectors %w {loop = "inside", number = 1 ...}
    scf.if %outer {
      ... // by vectors
    } else {
      scf.for %i = %c0 to %count step %c1 {
        scf.if %inner {
          ... // by vectors
        } else {
          ...
        }
      }
    } {piko.versions}
    ```
    After:
    ```
    %inner = piko.cpu.takes_vectors %w {loop = "inside", number = 1 ...}
    scf.if %outer {
      ...
    } else {
      scf.if %inner {
        ... // as before
      } else {
        scf.for %i = %c0 to %count step %c1 {
          scf.if %false {
            ... // canonicalize erases it
          } else {
            ...
          }
        }
      } {piko.versions}
    } {piko.versions}
    ```

    **Limits**: choices that are made before all versions. Several inner loops have two
    bodies, not one for each combination.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

#endif // PIKO_TRANSFORMS_VECTORPASSES_TD
