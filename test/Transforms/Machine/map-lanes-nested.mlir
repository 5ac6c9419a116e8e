// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-map-lanes))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-map-lanes))' -mlir-print-op-on-diagnostic=false %s -o /dev/null 2>&1 | FileCheck %s --check-prefix=REMARK

piko.record @F {"x" : i32 at 0} size 4 align 4

// A condition around the loop is no iteration for some primitives; a loop around
// it would have to be counted, too. Loops inside an iteration make it longer.
// CHECK-LABEL: piko.pipeline @Nested
// CHECK: piko.items of @a lanes items {
// CHECK: piko.items of @b lanes iterations {
// REMARK: remark: stage 'a': lanes are given items
// REMARK: note: iterations of this parallel loop: about 5, at most about 16; operations of each: 1, around the loop: 4
// REMARK: note: not collapsed: {{[0-9.]+}} times the operations
// REMARK: remark: stage 'b': lanes are given iterations
// REMARK: note: iterations of this parallel loop: about 16, at most about 64; operations of each: 18, around the loop: 2
// REMARK: note: not collapsed: the parallel loop is inside 'scf.for'
piko.pipeline @Nested rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.source @b
  piko.stage @a bins [16] threads 1 : @F -> [] {}
  piko.stage @b bins [16] threads 1 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %zero = arith.constant 0 : i32
        %some = arith.cmpi sgt, %x, %zero : i32
        %y = arith.addi %x, %x : i32
        %i = arith.index_cast %y : i32 to index
        scf.if %some {
          scf.index_switch %i
          case 1 {
            scf.yield
          }
          default {
            piko.parallel_pixels (%x) to (%y) {
            ^bb0(%px: i32):
              piko.store %px, @out[%px : i32] "x" : i32
              piko.yield
            }
          }
        }
      }
    }
  }
  piko.kernel @kernel_b {
    piko.bins of @b {
    ^bb0(%bin: index):
      piko.items of @b {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %n = arith.index_cast %x : i32 to index
        %zero = arith.constant 0 : index
        %one = arith.constant 1 : index
        scf.for %j = %zero to %n step %one {
          piko.parallel_for %n {
          ^bb0(%i: index):
            %k = arith.addi %i, %j : index
            %l = arith.index_cast %k : index to i32
            scf.for %m = %zero to %n step %one {
              %o = arith.addi %k, %m : index
              piko.store %l, @out[%o : index] "x" : i32
            }
            piko.yield
          }
        }
      }
    }
  }
}
