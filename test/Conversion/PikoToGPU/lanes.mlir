// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-lanes,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' | FileCheck %s
// A block's threads are given what piko-map-lanes says.

piko.record @F {"x" : i32 at 0} size 4 align 4

// Threads have primitives.
// CHECK-LABEL: piko.kernel @kernel_items
// CHECK:         gpu.launch
// CHECK:           scf.for %{{.*}} to %{{.*}} step %c32 {
// CHECK:             scf.for %{{.*}} = %c0 to %c8 step %c1
// CHECK:               piko.atomic

// Threads share the iterations of a primitive.
// CHECK-LABEL: piko.kernel @kernel_iterations
// CHECK:         gpu.launch blocks({{.*}} threads(%[[T:[a-z0-9]+]],
// CHECK:           scf.for %{{.*}} to %{{.*}} step %c1 {
// CHECK:             piko.storage.bucket_range
// CHECK:             scf.for %{{.*}} to %{{.*}} step %c1 {
// CHECK:               %[[HAS:.*]] = arith.cmpi slt, %[[T]], %c8
// CHECK-NEXT:          scf.if %[[HAS]]
// CHECK:                 piko.atomic add checked @out[%[[T]] : index]

// The first thread does it all.
// CHECK-LABEL: piko.kernel @kernel_one
// CHECK:         gpu.launch
// CHECK-NOT:       step %c32
// CHECK:           scf.if
// CHECK:             scf.for %{{.*}} = %c0 to %c8 step %c1
// CHECK:               piko.atomic
// CHECK-NOT:       step %c32
// CHECK:         piko.gpu.close_log
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @items
  piko.source @iterations
  piko.source @one
  piko.stage @items bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = arith.constant 8 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.atomic add @out[%i : index] "x", %x : i32
        piko.yield
      }
      piko.return
    }
  }
  piko.stage @iterations bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance lanes iterations
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = arith.constant 8 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.atomic add @out[%i : index] "x", %x : i32
        piko.yield
      }
      piko.return
    }
  }
  piko.stage @one bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance lanes one
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = arith.constant 8 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.atomic add @out[%i : index] "x", %x : i32
        piko.yield
      }
      piko.return
    }
  }
}
