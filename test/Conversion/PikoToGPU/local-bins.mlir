// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' | FileCheck %s --implicit-check-not=piko.cpu.
// What a stage emits into its own bin is read there, after a flush: in batches of
// three, by the first thread of each; then the block forgets it.

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.kernel @kernel_start
// CHECK:         %[[LOG:.*]] = piko.gpu.open_log
// CHECK:         gpu.launch {{.*}}threads(%[[T:[a-z0-9]+]],
// CHECK-SAME:        workgroup(%[[CELLS:.*]] : memref<33xi64, {{.*}}>, %[[KEPT:.*]] : memref<4xi64, #gpu.address_space<workgroup>>
// CHECK:           %[[BOXES:.*]] = memref.alloca() : memref<14xi64>
// CHECK-COUNT-4:   memref.store %c0_i64, %[[KEPT]]
// CHECK:           piko.gpu.append_buffers %[[LOG]] in %[[BOXES]] : memref<14xi64> using %[[CELLS]]{{.*}} local [@start] [0] in %[[KEPT]]
// CHECK:           %[[OTHER:.*]] = piko.gpu.log_of %[[LOG]] of @last
// CHECK:             piko.storage.append %[[LOG]][0]
// CHECK:             piko.storage.append_bin %[[LOG]][0] of @last
// CHECK:           piko.gpu.flush %[[LOG]][%{{.*}}] using %[[CELLS]]
// CHECK:           piko.storage.local_bin @last from %[[LOG]][0] writer %[[OTHER]] {
// CHECK-NEXT:      ^bb0(%[[BINS:.*]]: !piko.bins<@F>):
// CHECK-NEXT:        %[[WORD:.*]] = memref.load %[[KEPT]][%c1]
// CHECK-NEXT:        %[[COUNT:.*]] = arith.index_cast %[[WORD]]
// CHECK-NEXT:        %[[CALLS:.*]] = arith.ceildivui %[[COUNT]], %c3
// CHECK:             scf.for %[[CALL:.*]] = %c0 to %[[CALLS]] step %c1 {
// CHECK:               %[[BEGIN:.*]] = arith.muli %[[CALL]], %c3
// CHECK:               piko.storage.item %[[BINS]][%[[BEGIN]]]
// CHECK:           gpu.barrier
// CHECK:           scf.if
// CHECK-NEXT:        memref.store %c0_i64, %[[KEPT]][%c1]
// CHECK:           gpu.barrier
piko.pipeline @Local rank 1 {
  piko.buffer @out : @F
  piko.source @start
  piko.edge @start[0] -> @last local
  piko.stage @start bins [8] threads 64 : @F -> [@F] {}
  piko.stage @last bins [8] threads 64 placed : list @F -> [] {
    piko.schedule load_balance end_bin batch 3
  }
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        piko.place %p of @last in %bin : !piko.prim<@F>
      }
      piko.lists of @last from @start[0] {
      ^bb0(%l: !piko.list<@F>):
        %zero = arith.constant 0 : index
        %g = piko.list_at checked %l[%zero] : !piko.list<@F> -> !piko.prim<@F>
        %y = piko.get %g "x" : !piko.prim<@F> -> i32
        piko.store %y, @out[%bin : index] "x" : i32
      }
    }
  }
}
