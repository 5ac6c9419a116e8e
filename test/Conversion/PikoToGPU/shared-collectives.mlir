// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-form-work,piko-map-threads{threads=16},piko-to-grids),canonicalize,cse)' --split-input-file 2>/dev/null | FileCheck %s
// Where a loop of more iterations than threads is cut, threads share the steps of its
// sorts, scans and reductions: those of one distance are independent.

piko.record @F {"x" : i32 at 0} size 4 align 4
// An element finds its place in the merged run by bisection.
// CHECK-LABEL: piko.pipeline @Sort
// CHECK:         scf.while
// CHECK:           gpu.barrier
// CHECK:           scf.for %{{.*}} = %{{.*}} to %c100 step %c16 {
// CHECK:             scf.while
// CHECK:               arith.shrui
// CHECK:             memref.store
// CHECK:           }
// CHECK-NEXT:      gpu.barrier
piko.pipeline @Sort rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 100 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %key = arith.index_cast %i : index to i32
          %rank = piko.sort %key : i32
          %at = arith.index_cast %rank : index to i32
          piko.store %at, @out[%i : index] "x" : i32
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Distances grow, and for a scan they fall again.
// CHECK-LABEL: piko.pipeline @Scan
// CHECK:         %[[LAST:.*]]:2 = scf.while
// CHECK:           gpu.barrier
// CHECK:           scf.for %{{.*}} step %c16 {
// CHECK:             arith.addi {{.*}} : i32
// CHECK:           gpu.barrier
// CHECK:         scf.while (%{{.*}} = %[[LAST]]#1)
// CHECK:           gpu.barrier
// CHECK:           scf.for %{{.*}} step %c16 {
// CHECK:             arith.addi {{.*}} : i32
// CHECK:           gpu.barrier
// CHECK:           arith.shrui
piko.pipeline @Scan rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 100 : index
        %none = arith.constant 0 : i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          %v = arith.index_cast %i : index to i32
          %before = piko.scan %v empty %none : i32 {
          ^bb0(%x: i32, %y: i32):
            %sum = arith.addi %x, %y : i32
            piko.yield results [%sum : i32]
          }
          piko.store %before, @out[%i : index] "x" : i32
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @Pixel {"n" : f32 at 0} size 4 align 4
// Iterations leave their pixel, threads sort them by it, and run the groups.
// CHECK-LABEL: piko.pipeline @Grouped
// CHECK:         scf.for %{{.*}} step %c16 {
// CHECK:           %[[INSIDE:.*]] = arith.cmpi ult
// CHECK-NEXT:      scf.if %[[INSIDE]] {
// CHECK-NEXT:      } else {
// CHECK-NEXT:        piko.fail @a
// CHECK:           %[[GROUP:.*]] = arith.select %[[INSIDE]], %{{.*}}, %c-1_i64
// CHECK-NEXT:      memref.store %[[GROUP]], %[[GROUPS:.*]][
// CHECK:           piko.gpu.flush
// CHECK:         gpu.barrier
// CHECK:         scf.while
// CHECK:           arith.shrui
// CHECK:         gpu.barrier
// CHECK:         scf.for %[[RANK:.*]] = %{{.*}} to %{{.*}} step %c16 {
// CHECK-NOT:       piko.gpu.flush
// CHECK:           %[[FIRST:.*]] = memref.load %[[RANKS:.*]][%[[RANK]]]
// CHECK-NEXT:      %[[KEY:.*]] = memref.load %[[GROUPS]][%[[FIRST]]]
// CHECK:           arith.cmpi ne, %[[KEY]], %c-1_i64
// CHECK:           scf.if
// CHECK-NEXT:        scf.while (%[[AT:.*]] = %[[RANK]])
// CHECK-NEXT:          memref.load %[[RANKS]][%[[AT]]]
// CHECK:               piko.load checked @image
// CHECK:               piko.store %{{.*}}, checked @image
// CHECK:               arith.cmpi eq, %{{.*}}, %[[KEY]]
// CHECK:               scf.condition
piko.pipeline @Grouped rank 1 {
  piko.image @image : @Pixel rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = piko.list_size %l : !piko.list<@F>
        piko.parallel_for %n {
        ^bb0(%i: index):
          %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          %z = piko.get %f "z" : !piko.prim<@F> -> f32
          piko.update @image[%x : i32] in %bin {
          ^bb0(%old: f32):
            %new = arith.mulf %old, %z : f32
            piko.yield [%new : f32]
          }
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// No group runs once iterations have not agreed on the way to the barrier: what it
// would take was never left.
// CHECK-LABEL: piko.pipeline @Parted
// CHECK:         piko.fail_barrier
// CHECK:         %[[RUNS:.*]] = arith.cmpi ne, %{{.*}}, %c0
// CHECK:         %[[COUNT:.*]] = arith.select %[[RUNS]], %{{.*}}, %c0
// CHECK:         scf.for %{{.*}} to %[[COUNT]] step %c16 {
// CHECK:           piko.store %{{.*}}, checked @image
piko.pipeline @Parted rank 1 {
  piko.image @image : @Pixel rank 1
  piko.source @a
  piko.stage @a bins [0] threads 64 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a lanes iterations {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %n = arith.index_cast %x : i32 to index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %c = arith.constant 16 : index
          %lt = arith.cmpi slt, %i, %c : index
          scf.if %lt {
            piko.sync
            %y = piko.get %f "y" : !piko.prim<@F> -> i32
            %ii = arith.index_cast %i : index to i32
            %q = arith.muli %ii, %y : i32
            piko.update @image[%q : i32] in %bin {
            ^bb0(%old: i32):
              %s = arith.addi %old, %q : i32
              piko.yield [%s : i32]
            }
          }
          piko.yield
        }
      }
    }
  }
}
