// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-form-work,piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' --split-input-file | FileCheck %s
// Threads share the iterations of a loop where each updates a pixel of its own.

piko.record @F {"x" : i32 at 0} size 4 align 4
// What is added to the number of an iteration leaves pixels apart.
// CHECK-LABEL: piko.pipeline @Shifted
// CHECK:         scf.for %{{.*}} = %{{.*}} to %c300 step %c32 {
// CHECK:           piko.update @image
piko.pipeline @Shifted rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 300 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %x = arith.index_cast %i : index to i32
          %low = arith.constant 1 : i32
          %at = arith.addi %x, %low : i32
          piko.update @image[%at : i32] {
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
// Iterations 0 and 256 have the same eight bits: in order, by one thread.
// CHECK-LABEL: piko.pipeline @LowBits
// CHECK:         scf.for %{{.*}} to %c300 step %c32 {
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
        %n = arith.constant 300 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %x = arith.index_cast %i : index to i32
          %low = arith.trunci %x : i32 to i8
          %at = arith.extui %low : i8 to i32
          piko.update @image[%at : i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%x : i32]
          }
          piko.yield
        }
      }
    }
  }
}
