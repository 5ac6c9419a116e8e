// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that make grids of kernels, in the order in which they run, which is why
// they are in one file.

#ifndef PIKO_CONVERSION_GPUPASSES_TD
#define PIKO_CONVERSION_GPUPASSES_TD

include "mlir/Pass/PassBase.td"

def ShareAppends : Pass<"piko-share-appends", "::piko::PipelineOp"> {
  let summary = "Let threads share loops that append to lists";
  let description = [{
    **Requires** the machine level (`piko-form-work`); before `piko-map-threads`, which
    says who takes what.

    **Does**: stream compaction. A loop of a list's process phase that counts, and
    changes nothing but lists that it appends to, is strip-mined. A strip is a
    `piko.parallel_for`: a prefix sum (`piko.scan`) of what iterations append says
    where. Fewer than 64 iterations stay a loop.

    **Guarantees** the same lists, in order.

    Before:
    ```
    %n = scf.for %i = %zero to %end step %one iter_args(%k = %zero) -> index {
      %next = scf.if %test -> index { memref.store %i, %list[%k] ... }
      scf.yield %next : index
    }
    ```
    After:
    ```
    scf.for %first = %zero to %end step %c256 {
      piko.parallel_for %count {
      ^bb0(%i: index):
        %before = piko.scan %flag empty %none : i32 { ... arith.addi ... }
        scf.if %appends { memref.store %value, %list[%place] ... }
        ...
      }
    }
    ```

    **Limits**: an iteration neither emits nor changes state, and reads no list. What
    it does in vain where a list is full (`n < most`) has no loops, and cannot fail.
  }];
  let options = [
    Option<"stripSize", "strip", "int64_t", "256",
           "iterations that threads share at once (default: 256)">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def MapThreads : Pass<"piko-map-threads", "::piko::PipelineOp"> {
  let summary = "Say how the threads of a block share a kernel's work";
  let description = [{
    **Requires** the machine level (`piko-form-work`); best after `piko-map-lanes`.

    **Does**: chooses the threads of a block (`piko.block_size`), and marks who takes
    what (`piko.threads`). Of work on primitives:

    - `collapsed`: threads take the pixels of many primitives as one space.
    - `pixels`: threads share the pixels of one primitive after the other.
    - `shared`: each thread takes some primitives.
    - `by_count`: `shared` for `piko.fewest` primitives of a bin or more, else `one`.
    - `one`: the block takes one primitive after the other.

    Of a parallel loop: `shared`; `lockstep`, a thread for each iteration, between
    barriers; `pieces`, cut at barriers, or `pieces_of_one` for one thread; or `one`.
    An update whose pixel follows from data becomes a `piko.grouped`, a barrier.

    **Guarantees** that updates of a pixel keep their lineage order.

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

    **Limits**: in checking mode threads share neither primitives nor iterations. A
    remark says why they do not share pixels or iterations.
  }];
  let options = [
    Option<"threads", "threads", "int64_t", "0",
           "Threads of a block, a power of two up to 1024 (default: what the "
           "stage has, rounded down to one; more where a bin has more than 16 "
           "pixels for each, or is the whole domain, up to 256)">,
    Option<"collapses", "collapse", "bool", "true",
           "threads take the pixels of many primitives as one space">,
    Option<"groups", "group", "bool", "true",
           "threads share updates whose pixels follow from data, in groups">,
    Option<"counts", "by-count", "bool", "true",
           "the number of a bin's primitives says whether threads have some each">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def ExpandRemainders : Pass<"piko-expand-remainders", "::piko::PipelineOp"> {
  let summary = "Divide floats with remainder by integers";
  let description = [{
    **Requires** the machine level (`piko-form-work`); before `piko-form-grids`.

    **Does**: expands the remainder of floats of 32 and 64 bits, C's `fmod`, which a
    GPU has no instruction for: long division of the significands, as many bits at a
    time as an integer has room for.

    **Guarantees** the bits of `fmod`: each step is exact.

    Before:
    ```
    %r = arith.remf %x, %y : f32
    ```
    After:
    ```
    %r = scf.if %is_known -> (f32) {
      scf.yield %small : f32        // |x| < |y|, or a NaN
    } else {
      %rest:2 = scf.while (%d = %first, %left = %places) ... // 40 bits at a time
      ...
    }
    ```

    **Limits**: other floats stay.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::scf::SCFDialect"];
}

def FormGrids : Pass<"piko-form-grids", "::piko::PipelineOp"> {
  let summary = "Make grids of blocks of the work of kernels";
  let description = [{
    **Requires** the machine level (`piko-form-work`) and a mapping to threads
    (`piko-map-threads`).

    **Does**: makes a `gpu.launch` of each kernel's work. A block has a unit of the
    stored bins, with loops over its buckets and their primitives. What these emit
    goes to append buffers (`piko.gpu.append_buffers`), and what local edges keep is
    in shared memory. Marks of the mapping stay on loops.

    **Guarantees** that the mapping holds: `piko.threads` is checked against what the
    loops do.

    Before:
    ```
    piko.bins of @copy {
    ^bb0(%bin: index):
      piko.items of @copy attributes {piko.threads = #piko<threads shared>} { ... }
    }
    ```
    After:
    ```
    gpu.launch blocks(%unit, ...) threads(%thread, ...) {
      piko.gpu.append_buffers %log in %buffers : memref<6xi64> using %words ...
      scf.for %bucket = ... {
        scf.for %i = %begin to %end step %one { ... } {piko.threads = #piko<threads shared>}
      }
    }
    ```

    **Limits**: functions with other bits in PTX, tiles, local edges into other bins
    and illegal mappings are errors.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def SharePixels : Pass<"piko-share-pixels", "::piko::PipelineOp"> {
  let summary = "Let the threads of a block share the pixels of a bin";
  let description = [{
    **Requires** grids (`piko-form-grids`).

    **Does**: rewrites loops over primitives that are mapped as

    - `pixels`: each thread has some pixels of a primitive. Threads share the setup of
      primitives, which is split off (loop fission).
    - `collapsed`: primitives are taken in groups of at most 64, whose pixels are one
      space (loop collapsing). Each thread tests some of them, and then updates some
      in the order of primitives. A primitive that takes a rare branch is left to a
      second launch (`piko.gpu.leave_rest`).

    Other launches stay as they are.

    **Guarantees** that the updates of a pixel keep their lineage order.

    Before:
    ```
    scf.for %i = %begin to %end step %one {
      scf.for %x = %lo to %hi step %one { piko.update @image[%x] ... }
    } {piko.threads = #piko<threads pixels>}
    ```
    After:
    ```
    scf.for %i = %begin to %end step %one {
      scf.for %k = %zero to %count step %one {
        %x = arith.addi %first, ... // one of the thread's
        piko.update @image[%x] ...
      }
    }
    ```

    **Limits**: where a mapping that is written by hand does not hold, an error.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ShareLoops : Pass<"piko-share-loops", "::piko::PipelineOp"> {
  let summary = "Say which loops the threads of a block share";
  let description = [{
    **Requires** grids (`piko-form-grids`).

    **Does**: converts loops over primitives and parallel loops as they are mapped:

    - `shared`: a counted loop marked `piko.shared`.
    - `pieces`, `pieces_of_one`: loops between barriers (loop fission), those that
      threads share marked `piko.shared`.
    - `by_count`: two versions, of which the number of primitives chooses one (loop
      versioning).
    - `one`: a counted loop; if it emits for primitives, marked `piko.ordered`.
    - `lockstep`: stays.

    Before:
    ```
    piko.parallel_for %n {
    ^bb0(%i: index):
      ...
      piko.yield
    } {piko.threads = #piko<threads shared>}
    ```
    After:
    ```
    scf.for %i = %zero to %n step %one { ... } {piko.shared}
    ```
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def CompactWork : Pass<"piko-compact-work", "::piko::PipelineOp"> {
  let summary = "Put off atomics of inner loops until all threads have some";
  let description = [{
    **Requires** `piko-share-loops`.

    **Does**: stream compaction. In a loop that threads share, an inner loop that
    changes state by atomics alone is put off, with the branch around it: an iteration
    puts what that needs into a queue in shared memory, and a `piko.gpu.drain` after
    the loop does it. Two loops that are nested become one (loop coalescing), so that
    threads have loops of about one length.

    **Guarantees** the same state: nobody sees the order of these atomics.

    Before:
    ```
    scf.for %i = %begin to %end step %one {
      scf.for %k = %zero to %n step %one { piko.atomic add @counts[%k] ... }
    } {piko.shared}
    ```
    After:
    ```
    scf.for %i = %begin to %end step %one {
      %slot = memref.atomic_rmw addi %one_i32, %count[%zero] ...
      memref.store %n, %numbers[%slot] ...
    } {piko.shared}
    piko.gpu.drain %count, %lengths, %starts, %classes, %order : ... {
    ^bb0(%entry: index):
      ...
    }
    ```

    **Limits**: blocks of at least 32 threads, without local edges; additions of
    floats stay.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def SplitRare : Pass<"piko-split-rare", "::piko::PipelineOp"> {
  let summary = "Give rare branches regions and launches of their own";
  let description = [{
    **Requires** `piko-share-loops`; best after `piko-compact-work`.

    **Does**: in a loop over primitives that threads share, makes a region marked
    `piko.rare` of each branch that alone keeps arrays, as clipping does, unless the
    text calls it likely; `piko-outline-rare-work` makes a function of it. If all else
    that the loop does is to emit, the kernel gets a second launch: the first one
    leaves a unit where it comes to such a branch (`piko.gpu.leave_round`), and the
    second one, which calls that function, goes on there.

    **Guarantees** the order of emissions.

    Before:
    ```
    scf.if %usual { ... } else { memref.store %x, %array[%k] ... }
    ```
    After:
    ```
    scf.if %usual { ... } else { piko.gpu.leave_round }
    // in the second launch
    scf.if %usual { ... } else { scf.execute_region no_inline { ... } {piko.rare} }
    ```

    **Limits**: a kernel that precedes another one has no second launch, nor one whose
    loop changes state.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def MapBlocks : Pass<"piko-map-blocks", "::piko::PipelineOp"> {
  let summary = "Map the work of blocks to their threads";
  let description = [{
    **Requires** `piko-share-loops`.

    **Does**: lets the first thread do what has effects, between barriers; threads
    share loops marked `piko.shared`, in rounds where they emit; iterations that meet
    at barriers are threads (`piko.parallel_for`). After a round the block takes what
    its threads have emitted (`piko.gpu.flush`). Arrays that more than one thread sees
    go to shared memory. Access to state is converted as by `convert-piko-to-scf`.

    **Guarantees** that each effect happens once, and that the result depends neither
    on the count of threads nor on their order.

    Before:
    ```
    scf.for %i = %begin to %end step %one { piko.storage.append %log[0] ... } {piko.shared}
    ```
    After:
    ```
    gpu.barrier
    scf.for %round = %begin to %end step %threads {
      %i = arith.addi %round, %thread : index
      %has = arith.cmpi slt, %i, %end : index
      scf.if %has { piko.storage.append %log[0] ... }
      piko.gpu.flush %log[%unit] using %words : memref<33xi64, 3>
    }
    gpu.barrier
    ```
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def TakeUnits : Pass<"piko-take-units", "::piko::PipelineOp"> {
  let summary = "Say which block runs which units of work";
  let description = [{
    **Requires** work that is mapped to threads (`piko-map-blocks`).

    **Does**: puts a loop over units around the work of a block, since a grid may have
    fewer blocks than units. By the stage's schedule, a block has every n-th unit, one
    that the hardware begins, or takes the next one from a counter
    (`piko.gpu.take_units`). It flushes append buffers after each unit. Launches that
    call functions for rare primitives keep counters and append buffers in shared
    memory, as registers are short. A kernel that precedes another one of its stage
    (`precedes`) becomes a launch of that one.

    **Guarantees** that each unit is run once.

    Before:
    ```
    gpu.launch blocks(%unit, ...) ... { "work"(%unit) }
    ```
    After:
    ```
    gpu.launch blocks(%block, ...) ... {
      %units = piko.storage.unit_count %bins : !piko.bins<@F>
      scf.for %unit = %block to %units step %blocks {
        "work"(%unit)
        piko.gpu.flush %log[%unit] using %words : memref<33xi64, 3>
        gpu.barrier
      }
    }
    ```
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ReloadInputs : Pass<"piko-reload-inputs", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Load members of the input where kernels need them";
  let description = [{
    **Requires** kernels as functions (`gpu-kernel-outlining`).

    **Does**: repeats loads that are marked `piko.input` where their numbers are
    needed. They stand where a kernel begins, and their registers would be taken until
    it ends. Each use gets a load before the outermost loop around it whose body has
    no loop but those around the use. What only a run that fails needs (`piko.fails`)
    is loaded where that is told.

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

    **Limits**: only addresses at a constant distance from what a kernel is given are
    loaded again.
  }];
  let dependentDialects = ["::mlir::LLVM::LLVMDialect"];
}

def OutlineRareWork : Pass<"piko-outline-rare-work", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Make functions of what few primitives of a kernel need";
  let description = [{
    **Requires** kernels as functions (`gpu-kernel-outlining`).

    **Does**: makes a function of each `scf.for` or `scf.execute_region` that is
    marked `piko.rare`. The function is not inlined, so that its registers and its
    stack are not the kernel's where it is not called. It gets by value what the loop
    uses, but the kernel's own parameters in shared memory. Private arrays that only
    the loop uses move into it. Of small arrays that the kernel uses, too, it has a
    copy, which it gives back.

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

    **Limits**: an array of more than 16 numbers that both sides use is passed by its
    address.
  }];
  let dependentDialects = ["::mlir::func::FuncDialect",
                           "::mlir::memref::MemRefDialect"];
}

def SpillToBlock : Pass<"piko-spill-to-block", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Keep what an innermost loop seldom needs in shared memory";
  let description = [{
    **Requires** kernels as functions (`gpu-kernel-outlining`), with as many threads
    as they say.

    **Does**: register spilling to shared memory, in kernels whose registers are
    bounded. Numbers that are alive over an innermost loop are spilled if all of them
    take more than `max-registers`. Those that each iteration uses stay in registers.
    A spilled number is stored where it is known, at a place of the thread's own. It
    is loaded again where the loop uses it under a condition, in iterations of the
    loop around it, or after it. Casts are made again there. The loads are not to be
    moved (`nontemporal`).

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

    **Limits**: pointers, which are found again from numbers, and truth values are not
    spilled. A thread gets at most `max-bytes`. Shared memory of a block grows to at
    most 24 KB.
  }];
  let options = [Option<"maxRegisters", "max-registers", "int64_t", "52",
                        "registers of 32 bits of what may be alive over a loop">,
                 Option<"maxBytes", "max-bytes", "int64_t", "192",
                        "of shared memory for each thread">];
  let dependentDialects = ["::mlir::memref::MemRefDialect"];
}

def ConvertGPUToExactNVVM
    : Pass<"convert-gpu-to-exact-nvvm", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Turn kernels into the nvvm and llvm dialects, without libdevice";
  let description = [{
    **Requires** kernels without structured control flow
    (`convert-scf-to-cf-in-reverse`).

    **Does**: what upstream's `convert-gpu-to-nvvm` does, but for functions. Those of
    `math` become LLVM's, which PTX has with the bits of a CPU. `math.sqrt` is
    `sqrt.rn`, neither an approximation nor a call of NVIDIA's library. `nontemporal`
    loads of shared memory become volatile, and bound the kernel's registers. Atomics
    on shared memory are relaxed. Pointers that are loaded are to global memory.

    **Guarantees** that only the `nvvm` and `llvm` dialects are left in the module.

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

def ConvertGPUToCUDA : Pass<"convert-gpu-to-cuda", "::mlir::ModuleOp"> {
  let summary = "Launch kernels on a CUDA device";
  let description = [{
    **Requires** kernels in `gpu.module`s named after their pipelines (`P_gpu`),
    beside the pipeline's `P.setup`. The arguments of a `gpu.launch_func` are numbers,
    and pointers that the device can read.

    **Does**: turns each launch into a call of the runtime (`pikort/grid.h`), with the
    kernel's name and arguments in memory. The setup names a constant, the list of
    images: PTX and cubins, which the translation makes of the kernels. It also tells
    the stage and the line of each kernel, as its location has them:
    `loc("stage"("file":line:column))`. `piko.steps` becomes a constant table,
    `P.steps`, which the setup gives to the runtime. The table names the grids of each
    kernel, each with a function that computes its arguments from the pipeline's
    state, an input and a log.

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

    **Limits**: grids and blocks have one dimension. With `piko.steps`, blocks have a
    constant size, and arguments no branches.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::LLVM::LLVMDialect"];
}

def ConvertGPUToEmulator : Pass<"convert-gpu-to-emulator", "::mlir::ModuleOp"> {
  let summary = "Launch kernels on a device emulated on the CPU";
  let description = [{
    **Requires** kernels in `gpu.module`s, launched by `gpu.launch_func`, whose
    arguments are numbers and pointers.

    **Does**: turns each launch into a call of the emulator (`pikort/grid.h`). The
    call has the arguments in memory and the address of a function that runs one
    thread of the kernel. The translation makes that function of the kernel's LLVM IR.

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

#endif // PIKO_CONVERSION_GPUPASSES_TD
