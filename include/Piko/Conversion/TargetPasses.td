// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that take kernels to upstream dialects and LLVM.

#ifndef PIKO_CONVERSION_TARGETPASSES_TD
#define PIKO_CONVERSION_TARGETPASSES_TD

include "mlir/Pass/PassBase.td"

def ConvertPikoToSCF : Pass<"convert-piko-to-scf", "::piko::PipelineOp"> {
  let summary = "Turn updates and checked access into structured control flow";
  let description = [{
    **Requires** loops over units (`piko-form-units`).

    **Does**: turns each `piko.update` into an `scf.if` around the loads of the pixel,
    the body and the stores. Puts `piko.load`, `piko.store`, `piko.atomic`, reads of
    lists and integer divisions under tests of their operands. Where a test fails,
    `piko.fail` or its like reports it with the bin, nothing is written, and a read
    gives 0. What is `checked`, and reads by a loop over the list, need no test.

    A `piko.tile` stays where it is in the image. Its rows get the clear value where
    the bin begins, if the launch clears the image. Otherwise `piko.cpu.open_tile`
    lets the runtime copy them where they compete for the cache. With `private-tiles`,
    it becomes arrays of the thread's.

    **Guarantees** that no kernel touches memory outside a buffer or an image, and no
    update a pixel outside the bin.

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
      %bin = piko.storage.bucket_bin %bins[%cell] : !piko.bins<@F>
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

    **Does**: turns the `scf.forall` of each kernel into an `omp.parallel` with the
    host's thread count. By its `piko.units`, each thread takes the next unit
    (`shared`), first those of its own (`mapped`), or asks the runtime for each
    (`asked`); a `serial` loop becomes a sequential `scf.for`. Private arrays move to
    the start of the thread's region, so that they take stack space once and not for
    each primitive.

    Before:
    ```
    scf.forall (%u) in (%units) { ... } {piko.units = #piko<units shared>}
    ```
    After:
    ```
    %threads = piko.cpu.threads
    omp.parallel num_threads(%threads : i32) {
      scf.if %some {
        scf.while : () -> index {
          %next = piko.cpu.take_unit %bins : !piko.bins<@Fragment>
          %any = arith.cmpi ult, %next, %units : index
          scf.condition(%any) %next : index
        } do {
        ^bb0(%u: index):
          ...
          scf.yield
        }
      }
    }
    ```

    **Limits**: threads share no loops inside a unit.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::omp::OpenMPDialect",
                           "::mlir::scf::SCFDialect"];
}

def ConvertSCFToControlFlowInReverse
    : Pass<"convert-scf-to-cf-in-reverse"> {
  let summary = "Turn structured control flow into branches, the last first";
  let description = [{
    **Requires** nothing in particular: it works on `scf` in any operation.

    **Does**: what upstream's `convert-scf-to-cf` does, with its patterns, but from
    the end of each block. A conversion splits its block, and each operation after it
    moves to the new one. Taken in order, N conditions of a block move its end N
    times; in reverse they move it once. The probability of a branch
    (`piko.probability`) becomes its weights.

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

    **Limits**: an operation that upstream cannot convert is an error.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::cf::ControlFlowDialect"];
}

def ConvertPikoToLLVM : Pass<"convert-piko-to-llvm", "::mlir::ModuleOp"> {
  let summary = "Turn kernels into functions on the runtime's storage";
  let description = [{
    **Requires** kernels of loops whose updates are gone (`convert-piko-to-scf`), and
    a `piko.program`.

    **Does**: turns each kernel into a function that takes the runtime's pipeline and
    gives back a status. Each program becomes two more. `NAME.setup` declares the
    pipeline and its joins to the runtime, and has `piko.steps` where kernels launch
    grids. `NAME.run` clears state and calls the kernels in order, with a loop for
    each region. Primitives, bins and writers become pointers. Operations on them
    become loads, stores and calls of the runtime's `pikoir_*` functions. TBAA says
    what each touches.

    The units of a kernel on a cycle become calls of `KERNEL.unit`. Versions of a loop
    become calls of `KERNEL.version0` and so on, where the scalar one is two itself
    (`piko-unswitch-versions`). None spills registers for another.

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

    **Limits**: other dialects are left to upstream's conversions.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::func::FuncDialect",
                           "::mlir::LLVM::LLVMDialect",
                           "::mlir::scf::SCFDialect"];
}

#endif // PIKO_CONVERSION_TARGETPASSES_TD
