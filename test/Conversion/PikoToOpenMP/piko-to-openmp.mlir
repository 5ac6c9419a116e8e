// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,convert-piko-to-openmp))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// Without a schedule any thread takes the next unit; private arrays take stack
// space once a thread.
// CHECK-LABEL: piko.kernel @kernel_balanced
// CHECK:         %[[COUNT:.*]] = piko.storage.unit_count %[[BINS:.*]] :
// CHECK:         %[[SOME:.*]] = arith.cmpi ne, %[[COUNT]], %{{.*}}
// CHECK:         %[[THREADS:.*]] = piko.cpu.threads
// CHECK:         omp.parallel num_threads(%[[THREADS]] : i32) {
// CHECK-NEXT:      %[[ARRAY:.*]] = memref.alloca() : memref<4xi32>
// CHECK-NEXT:      scf.if %[[SOME]] {
// CHECK-NEXT:        scf.while
// CHECK-NEXT:          %[[NEXT:.*]] = piko.cpu.take_unit %[[BINS]] :
// CHECK-NEXT:          %[[ANY:.*]] = arith.cmpi ult, %[[NEXT]], %[[COUNT]]
// CHECK-NEXT:          scf.condition(%[[ANY]]) %[[NEXT]]
// CHECK:           ^bb0(%[[UNIT:.*]]: index):
// CHECK-NEXT:        piko.cpu.open_writer %{{.*}}[%[[UNIT]]]
// CHECK:             memref.store %{{.*}}, %[[ARRAY]]
// CHECK:             scf.yield
// CHECK:         piko.storage.close_bins

// A thread takes the units that have their home with it. At their end the runtime says
// whom it helps.
// CHECK-LABEL: piko.kernel @kernel_mapped
// CHECK:         %[[COUNT:.*]] = piko.storage.unit_count %[[BINS:.*]] :
// CHECK:         omp.parallel
// CHECK:           %[[THREAD:.*]] = piko.cpu.thread
// CHECK:           scf.while (%[[MORE:.*]] = %true) : (i1) -> (index, i1) {
// CHECK-NEXT:        %[[OWN:.*]] = scf.if %[[MORE]] -> (index) {
// CHECK-NEXT:          %[[TAKEN:.*]] = piko.cpu.take_unit %[[BINS]] of %[[THREAD]] :
// CHECK-NEXT:          scf.yield %[[TAKEN]]
// CHECK:             %[[HAS:.*]] = arith.cmpi ult, %[[OWN]], %[[COUNT]]
// CHECK-NEXT:        %[[NEXT:.*]] = scf.if %[[HAS]] -> (index) {
// CHECK-NEXT:          scf.yield %[[OWN]]
// CHECK-NEXT:        } else {
// CHECK-NEXT:          piko.cpu.next_unit %[[BINS]]
// CHECK:             scf.condition(%{{.*}}) %[[NEXT]], %[[HAS]]
// CHECK:           ^bb0(%[[UNIT:.*]]: index, %[[GOES:.*]]: i1):
// CHECK:             scf.yield %[[GOES]]

// CHECK-LABEL: piko.kernel @kernel_serial
// CHECK-NOT:     omp.
// CHECK:         scf.for

// What no pass has resolved the runtime schedules, unit by unit.
// CHECK-LABEL: piko.kernel @kernel_queued
// CHECK:         omp.parallel
// CHECK:           scf.while
// CHECK-NEXT:        piko.cpu.next_unit
piko.pipeline @P rank 2 {
  piko.source @balanced
  piko.source @mapped
  piko.source @serial
  piko.source @queued
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
    piko.schedule direct_map resolved
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @serial bins [0, 0] threads 1 : @F -> [] {
    piko.schedule serialize resolved
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @queued bins [0, 0] threads 1 : @F -> [] {
    piko.schedule load_balance
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
