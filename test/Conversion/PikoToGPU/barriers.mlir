// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-form-work,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' --split-input-file | FileCheck %s --implicit-check-not=piko.cpu. --implicit-check-not=piko.parallel
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-form-work,piko-map-threads{threads=16},piko-to-grids))' --split-input-file -o /dev/null 2>&1 | FileCheck %s --check-prefix=PIECES
// Iterations that meet at barriers are threads of a block.

piko.record @F {"x" : i32 at 0} size 4 align 4

// A value that lives across a barrier is in a register of its thread.
// CHECK-LABEL: piko.pipeline @Registers
// CHECK:         gpu.launch
// CHECK-SAME:        threads(%[[T:[a-z0-9]+]],
// CHECK:           %[[ACTIVE:.*]] = memref.alloca() : memref<1xi1>
// CHECK:           %[[RUNS:.*]] = arith.cmpi slt, %[[T]], %c24
// CHECK:           memref.store %[[RUNS]], %[[ACTIVE]][%c0]
// CHECK:           %[[VALUE:.*]] = scf.if %{{.*}} -> (i32) {
// CHECK:             piko.atomic
// CHECK:           } else {
// CHECK:           } else {
// CHECK-NEXT:        scf.yield %c0_i32 : i32
// CHECK:           gpu.barrier
// CHECK-NEXT:      %[[IS_ACTIVE:.*]] = memref.load %[[ACTIVE]]
// CHECK-NEXT:      scf.if %[[IS_ACTIVE]] {
// CHECK:             piko.store %[[VALUE]], checked @out
//
// PIECES:      remark: what iterations keep across barriers is in memory: they are not known to be at most 16, the threads of a block
// PIECES-NEXT: piko.parallel_for
piko.pipeline @Registers rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %size = piko.list_size %l : !piko.list<@F>
        %n = arith.constant 24 : index
        %one = arith.constant 1 : i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          %v = piko.atomic add @out[%i : index] "x", %one : i32 -> i32
          piko.sync
          piko.store %v, @out[%i : index] "x" : i32
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// All go the way of iteration 0; those who would not are an error. The sum is
// made in five steps, in the tree of the language.
// CHECK-LABEL: piko.pipeline @Agrees
// CHECK:         gpu.launch
// CHECK-SAME:        threads(%[[T:[a-z0-9]+]],
// CHECK:           scf.for %[[LEVEL:.*]] = %c0 to %c5 step %c1 {
// CHECK:             %[[S:.*]] = arith.shli %c1, %[[LEVEL]]
// CHECK:             %[[WITH:.*]] = arith.addi %[[T]], %[[S]]
// CHECK:             scf.if
// CHECK:               arith.addf
// CHECK:             gpu.barrier
// CHECK:           %[[SUM:.*]] = memref.load %{{.*}}[%c0] : memref<32xf32, #gpu.address_space<workgroup>>
// CHECK:           %[[AGREED:.*]] = memref.load %{{.*}}[%c0] : memref<1xi1, #gpu.address_space<workgroup>>
// CHECK:             piko.fail_barrier
// CHECK:           scf.if %[[AGREED]] {
// CHECK:             gpu.barrier
piko.pipeline @Agrees rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %size = piko.list_size %l : !piko.list<@F>
        %most = arith.constant 32 : index
        %n = arith.minsi %size, %most : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %x = arith.index_cast %i : index to i32
          %f = arith.sitofp %x : i32 to f32
          %sum = piko.reduce %f : f32 {
          ^bb0(%a: f32, %b: f32):
            %c = arith.addf %a, %b : f32
            piko.yield results [%c : f32]
          }
          %here = arith.cmpf ogt, %sum, %f : f32
          scf.if %here {
            piko.sync
          }
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// As many pixels as a bin has, and no more.
// CHECK-LABEL: piko.pipeline @Box
// CHECK-NOT:     memref.view
// PIECES:      remark: what iterations keep across barriers is in memory
// PIECES:      remark: what iterations keep across barriers is in memory
// PIECES-NEXT: piko.parallel_pixels
piko.pipeline @Box rank 1 {
  piko.source @a
  piko.stage @a bins [32] threads 32 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %size = arith.constant 32 : index
        %domain = piko.domain[0]
        %lo = arith.muli %bin, %size : index
        %end = arith.addi %lo, %size : index
        %hi = arith.minsi %end, %domain : index
        %from = arith.index_cast %lo : index to i32
        %to = arith.index_cast %hi : index to i32
        piko.parallel_pixels (%from) to (%to) {
        ^bb0(%x: i32):
          piko.sync
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// Iterations that update a pixel of their own, or of which only one updates, are
// threads.
// CHECK-LABEL: piko.pipeline @OwnPixels
// CHECK:         memref.store %{{.*}}, %{{.*}}[%c0] : memref<1xi1>
// CHECK:         gpu.barrier
// CHECK:         piko.update @image
// CHECK:         piko.update @sums
// PIECES-NOT:  remark
piko.pipeline @OwnPixels rank 1 {
  piko.image @image : @F rank 1
  piko.image @sums : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 8 : index
        %three = arith.constant 3 : index
        %none = arith.constant 0 : i32
        %size = arith.constant 8 : index
        %lo = arith.muli %bin, %size : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.sync
          %at = arith.addi %lo, %i : index
          %x = arith.index_cast %at : index to i32
          piko.update @image[%x : i32] {
          ^bb0(%old: i32):
            piko.yield [%x : i32]
          }
          %is = arith.cmpi eq, %i, %three : index
          scf.if %is {
            piko.update @sums[%none : i32] {
            ^bb0(%old: i32):
              piko.yield [%x : i32]
            }
          }
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// Of one pixel they are made in order, by the thread that has the group.
// CHECK-LABEL: piko.pipeline @OnePixel
// CHECK:         scf.for %{{.*}} to %c8 step %c32 {
// CHECK:           scf.while
// CHECK:               piko.store %{{.*}} checked @image[
piko.pipeline @OnePixel rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 8 : index
        %none = arith.constant 0 : i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.sync
          %x = arith.index_cast %i : index to i32
          piko.update @image[%none : i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%x : i32]
          }
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// Eight bits of its number do not say which iteration it is.
// CHECK-LABEL: piko.pipeline @LowBits
// CHECK:         scf.for %{{.*}} to %c8 step %c32 {
// CHECK:           scf.while
// CHECK:               piko.store %{{.*}} checked @image[
piko.pipeline @LowBits rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 8 : index
        %zero = arith.constant 0 : i8
        %none = arith.constant 0 : i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.sync
          %x = arith.index_cast %i : index to i32
          %low = arith.trunci %x : i32 to i8
          %is = arith.cmpi eq, %low, %zero : i8
          scf.if %is {
            piko.update @image[%none : i32] in %bin {
            ^bb0(%old: i32):
              piko.yield [%x : i32]
            }
          }
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// What one thread does, a remark tells.
// PIECES:      remark: one thread does what iterations do that may update a pixel of another one: an iteration updates pixels in a loop of its own; a parallel loop over all of its pixels would be shared
// PIECES-NEXT: piko.update
// CHECK-LABEL: piko.pipeline @Strokes
// CHECK:         scf.for %{{.*}} = %c0 to %c8 step %c1 {
// CHECK:           scf.for
// CHECK:             piko.store %{{.*}} checked @image[
piko.pipeline @Strokes rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 8 : index
        %zero = arith.constant 0 : index
        %one = arith.constant 1 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.sync
          scf.for %k = %zero to %i step %one {
            %x = arith.index_cast %i : index to i32
            piko.update @image[%k : index] in %bin {
            ^bb0(%old: i32):
              piko.yield [%x : i32]
            }
          }
          piko.yield
        }
      }
    }
  }
}
