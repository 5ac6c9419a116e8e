// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,convert-piko-to-openmp))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// A dynamic schedule balances load; private arrays take stack space once a
// thread.
// CHECK-LABEL: piko.kernel @kernel_balanced
// CHECK:         %[[THREADS:.*]] = piko.cpu.threads
// CHECK:         omp.parallel num_threads(%[[THREADS]] : i32) {
// CHECK-NEXT:      %[[ARRAY:.*]] = memref.alloca() : memref<4xi32>
// CHECK-NEXT:      omp.wsloop schedule(dynamic) {
// CHECK-NEXT:        omp.loop_nest (%[[UNIT:.*]]) : index =
// CHECK:               piko.cpu.open_writer %{{.*}}[%[[UNIT]]]
// CHECK:               memref.store %{{.*}}, %[[ARRAY]]
// CHECK:               omp.yield
// CHECK:         piko.cpu.close_bins

// CHECK-LABEL: piko.kernel @kernel_mapped
// CHECK:         omp.wsloop schedule(static)

// CHECK-LABEL: piko.kernel @kernel_serial
// CHECK-NOT:     omp.
// CHECK:         scf.for
piko.pipeline @P rank 2 {
  piko.source @balanced
  piko.source @mapped
  piko.source @serial
  piko.stage @balanced bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %array = memref.alloca() : memref<4xi32>
      %zero = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      memref.store %x, %array[%zero] : memref<4xi32>
      piko.return
    }
  }
  piko.stage @mapped bins [0, 0] threads 1 : @F -> [] {
    piko.schedule direct_map
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @serial bins [0, 0] threads 1 : @F -> [] {
    piko.schedule serialize
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
