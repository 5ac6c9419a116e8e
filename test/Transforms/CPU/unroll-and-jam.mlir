// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-unroll-and-jam),canonicalize,cse)' %s 2>%t | FileCheck %s
// RUN: FileCheck %s --check-prefix=REMARK < %t

piko.record @N {"v" : f32 at 0, "w" : f32 at 4} size 8 align 4

piko.pipeline @P rank 1 {
  piko.buffer @a : @N
  piko.buffer @b : @N
  piko.buffer @c : @N
  piko.source @s
  piko.stage @s bins [0] threads 1 : @N -> [] {}

  // Four iterations share the inner loop, which loads and stores an element once. The
  // loop goes on where the last strip of four ended.
  // REMARK: [[@LINE+27]]:5: remark: 4 iterations of this loop share those of the loop inside of it (unroll-and-jam)
  // CHECK-LABEL: piko.kernel @product
  // CHECK-DAG:     %[[N:.*]] = piko.extent @a[0]
  // CHECK-DAG:     %[[M:.*]] = piko.extent @b[0]
  // CHECK:         %[[REST:.*]] = arith.remui %{{.*}}, %c4
  // CHECK:         %[[LAST:.*]] = arith.subi %[[N]], %[[REST]]
  // CHECK:         %[[END:.*]] = arith.select %{{.*}}, %[[LAST]], %c0
  // CHECK:         scf.for %[[K:.*]] = %c0 to %[[END]] step %c4 {
  // CHECK:           piko.load checked @a[%[[K]] : index] "v"
  // CHECK:           %[[K1:.*]] = arith.addi %[[K]], %c1 overflow<nsw>
  // CHECK:           piko.load checked @a[%[[K1]] : index] "v"
  // CHECK:           scf.for %[[J:.*]] = %c0 to %[[M]] step %c1 {
  // CHECK-COUNT-1:     piko.load checked @c[%[[J]] : index] "v"
  // CHECK-COUNT-4:     arith.addf
  // CHECK:             piko.store %{{.*}}, checked @c[%[[J]] : index] "v"
  // CHECK-NOT:         piko.store
  // CHECK:           }
  // CHECK:         }
  // CHECK:         scf.for %{{.*}} = %[[END]] to %[[N]] step %c1 {
  // CHECK:           scf.for
  // CHECK:             piko.store
  piko.kernel @product {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @s : !piko.bins<@N>
    %n = piko.extent @a[0]
    %m = piko.extent @b[0]
    scf.for %k = %c0 to %n step %c1 {
      %a = piko.load checked @a[%k : index] "v" : f32
      scf.for %j = %c0 to %m step %c1 {
        %b = piko.load checked @b[%j : index] "v" : f32
        %ab = arith.mulf %a, %b : f32
        %old = piko.load checked @c[%j : index] "v" : f32
        %new = arith.addf %old, %ab : f32
        piko.store %new, checked @c[%j : index] "v" : f32
      }
    }
  }

  // A field that is read, and the other one of the same element, which is
  // stored in between, stay where they are.
  // REMARK: [[@LINE+10]]:5: remark: 4 iterations of this loop share those of the loop inside of it
  // CHECK-LABEL: piko.kernel @fields
  // CHECK:         scf.for %{{.*}} step %c4 {
  // CHECK:           scf.for
  // CHECK-COUNT-4:     piko.store %{{.*}} "w"
  // CHECK:           }
  piko.kernel @fields {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %n = piko.extent @a[0]
    scf.for %k = %c0 to %n step %c1 {
      scf.for %j = %c0 to %n step %c1 {
        %v = piko.load checked @c[%j : index] "v" : f32
        %w = piko.load checked @c[%j : index] "w" : f32
        %x = arith.addf %v, %w : f32
        piko.store %x, checked @c[%j : index] "v" : f32
        piko.store %v, checked @c[%j : index] "w" : f32
      }
    }
  }

  // The inner loop's end is computed in the outer one, from what does not change.
  // REMARK: [[@LINE+11]]:5: remark: 4 iterations of this loop share those of the loop inside of it
  // CHECK-LABEL: piko.kernel @end
  // CHECK:         scf.for %{{.*}} step %c4 {
  // CHECK:           %[[M:.*]] = arith.addi %{{.*}}, %c7
  // CHECK:           scf.for %[[J:.*]] = %c0 to %[[M]] step %c1 {
  // CHECK:             piko.store %{{.*}}, checked @c[%[[J]] : index] "v"
  piko.kernel @end {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c7 = arith.constant 7 : index
    %n = piko.extent @a[0]
    scf.for %k = %c0 to %n step %c1 {
      %m = arith.addi %n, %c7 : index
      scf.for %j = %c0 to %m step %c1 {
        %a = piko.load checked @a[%k : index] "v" : f32
        %v = piko.load checked @c[%j : index] "v" : f32
        %x = arith.addf %v, %a : f32
        piko.store %x, checked @c[%j : index] "v" : f32
      }
    }
  }

  // The iteration before changes another element.
  // REMARK: [[@LINE+8]]:5: remark: iterations of this loop do not share those of the loop inside of it (unroll-and-jam)
  // REMARK: [[@LINE+11]]:14: note: it may use an element here that another iteration of the inner loop changes
  // CHECK-LABEL: piko.kernel @solves
  // CHECK-NOT:     step %c4
  piko.kernel @solves {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %n = piko.extent @a[0]
    scf.for %k = %c0 to %n step %c1 {
      scf.for %j = %c1 to %n step %c1 {
        %left = arith.subi %j, %c1 : index
        %l = piko.load checked @c[%left : index] "v" : f32
        %v = piko.load checked @c[%j : index] "v" : f32
        %x = arith.addf %v, %l : f32
        piko.store %x, checked @c[%j : index] "v" : f32
      }
    }
  }

  // What is read before the inner loop, that loop changes.
  // REMARK: [[@LINE+6]]:5: remark: iterations of this loop do not share
  // REMARK: [[@LINE+6]]:12: note: it may use an element here
  piko.kernel @reads {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %n = piko.extent @a[0]
    scf.for %k = %c0 to %n step %c1 {
      %a = piko.load checked @c[%k : index] "v" : f32
      scf.for %j = %c0 to %n step %c1 {
        %v = piko.load checked @c[%j : index] "v" : f32
        %x = arith.addf %v, %a : f32
        piko.store %x, checked @c[%j : index] "v" : f32
      }
    }
  }

  // Nothing is said of loops that could gain nothing, or that may fail: elements
  // of the outer iteration's own, a length that differs, an index that is tested, and
  // so few iterations that LLVM unrolls them.
  // REMARK-NOT: remark
  // CHECK-LABEL: piko.kernel @others
  // CHECK-NOT:     step %c4{{ }}
  piko.kernel @others {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %n = piko.extent @a[0]
    %zero = arith.constant 0.0 : f32
    scf.for %k = %c0 to %n step %c1 {
      scf.for %j = %c0 to %n step %c1 {
        %i = arith.addi %k, %j : index
        piko.store %zero, checked @c[%i : index] "v" : f32
      }
    }
    scf.for %k = %c0 to %n step %c1 {
      scf.for %j = %c0 to %k step %c1 {
        piko.store %zero, checked @c[%j : index] "v" : f32
      }
    }
    scf.for %k = %c0 to %n step %c1 {
      scf.for %j = %c0 to %n step %c1 {
        piko.store %zero, @c[%j : index] "v" : f32
      }
    }
    %c4 = arith.constant 4 : index
    scf.for %k = %c0 to %n step %c1 {
      scf.for %j = %c0 to %c4 step %c1 {
        piko.store %zero, checked @c[%j : index] "v" : f32
      }
    }
  }
}
