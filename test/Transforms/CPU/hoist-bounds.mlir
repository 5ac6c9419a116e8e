// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-hoist-bounds))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-hoist-bounds{max-operations=4 max-nest-operations=4}))' %s | FileCheck %s --check-prefix=SHORT

// SHORT-NOT: checked

piko.record @F {"x" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.buffer @a : @N
  piko.buffer @b : @N
  piko.buffer @indices : @F
  piko.source @rows
  piko.source @once
  piko.source @gathers
  piko.source @ranges
  piko.source @wraps

  // for (j = 0; j < n; ++j) b[x + j] = a[j - 1]; both ends of each row of
  // indices are tested, in 64 bits.
  // CHECK:      piko.kernel @kernel_rows
  // CHECK:        %[[X:.*]] = piko.get %{{.*}} "x"
  // CHECK:        %[[N:.*]] = piko.get %{{.*}} "n"
  // CHECK:        %[[END:.*]] = arith.index_cast %[[N]] : i32 to index
  // CHECK:        %[[LOW:.*]] = arith.cmpi sge
  // CHECK:        %[[EXTENT:.*]] = piko.extent @a[0]
  // CHECK:        arith.cmpi sle, %{{.*}}, %[[EXTENT]] : index
  // CHECK:        piko.extent @b[0]
  // CHECK:        scf.if %{{.*}} -> (i32) {
  // CHECK:          scf.while
  // CHECK:            %[[J:.*]] = arith.index_cast %{{.*}} : i32 to index
  // CHECK:            %[[AT:.*]] = arith.addi %{{.*}}, %[[J]] : index
  // CHECK:            piko.load checked @a[%[[AT]] : index]
  // CHECK:            piko.store %{{.*}}, checked @b[%{{.*}} : index]
  // CHECK:        } else {
  // CHECK:          scf.while
  // CHECK:            piko.load @a[%{{.*}} : i32]
  // CHECK:            piko.store %{{.*}}, @b[%{{.*}} : i32]
  piko.stage @rows bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %minus = arith.constant -1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %last = scf.while (%j = %zero) : (i32) -> i32 {
        %more = arith.cmpi slt, %j, %n : i32
        scf.condition(%more) %j : i32
      } do {
      ^bb0(%j: i32):
        %before = arith.addi %j, %minus : i32
        %v = piko.load @a[%before : i32] "v" : f32
        %at = arith.addi %x, %j : i32
        piko.store %v, @b[%at : i32] "v" : f32
        %next = arith.addi %j, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }

  // An index that does not change is tested once, in a loop of any kind.
  // CHECK:      piko.kernel @kernel_once
  // CHECK:        scf.if
  // CHECK:          scf.while
  // CHECK:            piko.load checked @a
  // CHECK:        } else {
  // CHECK:          scf.while
  // CHECK:            piko.load @a
  piko.stage @once bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %limit = arith.constant 4.0 : f32
      %start = arith.constant 0.0 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %last = scf.while (%s = %start) : (f32) -> f32 {
        %v = piko.load @a[%x : i32] "v" : f32
        %t = arith.addf %s, %v : f32
        %more = arith.cmpf olt, %t, %limit : f32
        scf.condition(%more) %t : f32
      } do {
      ^bb0(%s: f32):
        scf.yield %s : f32
      }
      piko.return
    }
  }

  // a[indices[j]]: what is read is not known in front, and the loop stays.
  // CHECK:      piko.kernel @kernel_gathers
  // CHECK-NOT:    checked
  piko.stage @gathers bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %last = scf.while (%j = %zero) : (i32) -> i32 {
        %more = arith.cmpi slt, %j, %n : i32
        scf.condition(%more) %j : i32
      } do {
      ^bb0(%j: i32):
        %i = piko.load @indices[%j : i32] "x" : i32
        %v = piko.load @a[%i : i32] "v" : f32
        %next = arith.addi %j, %one : i32
        scf.yield %next : i32
      }
      // Nor is a count by two in a row.
      %two = arith.constant 2 : i32
      %end = scf.while (%j = %zero) : (i32) -> i32 {
        %more = arith.cmpi slt, %j, %n : i32
        scf.condition(%more) %j : i32
      } do {
      ^bb0(%j: i32):
        %v = piko.load @a[%j : i32] "v" : f32
        %next = arith.addi %j, %two : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }

  // Of a nest the range of each index is computed before it: here of
  // b[n * min(j + k, x)], where products have four corners; sums that it has
  // found to fit do not wrap around.
  // CHECK:      piko.kernel @kernel_ranges
  // CHECK:        %[[X:.*]] = piko.get %{{.*}} "x"
  // CHECK:        %[[N:.*]] = piko.get %{{.*}} "n"
  // CHECK-NOT:    scf.while
  // CHECK:        arith.minsi
  // CHECK:        arith.muli
  // CHECK:        %[[EXTENT:.*]] = piko.extent @b[0]
  // CHECK:        arith.cmpi slt, %{{.*}}, %[[EXTENT]] : index
  // CHECK:        scf.if
  // CHECK:          scf.while
  // CHECK:            scf.while
  // CHECK:              arith.addi %{{.*}}, %{{.*}} overflow<nsw> : i32
  // CHECK:              piko.load checked @b[%{{.*}} : i32]
  // CHECK:        } else {
  // CHECK:          scf.while
  // CHECK:            scf.while
  // CHECK:              arith.addi %{{.*}}, %{{.*}} : i32
  // CHECK:              piko.load @b[%{{.*}} : i32]
  piko.stage @ranges bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %rows = scf.while (%j = %zero) : (i32) -> i32 {
        %more = arith.cmpi slt, %j, %n : i32
        scf.condition(%more) %j : i32
      } do {
      ^bb0(%j: i32):
        %columns = scf.while (%k = %j) : (i32) -> i32 {
          %more = arith.cmpi slt, %k, %n : i32
          scf.condition(%more) %k : i32
        } do {
        ^bb0(%k: i32):
          %sum = arith.addi %j, %k : i32
          %limited = arith.minsi %sum, %x : i32
          %at = arith.muli %n, %limited : i32
          %v = piko.load @b[%at : i32] "v" : f32
          %next = arith.addi %k, %one : i32
          scf.yield %next : i32
        }
        %next = arith.addi %j, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }

  // A remainder is below its divisor, if that is positive and the dividend is
  // not negative; then it needs no test either.
  // CHECK:      piko.kernel @kernel_wraps
  // CHECK:        scf.if
  // CHECK:          scf.while
  // CHECK-NOT:        piko.divide
  // CHECK:            %[[R:.*]] = arith.remsi
  // CHECK:            piko.load checked @a[%[[R]] : i32]
  // CHECK:        } else {
  // CHECK:          scf.while
  // CHECK:            piko.divide remainder_signed
  piko.stage @wraps bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %last = scf.while (%j = %zero) : (i32) -> i32 {
        %more = arith.cmpi slt, %j, %n : i32
        scf.condition(%more) %j : i32
      } do {
      ^bb0(%j: i32):
        %sum = arith.addi %j, %x : i32
        %at = piko.divide remainder_signed %sum, %n : i32
        %v = piko.load @a[%at : i32] "v" : f32
        %next = arith.addi %j, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}
