// RUN: piko-opt --piko-normalize-loops --cse %s | FileCheck %s

// `x <= last` of branches: the work moves under the condition.
// CHECK-LABEL: func.func @closed
func.func @closed(%lo: i32, %last: i32) {
  %one = arith.constant 1 : i32
  %poison = ub.poison : i32
  // CHECK:      scf.while (%[[X:.*]] = %{{.*}}) : (i32) -> i32 {
  // CHECK-NEXT:   %[[MORE:.*]] = arith.cmpi sle, %[[X]], %{{.*}} : i32
  // CHECK-NEXT:   scf.condition(%[[MORE]]) %[[X]] : i32
  // CHECK-NEXT: } do {
  // CHECK-NEXT: ^bb0(%[[Y:.*]]: i32):
  // CHECK-NEXT:   func.call @work(%[[Y]])
  // CHECK-NEXT:   %[[NEXT:.*]] = arith.addi %[[Y]]
  // CHECK-NEXT:   scf.yield %[[NEXT]]
  %end = scf.while (%x = %lo) : (i32) -> i32 {
    %ends = arith.cmpi sgt, %x, %last : i32
    %more = arith.cmpi sle, %x, %last : i32
    %next = scf.if %ends -> (i32) {
      scf.yield %poison : i32
    } else {
      func.call @work(%x) : (i32) -> ()
      %y = arith.addi %x, %one : i32
      scf.yield %y : i32
    }
    scf.condition(%more) %next : i32
  } do {
  ^bb0(%x: i32):
    scf.yield %x : i32
  }
  return
}

// Two `break`s, the second of which hands on a flag as a number.
// CHECK-LABEL: func.func @breaks
func.func @breaks(%lo: i32, %a: i32, %b: i32) {
  %zero = arith.constant 0 : i32
  %one = arith.constant 1 : i32
  %poison = ub.poison : i32
  // CHECK:      scf.while
  // CHECK-NEXT:   %[[A:.*]] = arith.cmpi slt
  // CHECK-NEXT:   %[[B:.*]] = arith.cmpi sle
  // CHECK-NEXT:   %[[MORE:.*]] = arith.andi %[[A]], %[[B]]
  // CHECK-NEXT:   scf.condition(%[[MORE]])
  // CHECK:        func.call @work
  // CHECK-NOT:    scf.if
  // CHECK:        return
  %end = scf.while (%x = %lo) : (i32) -> i32 {
    %first = arith.cmpi slt, %x, %a : i32
    %both:2 = scf.if %first -> (i32, i32) {
      %ends = arith.cmpi sgt, %x, %b : i32
      %more = arith.cmpi sle, %x, %b : i32
      %flag = arith.extui %more : i1 to i32
      %next = scf.if %ends -> (i32) {
        scf.yield %poison : i32
      } else {
        func.call @work(%x) : (i32) -> ()
        %y = arith.addi %x, %one : i32
        scf.yield %y : i32
      }
      scf.yield %next, %flag : i32, i32
    } else {
      scf.yield %poison, %zero : i32, i32
    }
    %goes = arith.trunci %both#1 : i32 to i1
    scf.condition(%goes) %both#0 : i32
  } do {
  ^bb0(%x: i32):
    scf.yield %x : i32
  }
  return
}

// A guard of two comparisons that ends the work; a condition that is no
// comparison stays as it is.
// CHECK-LABEL: func.func @guards
func.func @guards(%x: i32, %a: i32, %flag: i1) {
  // CHECK:      %[[B:.*]] = arith.cmpi sge
  // CHECK-NEXT: %[[A:.*]] = arith.cmpi slt
  // CHECK-NEXT: %[[BOTH:.*]] = arith.andi
  // CHECK-NEXT: scf.if %[[BOTH]] {
  // CHECK-NEXT:   func.call @work
  %low = arith.cmpi slt, %x, %a : i32
  %high = arith.cmpi sge, %x, %a : i32
  %out = arith.ori %low, %high : i1
  scf.if %out {
  } else {
    func.call @work(%x) : (i32) -> ()
  }
  // CHECK: scf.if %{{.*}} {
  // CHECK-NEXT: } else {
  scf.if %flag {
  } else {
    func.call @work(%x) : (i32) -> ()
  }
  return
}

// What is known only after an effect: nothing moves.
// CHECK-LABEL: func.func @after
func.func @after(%lo: i32) {
  // CHECK:      scf.while
  // CHECK-NEXT:   func.call @work
  // CHECK-NEXT:   %[[MORE:.*]] = func.call @test
  // CHECK-NEXT:   scf.condition(%[[MORE]])
  %end = scf.while (%x = %lo) : (i32) -> i32 {
    func.call @work(%x) : (i32) -> ()
    %more = func.call @test(%x) : (i32) -> i1
    scf.condition(%more) %x : i32
  } do {
  ^bb0(%x: i32):
    scf.yield %x : i32
  }
  return
}

func.func private @work(i32)
func.func private @test(i32) -> i1

// An element of an array is read only under the condition on its index, unless
// the index is constant.
piko.record @F {"i" : i32 at 0, "w" : i32[4 : 4] at 4} size 20 align 4
piko.record @N {"v" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Guarded
piko.pipeline @Guarded rank 1 {
  piko.buffer @out : @N
  piko.source @stage
  piko.stage @stage bins [0] threads 64  : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %three = arith.constant 3 : index
      %false = arith.constant false
      %i = piko.get %f "i" : !piko.prim<@F> -> i32
      %at = arith.index_cast %i : i32 to index
      %inside = arith.cmpi ult, %at, %three : index
      // CHECK: %[[INSIDE:.*]] = arith.cmpi ult
      // CHECK: %[[HIT:.*]] = scf.if %[[INSIDE]] -> (i1) {
      // CHECK:   piko.get %{{.*}} "w"[%{{.*}}]
      // CHECK: scf.if %[[HIT]] {
      %hit = scf.if %inside -> (i1) {
        %w = piko.get %f "w"[%at] : !piko.prim<@F> -> i32
        %more = arith.cmpi sgt, %w, %zero : i32
        scf.yield %more : i1
      } else {
        scf.yield %false : i1
      }
      scf.if %hit {
        piko.store %i, @out[%three : index] "v" : i32
      }
      // CHECK:      piko.get %{{.*}} "w"[%{{.*}}]
      // CHECK-NEXT: %[[MORE:.*]] = arith.cmpi
      // CHECK-NEXT: %[[BOTH:.*]] = arith.andi %[[INSIDE]], %[[MORE]]
      // CHECK-NEXT: scf.if %[[BOTH]] {
      %constant = scf.if %inside -> (i1) {
        %w = piko.get %f "w"[%three] : !piko.prim<@F> -> i32
        %more = arith.cmpi sgt, %w, %zero : i32
        scf.yield %more : i1
      } else {
        scf.yield %false : i1
      }
      scf.if %constant {
        piko.store %i, @out[%three : index] "v" : i32
      }
      piko.return
    }
  }
}

// A switch of a truth value, whatever its cases.
// CHECK-LABEL: func.func @flags
// CHECK-NOT:     scf.index_switch
// CHECK:         %[[A:.*]] = arith.cmpi slt
// CHECK:         arith.select %[[A]], %c1_i32, %c2_i32
// CHECK:         scf.if %[[A]] {
// CHECK-NEXT:      func.call @work(%c1_i32)
// CHECK-NEXT:    } else {
// CHECK-NEXT:      func.call @work(%c2_i32)
// CHECK:         scf.index_switch %{{.*}}
func.func @flags(%x: i32, %y: i32, %z: index) -> i32 {
  %one = arith.constant 1 : i32
  %two = arith.constant 2 : i32
  %less = arith.cmpi slt, %x, %y : i32
  %index = arith.index_castui %less : i1 to index
  %first = scf.index_switch %index -> i32
  case 0 {
    scf.yield %two : i32
  }
  default {
    scf.yield %one : i32
  }
  %number = arith.extui %less : i1 to i32
  %same = arith.index_castui %number : i32 to index
  scf.index_switch %same
  case 1 {
    func.call @work(%one) : (i32) -> ()
    scf.yield
  }
  default {
    func.call @work(%two) : (i32) -> ()
    scf.yield
  }
  scf.index_switch %z
  case 0 {
    func.call @work(%one) : (i32) -> ()
    scf.yield
  }
  default {
  }
  return %first : i32
}
