// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that take resolved kernels to upstream dialects.

#ifndef PIKO_CONVERSION_PASSES_TD
#define PIKO_CONVERSION_PASSES_TD

include "mlir/Pass/PassBase.td"

def ConvertPikoToSCF : Pass<"convert-piko-to-scf", "::piko::PipelineOp"> {
  let summary = "Turn updates and checked access into structured control flow";
  let description = [{
    **Requires** the resolved level.

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
      %bin = piko.cell_bin %bins[%cell] : !piko.bins<@F>
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
    **Requires** the resolved level.

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
    %threads = piko.threads
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

def ConvertPikoToLLVM : Pass<"convert-piko-to-llvm", "::mlir::ModuleOp"> {
  let summary = "Turn kernels into functions on the runtime's storage";
  let description = [{
    **Requires** resolved kernels whose updates are gone
    (`convert-piko-to-scf`).

    **Does**: makes of each kernel a function that takes the runtime's pipeline
    and gives back a status, of each pipeline two more, `NAME.setup` that
    declares the pipeline to the runtime and `NAME.run` that calls the kernels in
    order; turns primitives, bins and writers into pointers, and operations on
    them into loads, stores and calls of the runtime's `pikoir_*` functions.

    **Guarantees** that nothing of the `piko` dialect is left.

    Before:
    ```
    %z = piko.get %f "z" : !piko.prim<@F> -> f32
    ```
    After:
    ```
    %p = llvm.getelementptr inbounds %f[8] : (!llvm.ptr) -> !llvm.ptr, i8
    %z = llvm.load %p {alignment = 4 : i64} : !llvm.ptr -> f32
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
