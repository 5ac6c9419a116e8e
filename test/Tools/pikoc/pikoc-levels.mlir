// RUN: pikoc %s --emit=authored | FileCheck %s --check-prefixes=AUTHORED,STAGE
// RUN: pikoc %s --emit=kernels | FileCheck %s --check-prefixes=KERNELS,STAGE
// RUN: pikoc %s --emit=machine | FileCheck %s --check-prefixes=MACHINE,STAGE
// RUN: pikoc %s --emit=target | FileCheck %s --check-prefixes=TARGET,UPSTREAM
// RUN: pikoc %s --emit=llvm | FileCheck %s --check-prefixes=LLVM,UPSTREAM
// RUN: pikoc %s -o %t.ll && FileCheck %s --check-prefixes=LLVMIR,UPSTREAM --input-file %t.ll
// RUN: pikoc %s --emit=llvmir | diff - %t.ll
// The same path by the tools for compiler engineers ends at the same text.
// RUN: piko-opt %s --piko-synthesize --piko-to-machine --piko-to-cpu --piko-cpu-to-llvm | piko-translate --mlir-to-llvmir | FileCheck %s --check-prefix=LLVMIR
// A pipeline written by hand goes down every level.

piko.record @float {"value" : f32 at 0} size 4 align 4
// STAGE: piko.pipeline @Copy
// UPSTREAM-NOT: piko.pipeline
// LLVM-DAG: llvm.func @Copy.run
// LLVM-DAG: llvm.func @Copy.setup
// LLVMIR-DAG: define i32 @Copy.run(
// LLVMIR-DAG: define void @Copy.setup(
// TARGET: omp.parallel
piko.pipeline @Copy rank 2 {
  piko.buffer @sink : @float
  piko.source @copy
  // STAGE: piko.stage @copy
  piko.stage @copy bins [0, 0] threads 64 : @float -> [] {
    // AUTHORED: piko.process {
    // KERNELS: piko.kernel
    // KERNELS: piko.process of @copy
    // MACHINE-NOT: piko.process
    // MACHINE: piko.items of @copy
    piko.process {
    ^bb0(%p: !piko.prim<@float>):
      %v = piko.get %p "value" : !piko.prim<@float> -> f32
      %zero = arith.constant 0 : index
      piko.store %v, @sink[%zero : index] "value" : f32
      piko.return
    }
  }
}
