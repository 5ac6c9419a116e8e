// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that take kernels to upstream dialects.

#ifndef PIKO_CONVERSION_PASSES_TD
#define PIKO_CONVERSION_PASSES_TD

include "mlir/Pass/PassBase.td"

def ConvertPikoToSCF : Pass<"convert-piko-to-scf", "::piko::PipelineOp"> {
  let summary = "Turn updates and checked access into structured control flow";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns `piko.update` into an `scf.if` around the loads of the pixel,
    the update's body and the stores; and puts `piko.load`, `piko.store` and
    `piko.atomic` behind a test of their indices. Where a test fails,
    `piko.fail` reports it, with the bin of the call, nothing is written, and a
    read gives 0. Reads of a list become reads of positions, behind a test
    unless the index is that of a loop over the list. A `piko.tile` stays where
    it is in the image: in the launch that clears it, its rows get the clear value
    where the bin begins; the runtime may copy it where rows of the image compete
    for the cache (`piko.cpu.open_tile`). With `private-tiles` it becomes arrays of
    the thread's, which are filled there and written to the image where the bin
    ends.

    **Guarantees** that no kernel touches memory outside a buffer, an image, or,
    in an update, the bin.

    Before:
    ```
    piko.store %v, @verts[%i : index] "x" : f32
    ```
    After:
    ```
    %n = piko.extent @verts[0]
    %inside = arith.cmpi ult, %i, %n : index
    scf.if %inside {
      piko.store %v, checked @verts[%i : index] "x" : f32
    } else {
      %bin = piko.storage.cell_bin %bins[%cell] : !piko.bins<@F>
      piko.fail @stage in %bin outside @verts(%i)
    }
    ```

    **Limits**: indices into array fields are not tested.
  }];
  let options = [
    Option<"privateTiles", "private-tiles", "bool", "false",
           "Copy tiles to arrays of the thread's">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertPikoToOpenMP : Pass<"convert-piko-to-openmp", "::piko::PipelineOp"> {
  let summary = "Spread the units of work over threads";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns the `scf.forall` of each kernel into an `omp.parallel` with
    the host's thread count, in which each thread asks the runtime for one unit after
    the other; or, where its `piko.units` is `serial`, into a plain loop. Private
    arrays move to the front of the thread's region, so that they take stack space
    once and not for each primitive.

    Before:
    ```
    scf.forall (%u) in (%units) { ... } {piko.units = #piko<units shared>}
    ```
    After:
    ```
    %threads = piko.cpu.threads
    omp.parallel num_threads(%threads : i32) {
      scf.while : () -> index {
        %next = piko.cpu.next_unit %bins : !piko.bins<@Fragment>
        %any = arith.cmpi ult, %next, %units : index
        scf.condition(%any) %next : index
      } do {
      ^bb0(%u: index):
        ...
        scf.yield
      }
    }
    ```

    **Limits**: loops inside are not spread.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::omp::OpenMPDialect",
                           "::mlir::scf::SCFDialect"];
}

def MapThreads : Pass<"piko-map-threads", "::piko::PipelineOp"> {
  let summary = "Say how the threads of a block share a kernel's work";
  let description = [{
    **Requires** the machine level (`piko-form-work`), and what `piko-map-lanes` says,
    if it has run.

    **Does**: chooses how many threads a block has (`piko.block_size`), and says of
    each piece of work and each parallel loop who takes what (`piko.threads`), for
    `convert-piko-to-gpu`, which obeys. Of work on primitives:

    - `collapsed`: threads take the pixels of many primitives as one space. All that
      others see of the kernel is updates of pixels; a primitive has one nest of loops
      over the pixels of a box, or one pixel, which its setup finds; and the block
      needs at most 384 bytes a thread.
    - `pixels`: threads share the pixels of one primitive after the other, where all
      that has an effect follows from the update of a pixel.
    - `shared`: each takes some of the primitives, no two of which update a pixel.
    - `one`: one primitive after the other; loops inside may be shared.
    - `by_count`: `shared` where a bin has at least `piko.fewest` primitives, else
      `one`; chosen when the grid runs.

    Of a parallel loop: `shared`, where no two iterations update a pixel; `lockstep`,
    where they meet at barriers and are at most as many as the threads; `pieces`,
    where it has to be cut at barriers, `pieces_of_one` if one thread runs those; or
    `one`. An update whose pixel follows from data becomes a `piko.grouped`, which is
    such a barrier. Before it looks for pixels, loops that count become `scf.for`, numbers that
    loops over pixels step become closed forms, and what pixels have in common moves
    out of their loops. A remark says why threads do not share pixels, or take one
    primitive or iteration after the other.

    Before:
    ```
    piko.items of @draw {
    ^bb0(%f: !piko.prim<@F>):
      ...
    }
    ```
    After:
    ```
    piko.items of @draw attributes {piko.threads = #piko<threads collapsed>} {
    ^bb0(%f: !piko.prim<@F>):
      ...
    }
    ```

    **Limits**: in checking mode one thread does all.
  }];
  let options = [
    Option<"threads", "threads", "int64_t", "0",
           "Threads of a block, a power of two up to 1024 (default: what the "
           "stage has, rounded down to one; more where a bin has more than 16 "
           "pixels for each, up to 256)">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertPikoToGPU : Pass<"convert-piko-to-gpu", "::piko::PipelineOp"> {
  let summary = "Turn kernels into grids of blocks and threads";
  let description = [{
    **Requires** the machine level (`piko-form-work`), and a mapping to threads
    (`piko-map-threads`).

    **Does**: turns the work of each kernel into a `gpu.launch`: a block runs a unit
    of the stored bins, which is a bin, several, or a share of the primitives of
    one, and then another one. Of a stage that is scheduled by `load_balance` or `all`
    it takes the next ones from a counter of the launch (`piko.gpu.take_units`), by its
    first thread, where there are fewer blocks than units; of any other, block `b` of
    `n` has the units `b`, `b + n`, ... What a block's threads do is as mapped:

    - `pixels`: its threads share out the pixels of a bin: a pixel is that thread's
      whose place in a tile of `threads` pixels it has. All threads take all the
      primitives of the bin in order, so that the updates of a pixel keep their lineage
      order; what belongs to other threads' pixels is behind a test of the pixel, or,
      where a loop counts through pixels, stepped over. What depends on a primitive
      alone, its setup, is split off (loop fission): each thread does it for one of as
      many primitives as the block has threads, and leaves what the pixels need of it
      in the block's memory, between two `gpu.barrier`s. What is in a loop with work on
      pixels, or uses an array, all threads still do alike; and where the block's
      memory has no room for all of it, only fields are shared. An error notes which
      primitive it is about, by which the runtime puts them in order.
    - `collapsed`: threads take the pixels of a whole group of at most 64 primitives as
      one space (collapsed loops). A thread tests the pixels of a part of that space,
      and sets the primitive's bit in a mask that each pixel of the bin has in the
      block's memory; behind a barrier, threads take pixels with bits, and update each
      for bit after bit, so in lineage order. A primitive that leaves the bin, or takes
      the way of a condition that uses arrays of the phase, ends its group in front of
      it and is done alone, in a loop that is marked with `piko.rare`, of a launch of
      its own (`kernel_draw_rest`): the one in front of it has no such loop, and leaves
      a unit where its first rare primitive stands (`piko.gpu.leave_rest`). What these
      launches count, and need of a cell, is in the block's memory.
    - Of any other kernel, threads share the primitives of a bin, or the iterations of
      parallel loops. Of a loop in `lockstep` each iteration is a thread, barriers are
      the block's, and what lives across them is in registers; all threads go the way
      of iteration 0, and collectives take as many steps as the number of threads has
      binary digits. A loop in `pieces` is cut at its barriers, as on a CPU, and threads
      share those pieces in which no two iterations update a pixel, and the steps of
      its sorts, scans and reductions. What lies between
      such loops and has effects is done by the first thread, between two barriers; all
      else by all threads alike. Arrays that several threads see are in the block's
      memory.

      Where a primitive has a loop that changes state by atomics alone, whose order
      nobody sees, and nobody reads what they change, threads put it off, with the
      branch that it is in: what that needs waits in the block's memory until no
      room may be left for another round, and is taken in order of the length of its
      loop, which threads of a warp then have about the same of; two nested loops
      that count become one.

      Where a primitive has two ways with effects, and one of them keeps arrays that
      nothing else uses, that way is rare: it becomes a region that is marked with
      `piko.rare`, for `piko-outline-rare-work`. What threads have of outboxes, and the
      counters of units and cells, are in the block's memory then. If all that the
      usual way does is to emit, there are two launches: the first one has no such
      region; it drops what a round with a rare primitive has emitted, and leaves the
      unit there (`piko.gpu.leave_rest`). The second one (`kernel_start_rest`) goes on
      from there, and from where the bin begins if work in that takes what is emitted.

    What a thread emits goes to its outbox (`piko.gpu.outboxes`); behind each round of
    a loop that threads share the block takes it, in their order (`piko.gpu.flush`),
    so that what a block emits is in lineage order. Of a local edge the block has the
    records themselves, for the work that stands behind it. Updates and other access
    to state are converted as by `convert-piko-to-scf`; an access outside is an entry
    of the outbox.

    **Guarantees** that each update, store, atomic and emission happens once, and
    that the result does not depend on `threads` nor on how threads are scheduled.

    Before:
    ```
    piko.bins of @copy {
    ^bb0(%bin: index):
      piko.items of @copy {
      ^bb0(%f: !piko.prim<@F>):
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
      }
    }
    ```
    After:
    ```
    gpu.barrier
    scf.for %round = %begin to %end step %threads {
      %i = arith.addi %round, %thread : index
      %has = arith.cmpi slt, %i, %end : index
      scf.if %has {
        %p = piko.storage.append %log[0] (%x) : i32 -> !piko.prim<@F>
        piko.storage.next %log
      }
      piko.gpu.flush %log using %cells : memref<33xi64, 3>
    }
    gpu.barrier
    ```

    **Limits**: functions that have no form with the same bits on a GPU, and local
    barriers (`piko-fuse-kernels`), are errors, and so is a mapping that does not hold
    for the work that has it.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertGPUToEmulator : Pass<"convert-gpu-to-emulator", "::mlir::ModuleOp"> {
  let summary = "Launch kernels on a device that the CPU plays";
  let description = [{
    **Requires** kernels in `gpu.module`s, launched by `gpu.launch_func`, whose
    arguments are numbers and pointers.

    **Does**: makes of each launch a call of the emulator (`pikort/grid.h`), with
    the arguments in memory and the address of a function that runs one thread of
    the kernel. That function is made of the kernel's LLVM IR when the module is
    translated.

    **Guarantees** that the host's code is for a CPU alone.

    Before:
    ```
    gpu.launch_func @m::@k blocks in (%n, %one, %one) threads in (%t, %one, %one)
        args(%p : !llvm.ptr)
    ```
    After:
    ```
    %k = llvm.mlir.addressof @m.k.emulated : !llvm.ptr
    llvm.store %p, %arguments : !llvm.ptr, !llvm.ptr
    llvm.call @pikoir_grid_launch(%frame, %k, %n, %t, %arguments, %seed)
    ```

    **Limits**: grids and blocks have one dimension.
  }];
  let options = [
    Option<"seed", "seed", "int64_t", "0",
           "Permutes the blocks of a grid; 0 runs them in order">,
    Option<"blocks", "blocks", "int64_t", "0",
           "Most blocks of a grid (default: one for each unit of work)">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::LLVM::LLVMDialect"];
}

def ConvertGPUToCUDA : Pass<"convert-gpu-to-cuda", "::mlir::ModuleOp"> {
  let summary = "Launch kernels on a CUDA device";
  let description = [{
    **Requires** kernels in `gpu.module`s named after their pipelines (`P_gpu`),
    launched by `gpu.launch_func`, whose arguments are numbers and pointers that
    the device can read; and beside them the pipeline's `P.setup`.

    **Does**: makes of each launch a call of the runtime (`pikort/grid.h`), with
    the kernel's name and the arguments in memory. The setup names a constant,
    the list of images, which are made of the kernels' LLVM IR, as PTX and
    cubins, when the module is translated. It tells the runtime the stage and
    the line of each kernel, where its location has them: `loc("stage"("file"
    :line:column))`. Of `piko.steps` it makes a constant table, `P.steps`, which the
    setup gives to the runtime: it names for each kernel its grids, each with a
    function that computes its arguments from the pipeline's state, an input and a
    log.

    **Guarantees** that the host's code is for a CPU alone.

    Before:
    ```
    gpu.launch_func @P_gpu::@k blocks in (%n, %one, %one) threads in (%t, %one, %one)
        args(%p : !llvm.ptr)
    ```
    After:
    ```
    %k = llvm.mlir.addressof @k.name : !llvm.ptr
    llvm.store %p, %arguments : !llvm.ptr, !llvm.ptr
    llvm.call @pikoir_cuda_launch(%frame, %k, %n, %t, %arguments, %count)
    ```

    **Limits**: grids and blocks have one dimension; with `piko.steps`, blocks a
    constant size, and arguments no branches.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::LLVM::LLVMDialect"];
}

def OutlineRareWork : Pass<"piko-outline-rare-work", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Make functions of what few primitives of a kernel need";
  let description = [{
    **Requires** kernels as functions (`gpu-kernel-outlining`).

    **Does**: makes a function of each loop, or `scf.execute_region`, that is marked
    with `piko.rare`, which is not inlined, so that what it needs in registers and stack is not the
    kernel's where it is not called. It gets by value what the loop uses; private
    arrays that only the loop uses move into it, and of small ones that the kernel
    uses, too, it has a copy, which it gives back.

    Before:
    ```
    scf.for %i = %begin to %end step %one {
      ...
    } {piko.rare}
    ```
    After:
    ```
    func.call @kernel_rare(%begin, %end) : (index, index) -> ()
    ```

    **Limits**: an array of more than 16 numbers that both sides use is passed by
    its address.
  }];
  let dependentDialects = ["::mlir::func::FuncDialect",
                           "::mlir::memref::MemRefDialect"];
}

def SpillToBlock : Pass<"piko-spill-to-block", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Keep what an innermost loop seldom needs in the block's memory";
  let description = [{
    **Requires** kernels as functions (`gpu-kernel-outlining`), with as many threads
    as they say.

    **Does**: in a kernel whose registers are bounded, numbers that are alive over an
    innermost loop are spilled to the block's memory if they would take more than
    `max-registers`, all but those that each turn of the loop uses. Such a number is
    stored where it is known, at a place of the thread's own, and loaded again where
    it is used under a condition in the loop, in turns of the loop around it, or
    behind it; casts are made again there. The loads are not to be moved
    (`nontemporal`).

    Before:
    ```
    %depth = "setup"() : () -> f32
    scf.for %x = %lo to %hi step %one {
      %covered = "test"(%x) : (index) -> i1
      scf.if %covered {
        "shade"(%depth) : (f32) -> ()
      }
    }
    ```
    After:
    ```
    %depth = "setup"() : () -> f32
    memref.store %depth, %places[%thread] : memref<64xf32, 3>
    scf.for %x = %lo to %hi step %one {
      %covered = "test"(%x) : (index) -> i1
      scf.if %covered {
        %again = memref.load %places[%thread] {nontemporal = true} : memref<64xf32, 3>
        "shade"(%again) : (f32) -> ()
      }
    }
    ```

    **Limits**: no pointers, which are found again from numbers, and no truth values;
    at most `max-bytes` a thread, and 24 KB of a block.
  }];
  let options = [Option<"maxRegisters", "max-registers", "int64_t", "52",
                        "registers of 32 bits of what may be alive over a loop">,
                 Option<"maxBytes", "max-bytes", "int64_t", "192",
                        "of the block's memory for each thread">];
  let dependentDialects = ["::mlir::memref::MemRefDialect"];
}

def ReloadInputs : Pass<"piko-reload-inputs", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Load members of the input where kernels need them";
  let description = [{
    **Requires** kernels as functions (`gpu-kernel-outlining`).

    **Does**: loads that are marked with `piko.input` stand where a kernel begins,
    and their registers would be taken until it ends. For each use there is another
    load, in front of the outermost loop around the use whose body has no loop but
    those around the use. What only a run that fails needs (`piko.fails`) is loaded
    where that is told.

    Before:
    ```
    %units = llvm.load %input {piko.input} : !llvm.ptr -> !llvm.ptr
    scf.for %unit = %first to %count step %blocks {
      "use"(%units) : (!llvm.ptr) -> ()
      scf.for ...
    }
    ```
    After:
    ```
    scf.for %unit = %first to %count step %blocks {
      %same = llvm.intr.launder.invariant.group %input : !llvm.ptr
      %units = llvm.load %same : !llvm.ptr -> !llvm.ptr
      "use"(%units) : (!llvm.ptr) -> ()
      scf.for ...
    }
    ```

    **Limits**: only of addresses at a constant distance from what a kernel is given.
  }];
  let dependentDialects = ["::mlir::LLVM::LLVMDialect"];
}

def ConvertGPUToExactNVVM
    : Pass<"convert-gpu-to-exact-nvvm", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Turn kernels into the nvvm and llvm dialects, without libdevice";
  let description = [{
    **Requires** kernels without structured control flow (`convert-scf-to-cf-in-reverse`).

    **Does**: what upstream's `convert-gpu-to-nvvm` does, but for functions. Those
    of `math` become LLVM's, which PTX has with the bits of a CPU: `math.sqrt` is
    `sqrt.rn`, not an approximation or a call of NVIDIA's library. Private arrays
    move to the kernel's entry.

    **Guarantees** that only the `nvvm` and `llvm` dialects are left.

    Before:
    ```
    %r = math.sqrt %x : f32
    ```
    After:
    ```
    %r = llvm.intr.sqrt(%x) : (f32) -> f32
    ```

    **Limits**: a function that PTX has only as an approximation is an error.
  }];
  let dependentDialects = ["::mlir::LLVM::LLVMDialect",
                           "::mlir::NVVM::NVVMDialect"];
}

def ConvertSCFToControlFlowInReverse
    : Pass<"convert-scf-to-cf-in-reverse"> {
  let summary = "Turn structured control flow into branches, the last first";
  let description = [{
    **Does**: what upstream's `convert-scf-to-cf` does, with its patterns, but from the
    end of each block. A conversion splits its block, and each operation behind it
    moves to the new one: from the front, N conditions of a block move its end N
    times, from the end once. What the text says of a branch (`piko.probability`)
    becomes its weights.

    **Guarantees** that no operation of `scf` with a region is left.

    Before:
    ```
    scf.if %c {
      "store"() : () -> ()
    }
    "rest"() : () -> ()
    ```
    After:
    ```
      cf.cond_br %c, ^bb1, ^bb2
    ^bb1:
      "store"() : () -> ()
      cf.br ^bb2
    ^bb2:
      "rest"() : () -> ()
    ```

    **Limits**: one that upstream cannot convert is an error.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::cf::ControlFlowDialect"];
}

def ConvertPikoToLLVM : Pass<"convert-piko-to-llvm", "::mlir::ModuleOp"> {
  let summary = "Turn kernels into functions on the runtime's storage";
  let description = [{
    **Requires** kernels of loops whose updates are gone
    (`convert-piko-to-scf`), and a `piko.program`.

    **Does**: makes of each kernel a function that takes the runtime's pipeline
    and gives back a status, of each program two more, `NAME.setup` that declares
    the pipeline and its joins to the runtime and `NAME.run` that clears state and
    calls the kernels in order, with a loop of branches for each region. Where kernels
    launch grids, the setup has `piko.steps`, by which a device can run the program
    by itself. It turns primitives, bins and writers into pointers, and operations on
    them into loads, stores and calls of the runtime's `pikoir_*` functions. Each
    load, store and call says in TBAA what it touches, of state and of
    primitives each field by itself, so that LLVM keeps in registers what it
    does not.
    The units of a kernel on a cycle become calls of a function, `KERNEL.unit`,
    without a parallel region where there is one thread for them. The versions of a
    loop over primitives become functions as well, `KERNEL.version0` and so on, where
    the scalar one is one of two itself (`piko-unswitch-versions`): none spills
    registers for another.

    **Guarantees** that nothing of the `piko` dialect is left but `piko.steps`.

    Before:
    ```
    %z = piko.get %f "z" : !piko.prim<@F> -> f32
    ```
    After:
    ```
    %p = llvm.getelementptr inbounds %f[8] : (!llvm.ptr) -> !llvm.ptr, i8
    %z = llvm.load %p {tbaa = [#field_z]} : !llvm.ptr -> f32
    ```

    **Limits**: other dialects are left as they are; upstream's conversions take
    them from there.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::func::FuncDialect",
                           "::mlir::LLVM::LLVMDialect",
                           "::mlir::scf::SCFDialect"];
}

#endif // PIKO_CONVERSION_PASSES_TD
