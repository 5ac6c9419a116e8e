// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that turn kernels into structured work, and that into loops over units
// of work.

#ifndef PIKO_TRANSFORMS_MACHINEPASSES_TD
#define PIKO_TRANSFORMS_MACHINEPASSES_TD

include "mlir/Pass/PassBase.td"

def FormWork : Pass<"piko-form-work", "::piko::PipelineOp"> {
  let summary = "Turn phases into structured work on bins";
  let description = [{
    **Requires** the kernels level.

    **Does**: turns the process phase of each kernel into work on what a bin
    holds: a `piko.bins` with a `piko.items` in it, or, where the phase takes a
    list, a `piko.lists`. What stands behind a `piko.local_barrier` follows as
    work on what the first has emitted in the bin. The consumer's assign phase
    stands behind each emission, and its assignments become `piko.storage.append_bin`; queries
    of bins and of the grid become arithmetic. The body of a dynamic schedule
    becomes a kernel that stands before all others, a loop over bins.

    **Guarantees** the machine level: kernels hold no phase, and nothing in them
    says how many threads or lanes there are.

    Before:
    ```
    piko.kernel @kernel_a { piko.process of @a { ... } ... }
    ```
    After:
    ```
    piko.kernel @kernel_a {
      piko.bins of @a {
      ^bb0(%bin: index):
        piko.items of @a {
        ^bb0(%f: !piko.prim<@F>):
          ...
        }
      }
    }
    ```

    **Limits**: none; what a target cannot do, its own passes refuse.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def FormGBuffer : Pass<"piko-form-gbuffer", "::mlir::ModuleOp"> {
  let summary = "Shade pixels of the whole domain once, by a kernel behind";
  let description = [{
    **Requires** the machine level and a program.

    **Does**: what `piko-defer-shading` does in a bin of a size, where a bin is the
    whole domain. Of all that primitives write to a pixel of an image that their
    kernel never reads, only the last is seen. In place of such an update, what it
    is computed from is kept for the pixel, in an internal image (a G-buffer: T.
    Saito and T. Takahashi, "Comprehensible Rendering of 3-D Shapes", 1990), and in
    another one, that anything is. The rest is done by a kernel that the program
    launches behind the first one, on bins of 1024 pixels or fewer: once for each
    pixel, in full vectors and on all threads, however the first kernel runs.
    Where to cut is found as there. The kernel's stage has the name of the other
    one with `_pixels` behind it; nothing comes to it, and its process phase runs
    for each bin (`every_bin`).

    What is left of the first kernel is what `piko-reduce-updates` or
    `piko-reduce-by-atomics` then lets threads or blocks share, if it is a
    reduction.

    **Guarantees** the same images and errors.

    Before:
    ```
    piko.kernel @kernel_a { // of @a, whose bins are [0, 0]
      ...
        %passed = piko.update @depth[%x, %y : i32, i32] in %bin { ... } -> i1
        scf.if %passed {
          %sum = scf.for ... { ... %normal ... }
          piko.update @color[%x, %y : i32, i32] in %bin { ... piko.yield[%sum] }
        }
    }
    piko.program {
      ...
      piko.launch @kernel_a(%bins)
    }
    ```
    After:
    ```
    piko.kernel @kernel_a {
      ...
        %passed = piko.update @depth[%x, %y : i32, i32] in %bin { ... } -> i1
        scf.if %passed {
          piko.update @color.kept[%x, %y : i32, i32] in %bin { ... piko.yield[%normal] }
          piko.update @color.painted[%x, %y : i32, i32] in %bin { ... piko.yield[%one] }
        }
    }
    piko.kernel @kernel_a_pixels { // of @a_pixels, whose bins are [32, 32]
      piko.bins of @a_pixels {
      ^bb0(%bin: index):
        piko.lists of @a_pixels {
        ^bb0(%list: !piko.list<@F>): // empty
          piko.parallel_pixels(%lo, ...) to (%hi, ...) {
          ^bb0(%x: i32, %y: i32):
            scf.if /* painted at %x, %y */ {
              %normal = piko.load checked @color.kept[%x, %y : i32, i32] "kept" : f32
              %sum = scf.for ... { ... %normal ... }
              piko.update @color[%x, %y : i32, i32] in %bin { ... piko.yield[%sum] }
            }
          }
        }
      }
    }
    piko.program {
      ...
      piko.clear @color.painted
      piko.launch @kernel_a(%bins)
      %pixels = piko.join @a_pixels()
      piko.launch @kernel_a_pixels(%pixels)
    }
    ```

    **Limits**: as of `piko-defer-shading`, but that the bin is the whole domain, in
    some dimension at least. What may fail stays in the first kernel. Where that runs
    in strips or on a cycle, the other one runs behind the last of them, so that no
    other kernel there may use the images, or write what is read later. What is
    cheaper to compute than to keep in memory stays, which is more than there, as
    what is kept of a screen does not fit the first level of a cache. A remark says what is kept, or what is
    in the way.
  }];
  let options = [
    Option<"budget", "budget", "int64_t", "64",
           "Most bytes that are kept of a pixel">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def DeferShading : Pass<"piko-defer-shading", "::piko::PipelineOp"> {
  let summary = "Shade each pixel once, when a bin's primitives are done";
  let description = [{
    **Requires** the machine level (`piko-form-work`).

    **Does**: takes images whose pixels a kernel overwrites and never reads: of
    all that the primitives of a bin write to a pixel, only the last is seen. In
    place of such an update, what it is computed from is kept for the pixel, in
    arrays of the bin (deferred shading: T. Saito and T. Takahashi,
    "Comprehensible Rendering of 3-D Shapes", 1990); the rest is done in a loop
    over the bin's pixels behind the work, once for each pixel that a primitive
    has overwritten, in full vectors. Where to cut is found by the minimum cut
    of what all updates of the image compute alike: the fewest bytes, and all
    loops behind it.

    The test that decides whether a primitive is seen stays where it is, and may
    be any. An update that tests a pixel and paints it, on one condition, is split
    in two for that: one that changes what the test reads, and one that
    overwrites the rest.

    **Guarantees** the same images. A read outside of a buffer is no error where
    what was read is overwritten.

    Before:
    ```
    piko.items of @a {
    ^bb0(%f: !piko.prim<@F>):
      ...
      %passed = piko.update @depth[%x, %y : i32, i32] in %bin { ... } -> i1
      scf.if %passed {
        %sum = scf.for ... { ... %normal ... }
        piko.update @color[%x, %y : i32, i32] in %bin { ... piko.yield[%sum] }
      }
    }
    ```
    After:
    ```
    %painted = memref.alloca() : memref<1024xi32>   // all 0
    %normals = memref.alloca() : memref<1024xf32>
    piko.items of @a {
    ^bb0(%f: !piko.prim<@F>):
      ...
      %passed = piko.update @depth[%x, %y : i32, i32] in %bin { ... } -> i1
      scf.if %passed {
        memref.store %normal, %normals[%place]
        memref.store %one, %painted[%place]
      }
    }
    piko.parallel_pixels(%lo, ...) to (%hi, ...) {
    ^bb0(%x: i32, %y: i32):
      scf.if /* painted at %place */ {
        %normal = memref.load %normals[%place]
        %sum = scf.for ... { ... %normal ... }
        piko.update @color[%x, %y : i32, i32] in %bin { ... piko.yield[%sum] }
      }
    }
    ```

    **Limits**: all updates of the image do the same from the cut on, at pixels
    that are proved to be in the bin (`piko-prove-bounds`); one thread runs a
    bin. What is cheaper to compute than to keep stays: a few operations without
    a loop; and so does a loop whose result several pixels share, as of a block
    that is shaded once. A remark says what is kept, or what is in the way.
  }];
  let options = [
    Option<"budget", "budget", "int64_t", "262144",
           "Most bytes that are kept of a bin">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def FormTiles : Pass<"piko-form-tiles", "::piko::PipelineOp"> {
  let summary = "Keep the pixels of a bin near who runs it";
  let description = [{
    **Requires** the machine level (`piko-form-work`, with a `piko.program`).

    **Does**: takes images that a kernel writes only at pixels of the bin, and that
    it alone writes in the whole run: the bin's pixels become a tile (`piko.tile`), a
    value of the kernel that is written to the image once, at the bin's end. Where nothing
    reads the image before, the tile begins with the clear value, and so does what
    lies in bins without primitives; then the program does not clear the image
    any more. With `loads`, which the CPU has, other tiles begin with what is in the
    image, which other kernels may write, too.

    **Guarantees** that images are the same when the run ends.

    Before:
    ```
    piko.kernel @kernel_a {
      piko.bins of @a {
      ^bb0(%bin: index):
        piko.items of @a {
        ^bb0(%f: !piko.prim<@F>):
          piko.update @depth[%x, %y : i32, i32] in %bin { ... }
        }
      }
    }
    piko.program {
      piko.clear @depth ...
      piko.launch @kernel_a(%bins) : (!piko.bins<@F>) -> ()
    }
    ```
    After:
    ```
    piko.kernel @kernel_a {
      piko.bins of @a {
      ^bb0(%bin: index):
        %t = piko.tile @depth clear in %bin : !piko.tile<@Depth, [32, 32]>
        piko.items of @a {
        ^bb0(%f: !piko.prim<@F>):
          piko.update @depth[%x, %y : i32, i32] in %bin tile(%t : ...) { ... }
        }
        piko.write_tile %t to @depth in %bin : !piko.tile<@Depth, [32, 32]>
      }
    }
    piko.program { ...
      piko.launch @kernel_a(%bins) clears @depth : (!piko.bins<@F>) -> ()
    }
    ```

    **Limits**: reads and stores need `piko-prove-bounds`, which finds whether their
    pixels are in the bin; atomics are not taken. A bin that threads may share
    has no tile, nor has one of the whole domain, or one whose list is cut into
    batches. Remarks say of other images what is in the way.
  }];
  let options = [
    Option<"budget", "budget", "int64_t", "65536",
           "Most bytes that the tiles of a kernel may have together">,
    Option<"loads", "loads", "bool", "false",
           "Form tiles also where they begin with what is in the image">];
}

def ForwardStores : Pass<"piko-forward-stores", "::piko::PipelineOp"> {
  let summary = "Forward what is stored to state to what reads it";
  let description = [{
    **Requires** structured work (`piko-form-work`).

    **Does**: store-to-load forwarding, and elimination of redundant loads. What a
    call reads of state, and has stored or read there before, is the same number:
    no other call changes it. LLVM knows the same of one lane, but not of gathers
    and scatters, so that lanes would go through memory. A read that is left stands
    for others behind it, also in conditions and loops, and what it tests is
    known there.

    **Guarantees** the same numbers, and the same stores.

    Before:
    ```
    piko.store %x, @motions[%i : i32] "position.x" : f32
    piko.store %v, @motions[%i : i32] "velocity.x" : f32
    %1 = piko.load @motions[%i : i32] "position.x" : f32
    %2 = arith.cmpf olt, %1, %limit : f32
    ```
    After:
    ```
    piko.store %x, @motions[%i : i32] "position.x" : f32
    piko.store %v, @motions[%i : i32] "velocity.x" : f32
    %2 = arith.cmpf olt, %x, %limit : f32
    ```

    **Limits**: a store to the same field of an element of which one does not know
    that it is the same one, or another one of the same array, ends what is known of
    it, as do barriers, parallel loops and updates; a read behind a condition that
    stores is left.
  }];
}

def MapLanes : Pass<"piko-map-lanes", "::piko::PipelineOp"> {
  let summary = "Choose what lanes are given";
  let description = [{
    **Requires** the machine level.

    **Does**: gives each `piko.items` and `piko.lists` its `lanes`: those that the
    stage's schedule says, or of those that are possible the mapping with the
    least operations for 32 primitives. *Items*: all take part in as many
    iterations as the longest has. *Iterations*: work around the loops is done
    once for each primitive, and the last iterations of each leave lanes idle.
    *Collapsed*: no lane idles, but each pair of a primitive and an iteration has
    to be found. Updates of pixels that other lanes may have are put in order.
    Work without a parallel loop has items; a list without one has one lane. A
    remark says which mapping, and how the others compare or what rules them out.

    **Guarantees** that all work has `lanes`, and that a target may obey them.

    Before:
    ```
    piko.items of @a {
    ^bb0(%t: !piko.prim<@T>):
      ...
      piko.parallel_pixels (%x0, %y0) to (%x1, %y1) { ... }
    }
    ```
    After:
    ```
    piko.items of @a lanes collapsed {
      ...
    }
    ```

    **Limits**: how many iterations a loop will have is a guess where a scene
    decides: a box that differs between primitives is taken to cover a third of
    the bin in each dimension, as one between two random points does. Iterations
    that meet at barriers are given to lanes as iterations.
  }];
}

def FormUnits : Pass<"piko-form-units", "::piko::PipelineOp"> {
  let summary = "Turn structured work into loops over units, for the CPU";
  let description = [{
    **Requires** the machine level.

    **Does**: turns the bins of each kernel into an `scf.forall` over the units of
    work that the runtime cuts them into, in it a loop over the unit's cells and
    in that one over the primitives of a cell, marked `piko.lanes`. Where work
    takes lists, the inner loop is over its calls. Work on what was emitted in the
    bin follows when the bin is done, as a `piko.storage.local_bin`. Emissions become
    stores into the unit's own writer. Loops over primitives keep the `lanes` of
    their work as `piko.mapping`.

    **Guarantees** that all storage and synchronisation is explicit, and that no
    work is left.

    Before:
    ```
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a { ... }
    }
    ```
    After:
    ```
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %units = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%units) { ... }
    piko.storage.close_bins %bins : !piko.bins<@F>
    ```

    **Limits**: the iterations of a `piko.parallel_for` are left to
    `piko-split-loops`.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def SplitLoops : Pass<"piko-split-loops", "::piko::PipelineOp"> {
  let summary = "Turn parallel loops into loops, cut where iterations meet";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns a `piko.parallel_for` without barriers into an `scf.for`
    that is marked `piko.lanes`, and a `piko.parallel_pixels` into rows of pixels,
    of which the innermost loop is so marked; with barriers, its pixels get
    numbers first. A loop with barriers is cut at them: each piece
    between two barriers becomes a loop over all iterations, and what lives
    across a cut, be it a value or a private array, gets a slot for each
    iteration in scratch memory. Control flow that holds barriers moves around
    the pieces and follows iteration 0; where the analysis cannot prove that all
    iterations agree, they are compared when the pipeline runs, and
    `piko.fail_barrier` reports the first that does not, and then none goes on.
    Reductions, scans and sorts become loops over slots. Where several pieces
    emit, primitives are put
    in the order of iterations when the loop ends (`piko.cpu.defer_begin`).

    A `piko.parallel_for` with a constant count of at most `lockstep`, whose
    barriers are `piko.sync` and `piko.reduce`, is left to `piko-vectorize`:
    as lanes of one vector its iterations run in lockstep, and need no cut.

    **Guarantees** that nothing else is left of parallel loops and barriers, and
    that each barrier sees all that iterations did before it, in order of iteration.

    Before:
    ```
    piko.parallel_for %n {
    ^bb0(%i: index):
      %v = ...
      piko.sync
      ... %v ...
      piko.yield
    }
    ```
    After:
    ```
    %bytes, %granted = piko.cpu.scratch %writer[%size]
    scf.if %granted {
      %slots = memref.view %bytes[%zero][%n] : memref<?xi8> to memref<?xf32>
      scf.for %i = %zero to %n step %one {
        %v = ...
        memref.store %v, %slots[%i] : memref<?xf32>
      } {piko.lanes}
      scf.for %i = %zero to %n step %one {
        %v = memref.load %slots[%i] : memref<?xf32>
        ... %v ...
      } {piko.lanes}
    }
    ```

    **Limits**: a barrier in control flow other than `scf.if`, `scf.for`,
    `scf.while` and `scf.index_switch` is an error, and so is a value across a
    barrier that is not a number, a primitive or a private array.
  }];
  let options = [
    Option<"lockstep", "lockstep", "int64_t", /*default=*/"0",
           "Most iterations of a loop with barriers that is left to vectors">
  ];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ReduceByAtomics : Pass<"piko-reduce-by-atomics", "::mlir::ModuleOp"> {
  let summary = "Let blocks share a bin where updates are reductions";
  let description = [{
    **Requires** the machine level and a program. For a GPU, in front of
    `convert-piko-to-gpu`; what `piko-reduce-updates` is for the CPU.

    **Does**: updates of a pixel run in order of lineage, so that one block runs a
    bin that is the whole domain. Where all that the kernel's updates do is an
    arg-min reduction, as described there, blocks share the bin. The key of an
    update and the position of its primitive (`piko.position`) become words of 64
    bits, of which the least one, as unsigned, comes first; an internal image holds
    one for each pixel. Kernels that precede the kernel find the least words by
    atomic operations, and do nothing else; two where the key and the position
    take two words. In the kernel itself a primitive changes those pixels whose
    words are its own, by stores: nobody else does. What is carried is computed
    once for each pixel, as visibility comes before shading.

    Work on what comes along a local edge is one thread's for the same reason, also
    in bins of a size. Where its updates are such a reduction, work on the same in
    front of it finds the least words (marked `piko.again`), and threads share both.

    Images whose numbers are all changed by one integer operation that commutes and
    associates are changed by `piko.atomic` instead.

    **Guarantees** the same bits and the same errors.

    Before:
    ```
    piko.items of @draw {
    ^bb0(%f: !piko.prim<@F>):
      %closer = piko.update @depth[%x, %y : i32, i32] in %bin {
      ^bb0(%old: f32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new : f32] results [%less : i1]
      } -> i1
      scf.if %closer {
        piko.update @color[%x, %y : i32, i32] in %bin {
          ...
    ```
    After:
    ```
    piko.kernel @kernel_draw_first precedes @kernel_draw {
      ...
      %old = piko.load checked @depth[%x, %y : index, index] "z" : f32
      %less = arith.cmpf olt, %z, %old : f32
      ...
      scf.if %isBefore {
        piko.atomic min_unsigned checked @depth.first[%x, %y : index, index] "first", %word
      }
    }
    piko.kernel @kernel_draw {
      ...
      %first = piko.load checked @depth.first[%x, %y : index, index] "first" : i64
      %isOwn = arith.cmpi eq, %word, %first : i64
      %closer = arith.andi %less, %isOwn : i1
      scf.if %closer {
        piko.store %z, checked @depth[%x, %y : index, index] "z" : f32
      ...
    ```

    **Limits**: phases that take lists, stages that update pixels and host others,
    kernels that are launched again and again, work that reads what the kernel
    writes, and schedules that serialize stay in one block, or with one thread; so
    does a key that takes more than two words. Remarks say what is
    selected, and what is in the way.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

#endif // PIKO_TRANSFORMS_MACHINEPASSES_TD
