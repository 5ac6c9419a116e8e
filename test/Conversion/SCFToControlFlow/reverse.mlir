// RUN: piko-opt %s --allow-unregistered-dialect --convert-scf-to-cf-in-reverse --split-input-file --verify-diagnostics | FileCheck %s

// Conditions of one block, of which one holds a loop and a condition.
// CHECK-LABEL: func.func @block(
// CHECK-SAME: %[[A:.*]]: i1, %[[B:.*]]: i1, %[[N:.*]]: index)
func.func @block(%a: i1, %b: i1, %n: index) -> i32 {
  %zero = arith.constant 0 : index
  %one = arith.constant 1 : index
  // CHECK: cf.cond_br %[[A]], ^bb1, ^bb8
  scf.if %a {
    // CHECK: ^bb1:
    // CHECK-NEXT: cf.br ^bb2
    // CHECK: ^bb2(%[[I:.*]]: index):
    // CHECK-NEXT: %[[MORE:.*]] = arith.cmpi slt, %[[I]], %[[N]]
    // CHECK-NEXT: cf.cond_br %[[MORE]], ^bb3, ^bb7
    scf.for %i = %zero to %n step %one {
      // CHECK: ^bb3:
      // CHECK: cf.cond_br %[[B]], ^bb4, ^bb5
      scf.if %b {
        // CHECK: ^bb4:
        // CHECK-NEXT: "test.inner"
        // CHECK-NEXT: cf.br ^bb6
        "test.inner"(%i) : (index) -> ()
      } else {
        // CHECK: ^bb5:
        // CHECK-NEXT: "test.other"
        // CHECK-NEXT: cf.br ^bb6
        "test.other"(%i) : (index) -> ()
      }
      // CHECK: ^bb6:
      // CHECK: cf.br ^bb2
    }
    // CHECK: ^bb7:
    // CHECK-NEXT: cf.br ^bb8
  }
  // CHECK: ^bb8:
  // CHECK-NEXT: "test.between"
  // CHECK-NEXT: cf.cond_br %[[B]], ^bb9, ^bb10
  "test.between"() : () -> ()
  %r = scf.if %b -> i32 {
    // CHECK: ^bb9:
    // CHECK-NEXT: %[[X:.*]] = "test.first"
    // CHECK-NEXT: cf.br ^bb11(%[[X]] : i32)
    %x = "test.first"() : () -> i32
    scf.yield %x : i32
  } else {
    // CHECK: ^bb10:
    // CHECK-NEXT: %[[Y:.*]] = "test.second"
    // CHECK-NEXT: cf.br ^bb11(%[[Y]] : i32)
    %y = "test.second"() : () -> i32
    scf.yield %y : i32
  }
  // CHECK: ^bb11(%[[R:.*]]: i32):
  // CHECK-NEXT: cf.br ^bb12
  // CHECK: ^bb12:
  // CHECK-NEXT: return %[[R]]
  return %r : i32
}

// -----

// What becomes loops of another kind, in turn, and nested in a gpu.module.
gpu.module @module {
  // CHECK-LABEL: func.func @kinds(
  // CHECK-NOT: scf.
  // CHECK: return
  func.func @kinds(%n: index, %m: memref<?xindex>) {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    scf.parallel (%i, %j) = (%zero, %zero) to (%n, %n) step (%one, %one) {
      %last = scf.while (%k = %i) : (index) -> index {
        %more = arith.cmpi slt, %k, %n : index
        scf.condition(%more) %k : index
      } do {
      ^bb0(%k: index):
        %next = arith.addi %k, %one : index
        scf.yield %next : index
      }
      scf.index_switch %last
      case 1 {
        memref.store %j, %m[%i] : memref<?xindex>
        scf.yield
      }
      default {
        scf.execute_region {
          memref.store %i, %m[%j] : memref<?xindex>
          scf.yield
        }
      }
      scf.reduce
    }
    scf.forall (%i) in (%n) {
      memref.store %n, %m[%i] : memref<?xindex>
    }
    return
  }
}

// -----

func.func @tensors(%n: index, %t: tensor<8xindex>) -> tensor<8xindex> {
  // expected-error@+1 {{'scf.forall' op has no form of branches}}
  %r = scf.forall (%i) in (8) shared_outs(%o = %t) -> tensor<8xindex> {
    scf.forall.in_parallel {
    }
  }
  return %r : tensor<8xindex>
}
