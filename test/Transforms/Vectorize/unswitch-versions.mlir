// RUN: piko-opt --piko-unswitch-versions %s | FileCheck %s
// RUN: piko-opt --piko-unswitch-versions --canonicalize %s | FileCheck %s --check-prefix=CLEAN

piko.record @F {"x" : i32 at 0} size 4 align 4

// The scalar version has two inner loops in two versions each: one body has these
// choices, and one, for units in which neither runs by vectors, has no choice left.
// CHECK-LABEL: piko.kernel @two_loops
// CHECK:         %[[OUTER:.*]] = piko.cpu.takes_vectors {{.*}}loop = "outside"
// CHECK:         %[[A:.*]] = piko.cpu.takes_vectors {{.*}}loop = "first"
// CHECK:         %[[B:.*]] = piko.cpu.takes_vectors {{.*}}loop = "second"
// CHECK:         scf.if %[[OUTER]] {
// CHECK:         } else {
// CHECK:           %[[ANY:.*]] = arith.ori %[[A]], %[[B]]
// CHECK:           scf.if %[[ANY]] {
// CHECK:             scf.if %[[A]]
// CHECK:             scf.if %[[B]]
// CHECK:           } else {
// CHECK:             scf.if %false
// CHECK:             scf.if %false
// CHECK:           } {piko.versions}
// CHECK:         } {piko.versions}

// CLEAN-LABEL: piko.kernel @two_loops
// CLEAN:         scf.if
// CLEAN:         } else {
// CLEAN:           scf.if
// CLEAN:           } else {
// CLEAN-NEXT:        scf.for
// CLEAN-NEXT:          piko.store %c3_i32
// CLEAN-NEXT:          piko.store %c5_i32
// CLEAN-NEXT:        }
// CLEAN-NEXT:      } {piko.versions}
// CLEAN-NEXT:    } {piko.versions}

// A scalar version in which nothing is to be chosen is left as it is, and so is a
// choice between other things than versions of a loop over primitives.
// CHECK-LABEL: piko.kernel @left
// CHECK:         scf.if %{{.*}} {
// CHECK-NEXT:      piko.store
// CHECK-NEXT:    } else {
// CHECK-NEXT:      piko.store
// CHECK-NEXT:    } {piko.versions}
// CHECK-NEXT:    scf.if %{{.*}} {
// CHECK-NEXT:      piko.store
// CHECK-NEXT:    } else {
// CHECK-NEXT:      %{{.*}} = arith.select
// CHECK-NEXT:      piko.store
// CHECK-NEXT:    }{{$}}
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @two_loops {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %i1 = arith.constant 1 : i32
    %i2 = arith.constant 2 : i32
    %i3 = arith.constant 3 : i32
    %i5 = arith.constant 5 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %count = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %outer = piko.cpu.takes_vectors %w {expected, loop = "outside", number = 0, scalar = 10, vectors = 20}
    %a = piko.cpu.takes_vectors %w {loop = "first", number = 1, scalar = 30, vectors = 40, within = 0}
    %b = piko.cpu.takes_vectors %w {loop = "second", number = 2, scalar = 30, vectors = 40, within = 0}
    scf.if %outer {
      piko.store %i1, @out[%c0 : index] "x" : i32
    } else {
      scf.for %i = %c0 to %count step %c1 {
        %x = scf.if %a -> i32 {
          scf.yield %i2 : i32
        } else {
          scf.yield %i3 : i32
        }
        piko.store %x, @out[%i : index] "x" : i32
        %y = scf.if %b -> i32 {
          scf.yield %i2 : i32
        } else {
          scf.yield %i5 : i32
        }
        piko.store %y, @out[%i : index] "x" : i32
      }
    } {piko.versions}
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @left {
    %c0 = arith.constant 0 : index
    %i1 = arith.constant 1 : i32
    %i2 = arith.constant 2 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %outer = piko.cpu.takes_vectors %w {expected, loop = "outside", number = 0, scalar = 10, vectors = 20}
    %a = piko.cpu.takes_vectors %w {loop = "inside", number = 1, scalar = 30, vectors = 40}
    scf.if %outer {
      piko.store %i1, @out[%c0 : index] "x" : i32
    } else {
      piko.store %i2, @out[%c0 : index] "x" : i32
    } {piko.versions}
    scf.if %outer {
      piko.store %i1, @out[%c0 : index] "x" : i32
    } else {
      %x = arith.select %a, %i1, %i2 : i32
      piko.store %x, @out[%c0 : index] "x" : i32
    }
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
