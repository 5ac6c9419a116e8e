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

    **Does**: turns the process phase of each kernel into work on what a bin holds: a
    `piko.bins` with a `piko.items` in it, or, where the phase takes a list, a
    `piko.lists`. The assign phase of a source becomes a `piko.items` of its
    primitives. What stands after a `piko.local_barrier` follows as work on what the
    first has emitted in the bin. The consumer's assign phase stands after each
    emission. Its assignments become `piko.place`. Queries of bins become arithmetic.
    The body of a dynamic schedule becomes a kernel that stands before all others, a
    loop over bins.

    **Guarantees** the machine level: kernels hold no phase, and nothing in them says
    how many threads or lanes there are.

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
  let summary = "Shade pixels of the whole domain once, by a kernel after";
  let description = [{
    **Requires** the machine level and a program.

    **Does**: deferred shading for bins that are the whole domain in some dimension.
    In place of an update that overwrites a pixel, an internal image (a G-buffer)
    keeps what it is computed from, and another one that anything is kept. The program
    launches a kernel for the rest after the first one. It works once on each pixel,
    in full vectors and on all threads. Its bins have at most 1024 pixels. Nothing
    comes to its stage, which has the other's name with `_pixels` after it, and runs
    for each bin (`every_bin`).

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
          piko.update @color.kept[%x, %y : i32, i32] in %bin {
            piko.yield[%normal] }
          piko.update @color.overwritten[%x, %y : i32, i32] in %bin {
            piko.yield[%one] }
        }
    }
    piko.kernel @kernel_a_pixels { // of @a_pixels, whose bins are [32, 32]
      piko.bins of @a_pixels {
      ^bb0(%bin: index):
        piko.lists of @a_pixels {
        ^bb0(%list: !piko.list<@F>): // empty
          piko.parallel_pixels(%lo, ...) to (%hi, ...) {
          ^bb0(%x: i32, %y: i32):
            scf.if /* overwritten at %x, %y */ {
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
      piko.clear @color.overwritten
      piko.launch @kernel_a(%bins)
      %pixels = piko.join @a_pixels()
      piko.launch @kernel_a_pixels(%pixels)
    }
    ```

    **Limits**: as of `piko-defer-shading`. What may fail stays in the first kernel.
    Around it, in strips or on a cycle, no other kernel may use the images, or write
    what is read later. A remark says what is kept, or why not.
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

    **Does**: deferred shading (Saito and Takahashi, 1990) of images whose pixels a
    kernel overwrites and never reads. In place of an update, arrays of the bin keep
    what it is computed from. A minimum cut makes that the fewest bytes. A loop over
    the bin's pixels after the work does the rest, once for each overwritten pixel, in
    full vectors. An update that tests a pixel and overwrites it is split in two
    before.

    **Guarantees** the same images. A read outside of a buffer is no error where what
    was read is overwritten.

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
    %overwritten = memref.alloca() : memref<1024xi32>   // all 0
    %normals = memref.alloca() : memref<1024xf32>
    piko.items of @a {
    ^bb0(%f: !piko.prim<@F>):
      ...
      %passed = piko.update @depth[%x, %y : i32, i32] in %bin { ... } -> i1
      scf.if %passed {
        memref.store %normal, %normals[%place]
        memref.store %one, %overwritten[%place]
      }
    }
    piko.parallel_pixels(%lo, ...) to (%hi, ...) {
    ^bb0(%x: i32, %y: i32):
      scf.if /* overwritten at %place */ {
        %normal = memref.load %normals[%place]
        %sum = scf.for ... { ... %normal ... }
        piko.update @color[%x, %y : i32, i32] in %bin { ... piko.yield[%sum] }
      }
    }
    ```

    **Limits**: all updates are alike from the cut on, at pixels proved to be in the
    bin (`piko-prove-bounds`). One thread runs a bin. What is cheaper to compute than
    to keep stays, as does a loop whose result several pixels share. A remark says
    what is kept, or why not.
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

    **Does**: takes images that a kernel writes only at pixels of the bin, and that it
    alone writes in the whole run. The bin's pixels become a tile (`piko.tile`), a
    value of the kernel that is written to the image once, at the bin's end. Where
    nothing reads the image before, the tile begins with the clear value. So does what
    lies in bins without primitives, and the program no longer clears the image. With
    `loads`, other tiles begin with what is in the image, which other kernels may
    write, too.

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

    **Limits**: reads and stores need `piko-prove-bounds`. Atomics are not taken. A
    bin that threads may share has no tile. Nor has one of the whole domain, or one
    whose list comes in batches. Remarks say why.
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
    call reads of state, and has stored or read there before, is the same number: no
    other call changes it. LLVM knows that of one lane, but not of gathers and
    scatters, and lanes would go through memory. A read that is left stands for others
    after it, also in conditions and loops.

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

    **Limits**: a store ends what is known of its field in all elements, but not at
    other constant places of an array in it. Other changes of a state end all that is
    known of it, and barriers, parallel loops and updates all that is known. What a
    branch or a loop has read or stored is not known after it.
  }];
}

def MapLanes : Pass<"piko-map-lanes", "::piko::PipelineOp"> {
  let summary = "Choose what lanes are given";
  let description = [{
    **Requires** the machine level.

    **Does**: gives each `piko.items` and `piko.lists` its `lanes`. These are what the
    stage's schedule says, or the possible mapping with the fewest operations for 32
    primitives. *Items*: all take part in as many iterations as the longest has.
    *Iterations*: work around the loops is done once for each primitive, and the last
    of each leave lanes idle. *Collapsed*: no lane idles, but each pair of a primitive
    and an iteration has to be found. Updates of pixels that other lanes may have are
    put in order. A remark compares the mappings, or says what rules them out.

    **Guarantees** that all work has `lanes`, which a target may obey.

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

    **Limits**: the count of iterations is a guess where a scene decides. Work without
    a parallel loop has items, a list without one has one lane. Iterations that meet
    at barriers are given to lanes.
  }];
}

def FormUnits : Pass<"piko-form-units", "::piko::PipelineOp"> {
  let summary = "Turn structured work into loops over units, for the CPU";
  let description = [{
    **Requires** the machine level.

    **Does**: turns the bins of each kernel into an `scf.forall` over the units of
    work that the runtime cuts them into. In it is a loop over the unit's cells, and
    in that one over the primitives of a cell, marked `piko.lanes`. Where work takes
    lists, the inner loop is over its calls. Work on what was emitted in the bin
    follows when the bin is done, as a `piko.storage.local_bin`. Emissions become
    stores into the unit's own writer. Loops over primitives keep the `lanes` of their
    work as `piko.mapping`.

    **Guarantees** that all storage and synchronisation is explicit, and that no work
    is left.

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

    **Limits**: the iterations of parallel loops are left to `piko-split-loops`.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def SplitLoops : Pass<"piko-split-loops", "::piko::PipelineOp"> {
  let summary = "Turn parallel loops into loops, cut where iterations meet";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns a parallel loop without barriers into `scf.for`s, of which the
    innermost is marked `piko.lanes`. A loop with barriers is cut at them (loop
    fission). Each piece becomes a loop over all iterations. What lives across a cut
    gets a slot for each iteration in scratch memory. Control flow that holds barriers
    moves around the pieces and follows iteration 0. Where iterations may not agree,
    they are compared, and `piko.fail_barrier` reports the first that differs.
    Reductions, scans and sorts become loops over slots.

    A `piko.parallel_for` with a constant count of at most `lockstep` is left to
    `piko-lockstep`, as lanes of one vector.

    **Guarantees** that barriers see all that iterations did before, and that
    emissions keep their order.

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

    **Limits**: only `scf.if`, `scf.for`, `scf.while` and `scf.index_switch` may hold
    barriers. Only numbers, primitives and private arrays may live across them.
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
    **Requires** the machine level and a program, for a GPU (`piko-reduce-updates` for
    a CPU).

    **Does**: lets blocks share a bin that is the whole domain, where all updates of
    the kernel are an arg-min reduction. The key of an update and the position of its
    primitive become words of 64 bits. Kernels that precede the kernel find the least
    words of each pixel by atomics (visibility buffer). In the kernel itself a
    primitive stores to the pixels whose words are its own. Work after a local edge
    does both in one kernel (`piko.again`). In strips, the words are cleared for each,
    or once, if the key is one word and its comparison strict. Images whose numbers change by one
    commuting integer operation change by `piko.atomic`.

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
        piko.atomic min_unsigned checked @depth.first[%x, %y : index, index] "first",
          %word
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

    **Limits**: lists, kernels on a cycle, work that reads what the kernel writes,
    `serialize`, and keys of more than two words keep one block.
    Remarks say what is selected, and why not.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

#endif // PIKO_TRANSFORMS_MACHINEPASSES_TD
