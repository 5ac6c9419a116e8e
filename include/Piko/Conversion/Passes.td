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
    unless the index is that of a loop over the list.

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
      %bin = piko.cpu.cell_bin %bins[%cell] : !piko.bins<@F>
      piko.fail @stage in %bin outside @verts(%i)
    }
    ```

    **Limits**: indices into array fields are not tested.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertPikoToOpenMP : Pass<"convert-piko-to-openmp", "::piko::PipelineOp"> {
  let summary = "Spread the units of work over threads";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns the `scf.forall` of each kernel into an `omp.parallel` with
    the host's thread count around an `omp.wsloop`: with a dynamic schedule for
    `load_balance` and `all`, a static one for `direct_map`. For `serialize` it
    becomes a plain loop. Private arrays move to the front of the thread's
    region, so that they take stack space once and not for each primitive.

    Before:
    ```
    scf.forall (%u) in (%units) { ... }
    ```
    After:
    ```
    %threads = piko.cpu.threads
    omp.parallel num_threads(%threads : i32) {
      omp.wsloop schedule(dynamic) {
        omp.loop_nest (%u) : index = (%zero) to (%units) step (%one) { ... }
      }
    }
    ```

    **Limits**: loops inside are not spread.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::omp::OpenMPDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertPikoToGPU : Pass<"convert-piko-to-gpu", "::piko::PipelineOp"> {
  let summary = "Turn kernels that update pixels into grids of blocks";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns the `scf.forall` of each kernel that updates pixels into a
    `gpu.launch`. A block runs a unit of work, which holds whole bins. Its threads
    share out the pixels of a bin: a pixel is that thread's whose place in a tile
    of `threads` pixels it has. All threads take all the primitives of the bin in
    order, so that the updates of a pixel keep their lineage order; what belongs
    to other threads' pixels is behind a test of the pixel, or, where a loop counts
    through pixels, stepped over. The block copies fields of as many primitives as
    it has threads into its own memory, between two `gpu.barrier`s. Updates and
    other access to state are converted as by `convert-piko-to-scf`; an access
    outside is noted for the block and reported behind the launch. Kernels that
    update no pixel stay as they are.

    **Guarantees** that each update, store and atomic happens once, and that the
    result does not depend on `threads` nor on how threads are scheduled.

    Before:
    ```
    scf.forall (%u) in (%units) {
      scf.for %i = %begin to %end step %one {
        ... piko.update @depth[%x, %y : i32, i32] in %bin { ... } ...
      }
    }
    ```
    After:
    ```
    gpu.launch blocks(%u, ...) in (%units, ...) threads(%t, ...) in (%c64, ...) {
      scf.for %base = %begin to %end step %c64 {
        ... memref.store %field, %fields[%t] ...
        gpu.barrier
        scf.for %k = %zero to %count step %one {
          scf.if %mine { ... piko.load @depth ... piko.store ... }
        }
        gpu.barrier
      }
    }
    ```

    **Limits**: a kernel that emits, takes lists, meets barriers or reads state
    that it writes is an error, and so are a store that does not follow from one
    pixel, an outcome of an update that decides about other pixels, and functions
    that have no form with the same bits on a GPU. If one primitive's pixels fail
    in several ways, which of them is reported depends on `threads`.
  }];
  let options = [
    Option<"threads", "threads", "int64_t", "0",
           "Threads of a block, a power of two up to 1024 (default: what the "
           "stage has, rounded down to one)">];
  let statistics = [
    Statistic<"grids", "grids", "kernels that became grids">,
    Statistic<"strided", "strided", "loops that step over others' pixels">,
    Statistic<"guarded", "guarded", "tests of whose a pixel is">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::gpu::GPUDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertGPUToSCF : Pass<"convert-gpu-to-scf", "::mlir::ModuleOp"> {
  let summary = "Run blocks and threads one after the other";
  let description = [{
    **Requires** kernels in `gpu.module`s, launched by `gpu.launch_func`, with
    structured control flow.

    **Does**: makes of each kernel a function that runs one block, and of each
    launch a loop over blocks that calls it. A loop over the block's threads
    stands for what lies between two barriers. What is the same for all threads is
    computed once, what is cheap again in each loop; private arrays get a copy for
    each thread, and memory of the block is allocated by the function.

    **Guarantees** that no `gpu.module` is left, and that a program without data
    races has the same result as on a GPU.

    Before:
    ```
    gpu.func @k(%p: !llvm.ptr) kernel {
      %t = gpu.thread_id x
      A(%t)
      gpu.barrier
      B(%t)
      gpu.return
    }
    ```
    After:
    ```
    func.func private @k(%block: index, %blocks: index, %p: !llvm.ptr) {
      scf.for %t = %zero to %threads step %one { A(%t) }
      scf.for %t = %zero to %threads step %one { B(%t) }
      return
    }
    ```

    **Limits**: grids and blocks have one dimension, and a block a constant number
    of threads. Barriers stand in the kernel's body or in `scf.for`s with the same
    bounds for all threads; other numbers than those that can be computed again do
    not live across a barrier.
  }];
  let options = [
    Option<"reverse", "reverse", "bool", "false",
           "Run threads from the last to the first">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::func::FuncDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertGPUToExactNVVM
    : Pass<"convert-gpu-to-exact-nvvm", "::mlir::gpu::GPUModuleOp"> {
  let summary = "Turn kernels into the nvvm and llvm dialects, without libdevice";
  let description = [{
    **Requires** kernels without structured control flow (`convert-scf-to-cf`).

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

def ConvertPikoToLLVM : Pass<"convert-piko-to-llvm", "::mlir::ModuleOp"> {
  let summary = "Turn kernels into functions on the runtime's storage";
  let description = [{
    **Requires** kernels of loops whose updates are gone
    (`convert-piko-to-scf`), and a `piko.program`.

    **Does**: makes of each kernel a function that takes the runtime's pipeline
    and gives back a status, of each program two more, `NAME.setup` that declares
    the pipeline and its joins to the runtime and `NAME.run` that clears state and
    calls the kernels in order, with a loop of branches for each region; turns primitives, bins and writers into pointers, and operations on
    them into loads, stores and calls of the runtime's `pikoir_*` functions. Each
    load, store and call says in TBAA what it touches, of state and of
    primitives each field by itself, so that LLVM keeps in registers what it
    does not.
    The units of a kernel on a cycle become calls of a function, `KERNEL.unit`,
    without a parallel region where there is one thread for them.

    **Guarantees** that nothing of the `piko` dialect is left.

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
