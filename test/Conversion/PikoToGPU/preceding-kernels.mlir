// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-form-program,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' | FileCheck %s
// RUN: not piko-opt %s --piko-to-units 2>&1 | FileCheck %s --check-prefix=CPU

// A kernel that precedes another one is a launch of that one's, before its
// own: both take the same bins. Its blocks take units in turn, as the counter of
// units is the other launch's.
// CHECK-LABEL: piko.pipeline @Before
// CHECK:         piko.kernel @kernel_a {
// CHECK:           %[[BINS:.*]] = piko.storage.open_bins @a
// CHECK-NOT:       piko.storage.open_bins
// CHECK:           piko.gpu.open_log %[[BINS]]
// CHECK:           gpu.launch
// CHECK-SAME:        function(@Before_first)
// CHECK-NOT:         piko.gpu.take_units
// CHECK:             scf.for %[[ITEMS:.*]] = %{{.*}} to %{{.*}} step %c32
// CHECK:               %[[AT:.*]] = arith.addi %[[ITEMS]], %{{.*}} : index
// CHECK:               %[[PLACE:.*]] = arith.index_cast %[[AT]] : index to i32
// CHECK:               piko.atomic add checked @table[%[[PLACE]]
// CHECK:           gpu.launch
// CHECK-SAME:        function(@Before_second)
// CHECK:           gpu.launch
// CHECK-SAME:        function(@Before_kernel_a)
// CHECK:             piko.gpu.take_units
// CHECK:           piko.gpu.close_log
// CHECK-NOT:       piko.gpu.close_log
// CHECK:           piko.storage.close_bins %[[BINS]]
// CHECK-NOT:     piko.kernel
// CHECK:         piko.program
// CHECK:           piko.launch @kernel_a
// CPU: preceding-kernels.mlir:[[#]]:3: error: 'piko.kernel' op expected work for a CPU: what precedes other work is a GPU's
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Before rank 1 {
  piko.buffer @table : @F
  piko.source @a
  piko.stage @a bins [0] threads 64 split : @F -> [] {
    piko.schedule load_balance
  }
  piko.kernel @first precedes @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %p = piko.position %f : !piko.prim<@F>
        %i = arith.index_cast %p : index to i32
        piko.atomic add @table[%i : i32] "x", %i : i32
      }
    }
  }
  piko.kernel @second precedes @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.atomic min_signed @table[%x : i32] "x", %x : i32
      }
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.atomic max_signed @table[%x : i32] "x", %x : i32
      }
    }
  }
}
