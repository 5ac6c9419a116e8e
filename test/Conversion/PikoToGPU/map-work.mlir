// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' --split-input-file | FileCheck %s --implicit-check-not=piko.cpu.
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=32},piko-form-grids))' --split-input-file | FileCheck %s --check-prefix=GRID
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=32},piko-form-grids,piko-share-loops,piko-map-blocks))' --split-input-file | FileCheck %s --check-prefix=MAPPED
// What a block's threads do where they do not share the pixels of a bin.

piko.record @F {"x" : i32 at 0} size 4 align 4

// Threads share the primitives of a bin; after each round the block takes what
// they have emitted.
// GRID-LABEL: piko.kernel @kernel_copy
// GRID:         %[[BINS:.*]] = piko.storage.open_bins @copy
// GRID:         %[[LOG:.*]] = piko.gpu.open_log %[[BINS]]
// GRID:         gpu.launch blocks(%[[UNIT:[a-z0-9]+]],
// GRID-SAME:        function(@Emits_kernel_copy)
// GRID-SAME:        workgroup(%[[WORDS:[a-z0-9]*]] : memref<33xi64,
// GRID:           piko.gpu.append_buffers %[[LOG]] in %{{.*}} : memref<7xi64> using %[[WORDS]]
// GRID:           piko.storage.unit_buckets %[[BINS]][%[[UNIT]]]
// GRID:           scf.for %[[BUCKET:.*]] =
// GRID:             piko.storage.bucket_range %[[BINS]][%[[UNIT]], %[[BUCKET]]]
// GRID:             scf.for
// GRID:               piko.storage.append %[[LOG]][0]
// GRID:             } {{.*}}piko.threads = #piko<threads shared>
// GRID:         piko.gpu.close_log %[[LOG]]
// Without a loop over units yet.
// MAPPED-LABEL: piko.kernel @kernel_copy
// MAPPED:         gpu.launch
// MAPPED-NOT:       piko.storage.unit_count
// MAPPED:           piko.gpu.flush
// MAPPED-NOT:       piko.gpu.flush
// MAPPED:         } {piko.threaded}
// CHECK-LABEL: piko.kernel @kernel_copy
// CHECK:         %[[LOG:.*]] = piko.gpu.open_log
// CHECK:         gpu.launch blocks(%[[UNIT:[a-z0-9]+]], {{.*}}threads(%[[T:[a-z0-9]+]],
// CHECK-SAME:        workgroup(%[[CELLS:[a-z0-9]*]] : memref<33xi64, #gpu.address_space<workgroup>>
// CHECK:           %[[BOX:.*]] = memref.alloca() : memref<7xi64>
// CHECK-COUNT-6:   memref.store %c0_i64, %[[BOX]]
// CHECK:           piko.gpu.append_buffers %[[LOG]] in %[[BOX]]
// CHECK:           %[[BEGIN:.*]], %[[END:.*]] = piko.storage.bucket_range
// CHECK:           gpu.barrier
// CHECK:           scf.for %[[ROUND:.*]] = %[[BEGIN]] to %[[END]] step %c32 {
// CHECK:             %[[I:.*]] = arith.addi %[[ROUND]], %[[T]]
// CHECK:             %[[HAS:.*]] = arith.cmpi slt, %[[I]], %[[END]]
// CHECK:             scf.if %[[HAS]] {
// CHECK:               piko.storage.append %[[LOG]][0]
// CHECK:               piko.storage.next %[[LOG]]
// CHECK:             }
// CHECK-NEXT:        piko.gpu.flush %[[LOG]][%{{.*}}] using %[[CELLS]]
// CHECK:           gpu.barrier
// CHECK:           piko.gpu.flush %[[LOG]][%{{.*}}] using %[[CELLS]]
// CHECK:         piko.gpu.close_log %[[LOG]]
piko.pipeline @Emits rank 1 {
  piko.source @copy
  piko.edge @copy[0] -> @last
  piko.stage @copy bins [8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @last bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// What the first thread finds goes through shared memory to the loop that
// all share, and their array is there, too.
// CHECK-LABEL: piko.kernel @kernel_sum
// CHECK:         gpu.launch
// CHECK-SAME:        threads(%[[T:[a-z0-9]+]],
// CHECK-SAME:        workgroup({{.*}}, %[[CELL:.*]] : memref<1xi32, #gpu.address_space<workgroup>>, %[[ARRAY:.*]] : memref<16xi32, #gpu.address_space<workgroup>>
// CHECK:           %[[IS_FIRST:.*]] = arith.cmpi eq, %[[T]], %c0
// CHECK:           piko.storage.unit_buckets
// CHECK:           gpu.barrier
// CHECK:           scf.if %[[IS_FIRST]] {
// CHECK:             %[[OLD:.*]] = scf.if %{{.*}} -> (i32) {
// CHECK-NEXT:          piko.atomic
// CHECK:             memref.store %[[OLD]], %[[CELL]][%c0]
// CHECK:           }
// CHECK-NEXT:      gpu.barrier
// CHECK-NEXT:      %[[SEEN:.*]] = memref.load %[[CELL]][%c0]
// CHECK-NEXT:      gpu.barrier
// CHECK-NEXT:      scf.for %{{.*}} = %[[T]] to %{{.*}} step %c32 {
// CHECK:             memref.store %[[SEEN]], %[[ARRAY]]
// CHECK:           gpu.barrier
// CHECK:           %[[LAST:.*]] = memref.load %[[ARRAY]][%c3]
// CHECK:           gpu.barrier
// CHECK:           scf.if %[[IS_FIRST]] {
// CHECK:             piko.store %[[LAST]]
piko.pipeline @Passes rank 1 {
  piko.buffer @out : @F
  piko.source @sum
  piko.stage @sum bins [0] threads 64 : list @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %three = arith.constant 3 : index
      %one = arith.constant 1 : i32
      %array = memref.alloca() : memref<16xi32>
      %old = piko.atomic add @out[%zero : index] "x", %one : i32 -> i32
      %n = arith.constant 16 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        memref.store %old, %array[%i] : memref<16xi32>
        piko.yield
      }
      %last = memref.load %array[%three] : memref<16xi32>
      piko.store %last, @out[%zero : index] "x" : i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// A loop that was cut at a barrier: its numbers are in memory of the block, which
// is taken once and kept; what it emits is in the order of iterations.
// CHECK-LABEL: piko.kernel @kernel_cut
// CHECK:         gpu.launch
// CHECK:           piko.gpu.allocate
// CHECK:           gpu.barrier
// CHECK:           %[[BYTES:.*]] = piko.gpu.bytes_at
// CHECK:           scf.if
// CHECK:             %[[SLOTS:.*]] = memref.view %[[BYTES]]
// CHECK:             gpu.barrier
// CHECK:             scf.for %[[I:.*]] = %{{.*}} step %c32
// CHECK:               memref.store %{{.*}}, %[[SLOTS]][%[[I]]]
// CHECK:             gpu.barrier
// CHECK:             scf.for %[[ROUND:.*]] = %{{.*}} to %{{.*}} step %c32
// CHECK:               %[[J:.*]] = arith.addi %[[ROUND]]
// CHECK:               memref.load %[[SLOTS]][%[[J]]]
// CHECK:               piko.storage.append
// CHECK:               piko.gpu.flush
// CHECK:             gpu.barrier
// CHECK-NOT:       piko.cpu.scratch
piko.pipeline @Cuts rank 1 {
  piko.source @cut
  piko.edge @cut[0] -> @last
  piko.stage @cut bins [0] threads 64 : list @F -> [@F] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %n = piko.list_size %l : !piko.list<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %square = arith.muli %x, %x : i32
        %cube = arith.muli %square, %x : i32
        %y = arith.xori %cube, %x : i32
        piko.sync
        piko.emit 0 (%y) : i32
        piko.yield
      }
      piko.return
    }
  }
  piko.stage @last bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// Iterations that each have a pixel are shared; those that may have the same one
// are grouped by it.
// CHECK-LABEL: piko.kernel @kernel_paint
// CHECK:         scf.for %{{.*}} = %{{.*}} to %{{.*}} step %c32
// CHECK:           piko.store %{{.*}} checked @image[
// CHECK:         gpu.barrier
// CHECK:         scf.for %{{.*}} = %{{.*}} to %{{.*}} step %c32
// CHECK:           scf.while
// CHECK:             piko.store %{{.*}} checked @image[
piko.pipeline @Pixels rank 2 {
  piko.image @image : @F rank 2
  piko.source @paint
  piko.stage @paint bins [0, 0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %w = piko.domain[0]
      %h = piko.domain[1]
      %n = arith.muli %w, %h : index
      %one = arith.constant 1 : i32
      %two = arith.constant 2 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        %x = arith.remui %i, %w : index
        %y = arith.divui %i, %w : index
        piko.update @image[%x, %y : index, index] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %one : i32
          piko.yield [%new : i32]
        }
        piko.yield
      }
      piko.parallel_for %n {
      ^bb0(%i: index):
        %x = arith.remui %i, %w : index
        %y = arith.divui %i, %two : index
        piko.update @image[%x, %y : index, index] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %old : i32
          piko.yield [%new : i32]
        }
        piko.yield
      }
      piko.return
    }
  }
}

// -----

// What primitives do in order, and emit in, is the first thread's: 32 of them, after
// which the block takes what they have emitted, so that no join has to follow all of it
// by one thread.
// CHECK-LABEL: piko.kernel @kernel_test
// CHECK:         %[[LOG:.*]] = piko.gpu.open_log
// CHECK:         gpu.launch blocks({{.*}}threads(%[[T:[a-z0-9]+]],
// CHECK:           %[[FIRST:.*]] = arith.cmpi eq, %[[T]], %c0 : index
// CHECK:           %[[BEGIN:.*]], %[[END:.*]] = piko.storage.bucket_range
// CHECK-NEXT:      scf.for %[[ROUND:.*]] = %[[BEGIN]] to %[[END]] step %c32 {
// CHECK-NEXT:        %[[NEXT:.*]] = arith.addi %[[ROUND]], %c32
// CHECK-NEXT:        %[[STOP:.*]] = arith.minsi %[[NEXT]], %[[END]]
// CHECK-NEXT:        scf.if %[[FIRST]] {
// CHECK-NEXT:          scf.for %{{.*}} = %[[ROUND]] to %[[STOP]] step %c1 {
// CHECK:                 piko.storage.append %[[LOG]][0]
// CHECK-NEXT:            piko.storage.next %[[LOG]]
// CHECK-NEXT:          }
// CHECK-NEXT:        }
// CHECK:             piko.gpu.flush %[[LOG]]
// CHECK-NEXT:      }
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Ordered rank 1 {
  piko.image @image : @F rank 1
  piko.source @test
  piko.edge @test[0] -> @last
  piko.stage @test bins [8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %before = piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        %sum = arith.addi %old, %x : i32
        piko.yield [%sum : i32] results [%old : i32]
      } -> i32
      piko.emit 0 (%before) : i32
      piko.return
    }
  }
  piko.stage @last bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
