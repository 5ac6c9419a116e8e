// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine | FileCheck %s
// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-units | FileCheck %s --check-prefix=UNITS
// RUN: not piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-cpu 2>&1 | FileCheck %s --check-prefix=CPU

// Operations of another dialect go through every pass by what their interfaces
// say of them.

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @Count {"value" : i32 at 0} size 4 align 4

// An assignment that nobody knows is not taken for the same bin: @b is not fused.
// One that says that it keeps the bin is still not the directive that fusion
// believes, but nothing is wrong.
// CHECK-LABEL: piko.pipeline @Assign
// CHECK:         piko.kernel @kernel_a
// CHECK:           %[[E:.*]] = piko.emit 0
// CHECK:           %[[LESS:.*]] = arith.minsi
// CHECK-NEXT:      piko.place %[[E]] of @b in %[[LESS]]
// CHECK-NEXT:      %[[MORE:.*]] = arith.maxsi
// CHECK-NEXT:      piko.place %[[E]] of @b in %[[MORE]]
// CHECK:         piko.kernel @kernel_b
// CHECK:           ^bb0(%[[BIN:.*]]: index):
// CHECK:             %[[P:.*]] = piko.emit 0
// CHECK-NEXT:        piko.place %[[P]] of @c in %[[BIN]]
// CHECK:         piko.kernel @kernel_c
// UNITS-LABEL:  piko.pipeline @Assign
// UNITS-COUNT-2:  piko.storage.append_bin %{{.*}} of @b in
// UNITS:          piko.storage.append_bin %{{.*}} of @c in
piko.pipeline @Assign rank 2 {
  piko.image @image : @F rank 2
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.stage @a bins [8, 8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%x, %y) : i32, i32
      piko.return
    }
  }
  piko.stage @b bins [8, 8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %m = piko.bin_at %x, %y : i32, i32
      %n = piko.bin_at %y, %x : i32, i32
      piko_test.assign_pair %m, %n
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%x, %y) : i32, i32
      piko.return
    }
  }
  piko.stage @c bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko_test.stay
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%y, %x : i32, i32]
      }
      piko.return
    }
  }
}

// A write that nobody knows is a write: the stage is kept, no read is moved past
// it, and the CPU, which has no code for it, says so.
// CHECK-LABEL: piko.pipeline @State
// CHECK:         piko.stage @a {{.*}} writes :
// CHECK:         piko_test.scribble @counts
// CHECK:         piko_test.peek @counts
// CPU: error: failed to legalize operation 'piko_test.scribble'
piko.pipeline @State rank 1 {
  piko.buffer @counts : @Count
  piko.image @image : @Count rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %i = arith.index_cast %x : i32 to index
      piko_test.scribble @counts[%i]
      %n = piko_test.peek @counts[%i]
      piko.update @image[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%n : i32]
      }
      piko.return
    }
  }
}
