// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' --split-input-file | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32},piko-to-grids{without=split-rare}),canonicalize,cse)' --split-input-file | FileCheck %s --check-prefix=PLAIN
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32},piko-form-grids,piko-share-loops,piko-split-rare),canonicalize)' --split-input-file | FileCheck %s --check-prefix=SPLIT
// SPLIT-LABEL: piko.pipeline @Rare
// SPLIT:         gpu.launch
// SPLIT-SAME:      function(@Rare_kernel_start)
// SPLIT:             scf.if
// SPLIT:               piko.storage.append
// SPLIT:             } else {
// SPLIT-NEXT:          piko.gpu.leave_round
// SPLIT:           } {piko.mapping = #piko<lanes iterations>, piko.shared}
// SPLIT:         } {piko.block_buffers, piko.block_counters}
// SPLIT:         gpu.launch
// SPLIT-SAME:      function(@Rare_kernel_start_rest)
// SPLIT:             scf.if
// SPLIT:             } else {
// SPLIT-NEXT:          scf.execute_region no_inline {
// SPLIT:               } {piko.rare}
// SPLIT:           } {piko.mapping = #piko<lanes iterations>, piko.rest, piko.shared}
// SPLIT:         } {piko.block_buffers, piko.block_counters, piko.rest}
// One launch, with the call.
// SPLIT-LABEL: piko.pipeline @Counted
// SPLIT-NOT:     piko.gpu.leave_round
// SPLIT:         {piko.rare}
// SPLIT-NOT:     piko.rest
// SPLIT-LABEL: piko.pipeline @Likely
// SPLIT-NOT:     piko.rare

// PLAIN-LABEL: piko.pipeline @Rare
// PLAIN-NOT:     piko.rare
// PLAIN:         function(@Rare_kernel_start)
// PLAIN-NOT:     function(@Rare_
// PLAIN-NOT:     piko.rare
// PLAIN:         piko.gpu.close_log

// A way that keeps an array is rare. The first launch drops what the threads have
// emitted in a round with such a primitive, and leaves the unit there; the second
// one begins there, and has the way in a region of its own.
// CHECK-LABEL: piko.pipeline @Rare
// CHECK:         gpu.launch
// CHECK-SAME:      function(@Rare_kernel_start)
// CHECK:           %[[BOXES:.*]] = memref.reinterpret_cast %{{.*}} to offset: [%{{.*}}], sizes: [7], strides: [32]
// CHECK:           scf.for
// CHECK:             %[[LEFT:.*]] = memref.load %[[L:.*]][%c0] {nontemporal = true} : memref<1xi32
// CHECK:             arith.cmpi eq, %[[LEFT]], %c0_i32
// CHECK:               piko.storage.append
// CHECK:               memref.store %c1_i32, %[[FOUND:.*]][%c0]
// CHECK:             gpu.barrier
// CHECK:             %[[IS:.*]] = memref.load %[[FOUND]][%c0] {nontemporal = true}
// CHECK:             scf.if
// CHECK:               %[[CURSOR:.*]] = memref.load %[[BOXES]][%c1]
// CHECK:               memref.store %[[CURSOR]], %[[BOXES]][%c0]
// CHECK:               scf.if
// CHECK:                 memref.store %c1_i32, %[[L]][%c0]
// CHECK:                 piko.gpu.leave_rest
// CHECK:             piko.gpu.flush
// CHECK:         gpu.launch
// CHECK-SAME:      function(@Rare_kernel_start_rest)
// CHECK:           %[[REST:.*]] = piko.gpu.rest
// CHECK:           %[[ISLEFT:.*]] = arith.cmpi ne, %[[REST]], %c0
// CHECK:           arith.select %[[ISLEFT]]
// CHECK-NOT:       piko.gpu.leave_rest
// CHECK:           scf.execute_region no_inline
// CHECK:             piko.storage.append
// CHECK:           {piko.rare}
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Rare rank 1 {
  piko.source @start
  piko.edge @start[0] -> @last
  piko.buffer @out : @F
  piko.stage @start bins [0] threads 64 : @F -> [@F] {}
  piko.stage @last bins [0] threads 64 : @F -> [] {}
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start lanes iterations {
      ^bb0(%f: !piko.prim<@F>):
        %array = memref.alloca() : memref<4xi32>
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %zero = arith.constant 0 : i32
        %four = arith.constant 4 : index
        %usual = arith.cmpi sgt, %x, %zero : i32
        scf.if %usual {
          %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        } else {
          %at = arith.index_cast %x : i32 to index
          memref.store %x, %array[%at] : memref<4xi32>
          piko.parallel_for %four {
          ^bb0(%i: index):
            %y = memref.load %array[%i] : memref<4xi32>
            %q = piko.emit 0 (%y) : i32 -> !piko.prim<@F>
            piko.yield
          }
        }
      }
    }
  }
}

// -----

// State that changes on the usual way would change twice: one launch, with a call.
// CHECK-LABEL: piko.pipeline @Counted
// CHECK:         gpu.launch
// CHECK-NOT:     piko.gpu.leave_rest
// CHECK:           scf.execute_region no_inline
// CHECK-NOT:     gpu.launch
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Counted rank 1 {
  piko.source @start
  piko.edge @start[0] -> @last
  piko.buffer @out : @F
  piko.stage @start bins [0] threads 64 : @F -> [@F] {}
  piko.stage @last bins [0] threads 64 : @F -> [] {}
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start {
      ^bb0(%f: !piko.prim<@F>):
        %array = memref.alloca() : memref<4xi32>
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %zero = arith.constant 0 : i32
        %usual = arith.cmpi sgt, %x, %zero : i32
        %at = arith.index_cast %x : i32 to index
        piko.atomic add @out[%at : index] "x", %x : i32
        scf.if %usual {
          %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        } else {
          memref.store %x, %array[%at] : memref<4xi32>
          %y = memref.load %array[%at] : memref<4xi32>
          %q = piko.emit 0 (%y) : i32 -> !piko.prim<@F>
        }
      }
    }
  }
}

// -----

// A way that the text says is usual is not rare, whatever arrays it keeps.
// CHECK-LABEL: piko.pipeline @Likely
// CHECK:         gpu.launch
// CHECK-NOT:     scf.execute_region
// CHECK-NOT:     gpu.launch
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Likely rank 1 {
  piko.source @start
  piko.edge @start[0] -> @last
  piko.buffer @out : @F
  piko.stage @start bins [0] threads 64 : @F -> [@F] {}
  piko.stage @last bins [0] threads 64 : @F -> [] {}
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start {
      ^bb0(%f: !piko.prim<@F>):
        %array = memref.alloca() : memref<4xi32>
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %zero = arith.constant 0 : i32
        %usual = arith.cmpi sgt, %x, %zero : i32
        %at = arith.index_cast %x : i32 to index
        piko.atomic add @out[%at : index] "x", %x : i32
        scf.if %usual {
          %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        } else {
          memref.store %x, %array[%at] : memref<4xi32>
          %y = memref.load %array[%at] : memref<4xi32>
          %q = piko.emit 0 (%y) : i32 -> !piko.prim<@F>
        } {piko.probability = 2.0e-01 : f64}
      }
    }
  }
}

// -----

// A loop whose usual way emits nothing is left, too: rounds are there for that alone.
// CHECK-LABEL: piko.pipeline @Silent
// CHECK:         gpu.launch
// CHECK-SAME:      function(@Silent_kernel_start)
// CHECK:           piko.gpu.leave_rest
// CHECK:           piko.gpu.flush
// CHECK:         gpu.launch
// CHECK-SAME:      function(@Silent_kernel_start_rest)
// CHECK:           {piko.rare}
// SPLIT-LABEL: piko.pipeline @Silent
// SPLIT:         piko.gpu.leave_round
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Silent rank 1 {
  piko.source @start
  piko.edge @start[0] -> @last
  piko.stage @start bins [0] threads 64 : @F -> [@F] {}
  piko.stage @last bins [0] threads 64 : @F -> [] {}
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start {
      ^bb0(%f: !piko.prim<@F>):
        %array = memref.alloca() : memref<4xi32>
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %zero = arith.constant 0 : i32
        %usual = arith.cmpi sgt, %x, %zero : i32
        %at = arith.index_cast %x : i32 to index
        scf.if %usual {
        } else {
          memref.store %x, %array[%at] : memref<4xi32>
          %y = memref.load %array[%at] : memref<4xi32>
          %q = piko.emit 0 (%y) : i32 -> !piko.prim<@F>
        }
      }
    }
  }
}
