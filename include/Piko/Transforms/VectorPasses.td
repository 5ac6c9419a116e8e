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

    **Does**: exact narrowing. Where a loop over pixels that may become lanes
    compares 64-bit affine functions of the pixel (as edge functions are), or
    takes the sign of their bits, minima and maxima combined, a test in front of
    the loop evaluates each function at the corners of the loop's domain, divided
    by the power of two that all of its steps are multiples of, and rounded down,
    which changes no sign. Where all fit into 32 bits, a second version of the
    loop computes the signs there: twice as many lanes, and no multiplication of
    64 bits. What a row begins with is carried from the row before: how many
    vectors a row has is seldom predicted, and a product is then waited for.

    Where such a function becomes a floating-point number as well, as a weight
    does, all of its bits are needed. A second test finds whether these fit, too,
    and leads to a third version, which converts from 32 bits. There the function
    is the one whose sign is taken, shifted back, plus what the bits below were,
    if both have the same steps: a bias for points on an edge does not matter. A
    remark says how many comparisons and conversions there are.

    With `lanes`, loops over rows of which a pixel has something to do only where
    such functions have one sign are strip-mined and interchanged: a strip has as
    many columns as there are lanes, and around the loop over its rows stands what
    finds which of them the half-planes of all edges reach. So hardly any vector
    is empty, and what a branch decides changes once a strip, not once a row. For
    half as many strips as there are lanes this is found at once, in vectors,
    unless lanes may be primitives. A box that lies outside of a half-plane, by
    what was evaluated at its corners, has no strips.

    **Guarantees** the same outcome of each comparison, and the same number, also
    where 64 bits overflow: such functions do not pass the test.

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

    **Limits**: loops with a step other than one, and comparisons of what is not
    affine, stay as they are. Loops of more than 200 operations have no third
    version, and a remark says so. What else an edge function is used for is
    computed in 64 bits. Loops are interchanged if their pixels may be visited in
    any order (`piko.rows`), and access no element but their own of what they
    change.
  }];
  let dependentDialects = ["::mlir::vector::VectorDialect"];
  let options = [
    Option<"laneCount", "lanes", "int64_t", /*default=*/"0",
           "lanes of a vector, which a strip has as columns; 0: no strips">];
}

def Vectorize : Pass<"piko-vectorize", "::piko::PipelineOp"> {
  let summary = "Run primitives, or iterations, as lanes of vectors";
  let description = [{
    **Requires** loops over units whose access to state is checked
    (`convert-piko-to-scf`), and lanes that `piko-map-lanes` has given primitives,
    or the iterations of a parallel loop.

    **Does**: runs as many consecutive turns of a loop over primitives, of a
    `parallelFor`, or of a row of pixels, at once as there are `lanes`. What is the
    same for all of them stays scalar; the rest becomes vectors, by predication:
    conditions become masks, with a branch around what no lane needs; in a strip of
    a convex shape (`piko-narrow-integers`), of which hardly any vector is empty,
    there is none around up to 64 instructions, so that the pixels of the next row
    are asked for before it is known what these become. Loops run as long as some
    lane does; access to state and to primitives becomes gathers and
    scatters, of a row of pixels masked loads and stores; local arrays get a column
    for each lane, and short ones are accessed row by row, also where lanes are in
    different places. What a loop hands on stays scalar where all lanes that are
    still in it began with the same, as the place of an insertion. Where
    iterations read three fields or more of an element, as of the triangle that a
    pixel shows, and all that are active turn out to read the same one, scalar
    loads read it. Integers of 32 bits are divided as floats of 64,
    which is exact; by what all lanes share, they are multiplied, and where that
    is neither 0 nor -1, no dividend is tested. Where an index
    grows by one from lane to lane but for limits, as one that is clamped to an
    image, or wraps around in it, a test finds whether it does so here, and a load
    of a row is the other side of the gather. A row of a private copy
    (`piko-privatize`), as of pixels that are counted, is changed by all lanes at
    once (`piko.cpu.reduce_row`); where lanes may meet in an element they take
    turns. What has no vector form runs lane by lane inside.

    Loops inside, or two of which one is all that the other does, are collapsed
    where their turns differ between lanes but hand on nothing, and change state
    by atomic operations alone: a scan over how many turns each lane makes fills
    vectors with pairs of a lane and a turn, so that the pixels of small boxes
    leave few lanes idle. (Where a lane makes more than 1,024 turns of one loop,
    loops run in step, as others do.) What pairs change in private copies
    is staged: 16 lanes compress it into a list, through which a
    scalar loop goes when it is full, so that misses of the cache overlap.

    Where an iteration has a loop inside of another one, whose turns differ
    between lanes, as the probes of a hash table in each of eight corners, lanes
    would wait for the one that makes the most. Such nests are flattened where
    that is expected to take a fifth less: one loop, each of whose turns makes one
    of the inner loop or, where that has ended, goes on to the next turn of the
    outer one, so that each lane goes through the nest by itself. A lane does what
    it did, in the order that it did; nests of which an order shows between lanes,
    as they emit or update pixels that lanes may share, stay as they are, and a
    remark says so.

    Where all that iterations do by themselves is one such loop, as rays that end
    at different times have, lanes take iterations that are as many apart as there
    are lanes, and each goes on to its next one by itself. It waits with that until
    three eighths of the lanes do, or no other one has anything to do.

    Where turns of loops inside wait for what the turn before hands on, as those of
    a march through a volume do, loops over primitives, and loops in order, have
    twice as many lanes, if `lanes` are 16: two vectors, of which one is under way
    while the other one waits. The longest cycle of dependences is compared with
    what all operations take, and what turns hand on has to fit into registers.

    Where iterations go on only if quotients by what all share are not negative, as
    barycentric coordinates, dividends are tested first, and vectors without an
    iteration that may go on divide nothing. Elements of a primitive's array that
    loops read four times or more are gathered in front of the loops.

    What must keep its order (emission, updates of pixels that lanes may share)
    runs lane by lane: all that one image or one writer is concerned with, as one
    group in its place, or, if nothing in the loop waits for it, as several behind
    all that vectors do. So a depth test, the shading of what has passed it, and
    the update of a colour become turns, vectors and turns.

    What lanes emit behind all that vectors do, up to three records of each lane to
    a port, vectors emit for all lanes (`piko.cpu.append`): room is made once, the
    fields are transposed into records, and each lane stores its own where the
    number of those before it says. Where few lanes do (up to three eighths; of
    records up to 16 bytes, one eighth), or positions are counted
    (`piko.cpu.is_counted`), lanes take turns. They do so, too, where a loop of
    each lane emits, where a record may go to several bins, and where it is no
    whole number of words of 4 bytes, or more than 256 bytes; records whose fields
    vectors have are then transposed in front of the turns, and copied
    (`piko.cpu.store_records`). Loops that lanes run in their turns are looked at as
    others are.

    With a `window` a loop for which the estimates are within that factor of each
    other becomes vectors and stays as it is as well (loop multiversioning):
    `piko.cpu.takes_vectors` says which of them a unit of work runs, as the
    runtime has measured. Loops inside of the scalar version are candidates of
    their own, so that primitives, iterations or neither may have lanes. What the
    schedule specifies is not measured.

    A parallel loop whose iterations meet, of which `piko-split-loops` has left
    those that a vector has lanes for, on any processor, becomes lanes in lockstep:
    a barrier needs no code, a reduction is one of a vector's lanes, a scan joins
    shuffled blocks of them, a sort counts how many keys come before each, and
    what iterations agree on stays scalar, private arrays included. Where iterations may
    part ways around a barrier, or emit or update pixels in front of one, it is
    cut as `piko-split-loops` cuts others, and the pieces are looked at.

    Parallel loops that turn out to have few iterations run as they were. Whether
    vectors pay is estimated from the operations, how often they run, and for how
    many lanes; where they do not, a remark has the estimate, with what costs most.
    Loops on one side of a condition, in place of nothing, may be a slow path, as
    clipping is, where code goes on behind it: the estimates are geometric means of
    those with it and without it. Of more than two guards in a row, each in the other,
    no one is taken to let fewer through.
    One iteration alone waits for each load whose place a load of the turn before
    has said, as of the nodes of a tree (pointer chasing); lanes wait together.
    A loop of a phase that is written in order is vectorized as well where it stands
    in no other vector, its turns hand on nothing, read no state that they change,
    and store each field once; they may emit. If all that a turn does stands behind
    a condition, with a loop of its own, the turns that have something to do are
    found first, 1,024 at a time (stream compaction), so that vectors are full.
    Where such loops turn equally often for all primitives, as those along the rows
    of an image, primitives become lanes only if they are expected to be faster.

    A primitive that goes along a buffer in a loop of its own is mostly left to
    LLVM, which makes vectors along that loop. Rows of boxes, which mostly have few
    pixels, are vectorized where the schedule says `specifyLanes`.

    The CPU target sets how many `lanes` there are, from what the processor that it
    makes code for has: 16 with AVX-512 (F, BW, DQ and VL), 8 with AVX2, or else 4.
    Nothing in front of this pass knows it, and an object for several processors
    has code of each width.

    **Guarantees** the same operations on the same numbers for each turn, emissions
    and updates in the same order, and the same bits for any number of lanes.

    Before:
    ```
    scf.for %x = %lo to %hi step %c1 {
      %z = ...
      %old = piko.load checked @depth[%x, %y : index, index] "z" : f32
      %nearer = arith.cmpf olt, %z, %old : f32
      scf.if %nearer {
        piko.store %z, checked @depth[%x, %y : index, index] "z" : f32
      }
    } {piko.lanes}
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

    **Limits**: loops whose turns use a part of memory that has no lanes (views,
    scratch), or carry what is neither a number nor a primitive around an inner
    loop, stay as they are, with a remark.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect",
                           "::mlir::vector::VectorDialect"];
  let options = [
    Option<"laneCount", "lanes", "int64_t", "16",
           "Lanes of a vector: 4, 8 or 16 (default: 16)">,
    Option<"window", "window", "double", "1",
           "hold a loop as vectors and as a scalar loop, of which the runtime runs "
           "what is faster, where estimates are within this factor of each other "
           "(default: 1, none)">,
    Option<"sensitivities", "sensitivities", "bool", "false",
           "print the estimates of such loops, and how they depend on the numbers "
           "of the cost model, as lines of JSON">
  ];
}

def DistributeLoops : Pass<"piko-distribute-loops", "::piko::PipelineOp"> {
  let summary = "Compute what loops of a primitive start from for all lanes";
  let description = [{
    **Requires** loops over units, behind `piko-vectorize`: of loops over primitives
    it takes those whose lanes are given iterations, or none.

    **Does**: loop distribution (fission) with scalar expansion. Of as many
    primitives as there are lanes, a first loop computes what follows from each
    alone, such as the edges of a triangle and the rows that these leave of its
    box, and writes what is still needed into arrays; a second loop reads it, and
    runs what is left of each turn, primitive by primitive. The first loop is
    vectorized, for primitives as lanes. What conditions guard is computed for all
    primitives, if it can be where they do not hold. Of less than a quarter of the
    lanes the first loop stays scalar.

    **Guarantees** the same bits: what moves changes nothing, and reads nothing that
    the kernel changes. Effects keep their order.

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
      scf.for %i = %block to %behind step %one {
        ...
        memref.store %area, %areas[%lane] : memref<16xi32>
      }
      scf.for %i = %block to %behind step %one {
        %area = memref.load %areas[%lane] : memref<16xi32>
        scf.for %p = %lo to %hi step %one {
          ... %area ...
    ```

    **Limits**: loops of which this is expected to take less, by the cost model of
    `piko-vectorize`, if every second primitive comes to what conditions guard. What
    is read of state behind a condition stays there, and so do sides that the text
    says are seldom taken (`[[unlikely]]`), or that test what may fail.
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
  let summary = "Make vectors that grow from turn to turn induction variables";
  let description = [{
    **Requires** lanes (`piko-vectorize`).

    **Does**: strength reduction. In a loop without another one inside, such as one
    over the rows of a strip of pixels, a vector of integers that grows by the same
    from turn to turn, as the value of an edge does, is handed on from turn to turn
    and added to, where it took two operations or more: a broadcast of what all
    lanes share, shifts, and sums. So many are that fit into registers.

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

    **Limits**: sums, differences, products with what does not change, shifts to the
    left and broadcasts; up to 12 registers of 16 lanes, and five of fewer.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::vector::VectorDialect"];
  let options = [Option<"laneCount", "lanes", "int64_t", "16",
                        "Lanes of a vector: 4, 8 or 16 (default: 16)">];
}

def MergeGathers : Pass<"piko-merge-gathers", "::piko::PipelineOp"> {
  let summary = "Read fields of a record for all lanes at once";
  let description = [{
    **Requires** lanes (`piko-vectorize`).

    **Does**: of gathers that read words of the same elements, or of the same
    primitives, makes one operation, if there are three or more, or two side by
    side. It loads pieces of 16 bytes, or of 8, one for each lane, and transposes
    them, which takes far fewer instructions than a gather for each field; lanes
    that read nothing load zeros.
    Fields of primitives that are read behind conditions, for some of the lanes,
    are read with the first, and so are those of elements whose records are as
    short as a line of the cache. Of scatters of words of the same elements, three
    or more without other access to that state between them, it makes one operation
    as well, where the last one is: words are transposed, and each lane stores
    pieces of up to 16 bytes, if all lanes write. Of 16 lanes, consecutive elements
    of up to eight words are loaded and stored as vectors of their words, which are
    de-interleaved and interleaved; so are primitives at consecutive positions
    loaded, even one field alone, where bins have no order of their own.

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

    **Limits**: fields of 32 bits that are no arrays.
  }];
}

def PairGathers : Pass<"piko-pair-gathers", "::piko::PipelineOp"> {
  let summary = "Read elements side by side for all lanes at once";
  let description = [{
    **Requires** lanes (`piko-vectorize`); behind `piko-merge-gathers`.

    **Does**: of gathers from a buffer of numbers whose indices are one apart, as
    those of a table's entry and the next one, of voxels along x or of a row of
    bytes, makes one operation, which loads up to 8 bytes of a lane at once. A test
    finds whether the elements of all lanes are followed by as many in the buffer,
    and, where two indices are one apart but for limits, as clamped ones, whether
    they are here; elsewhere gathers read them. Loops of up to 64 turns in which
    lanes read one element behind the other are unrolled for it. There are no
    gathers of fewer than 32 bits: each lane loads its number.

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

    **Limits**: indices of 32 bits into buffers that the kernel does not change,
    of numbers of at most 32 bits; gathers in one block, or each alone in a
    condition of it.
  }];
}

def UnswitchVersions : Pass<"piko-unswitch-versions", "::piko::PipelineOp"> {
  let summary = "Make a body for units that run all inner loops as scalar loops";
  let description = [{
    **Requires** versions (`piko-vectorize`); in front of `convert-piko-to-openmp`.

    **Does**: where the scalar version of a loop over primitives holds loops in two
    versions itself, whose choice is made once for a unit, it is unswitched: one body
    has these choices, and another one, for units that run all inner loops as scalar
    loops, has nothing else in it. `convert-piko-to-llvm` makes a function of each
    version then, so that none spills registers for another.

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

    **Limits**: decisions made in front of all versions. Of several inner loops
    there are two bodies, not one for each combination.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

#endif // PIKO_TRANSFORMS_VECTORPASSES_TD
