// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-count-work))' | FileCheck %s
//
// What is counted becomes calls of the runtime, declared in order.
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-count-work))' | piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu | FileCheck %s --check-prefix=RUNTIME

piko.record @P {"i" : i32 at 0, "x" : f32 at 4} size 8 align 4
piko.record @V {"a" : f32 at 0, "b" : f32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @Count
// CHECK-NEXT: piko.counter 0 calls of "first"
// CHECK-NEXT: piko.counter 1 floats of "first"
// CHECK-NEXT: piko.counter 2 integers of "first"
// CHECK-NEXT: piko.counter 3 trips of "first" inside 0
// CHECK-NEXT: piko.counter 4 reads of "first" to @data
// CHECK-NEXT: piko.counter 5 emissions of "first" port 0
// CHECK-NEXT: piko.counter 6 calls of "second"
// CHECK-NEXT: piko.counter 7 floats of "second"
// CHECK-NEXT: piko.counter 8 integers of "second"
// CHECK-NEXT: piko.counter 9 iterations of "second" inside 6
// CHECK-NEXT: piko.counter 10 updates of "second" to @image
// CHECK-NEXT: piko.counter 11 effects of "second" inside 9
// CHECK-NEXT: piko.counter 12 stores of "second" to @data
// RUNTIME-LABEL: func.func private @Count.kernel_
// RUNTIME: llvm.call @pikoir_count(
// RUNTIME: llvm.call @pikoir_count_element(
// RUNTIME-LABEL: func.func @Count.setup
// RUNTIME-COUNT-13: llvm.call @pikoir_declare_counter(
piko.pipeline @Count rank 1 {
  piko.buffer @data : @V
  piko.image @image : @V rank 1
  piko.source @first
  piko.edge @first[0] -> @second

  // The two fields of an element are two accesses of 4 bytes each; a call of the
  // stage and the arithmetic of a block are counted where they begin.
  // CHECK: piko.stage @first
  // CHECK: piko.process
  // CHECK: piko.count 0 by %c1
  // CHECK-NEXT: %[[N:.*]] = arith.constant 1 : index
  // CHECK-NEXT: piko.count 2 by %[[N]]
  // CHECK: scf.for
  // CHECK-NEXT: %[[TURN:.*]] = arith.constant 1 : index
  // CHECK-NEXT: piko.count 3 by %[[TURN]]
  // CHECK-NEXT: %[[FLOATS:.*]] = arith.constant 2 : index
  // CHECK-NEXT: piko.count 1 by %[[FLOATS]]
  // CHECK-NEXT: piko.count_element 4 @data[%{{.*}} : index] 4 bytes at 0
  // CHECK-NEXT: piko.load @data[%{{.*}} : index] "a"
  // CHECK-NEXT: piko.count_element 4 @data[%{{.*}} : index] 4 bytes at 4
  // CHECK-NEXT: piko.load @data[%{{.*}} : index] "b"
  // CHECK: piko.count 5 by
  // CHECK-NEXT: piko.emit 0
  piko.stage @first bins [0] threads 1 : @P -> [@P] {
    piko.process {
    ^bb0(%p: !piko.prim<@P>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %none = arith.constant 0.0 : f32
      %i = piko.get %p "i" : !piko.prim<@P> -> i32
      %twice = arith.addi %i, %i : i32
      %n = arith.index_cast %twice : i32 to index
      %sum = scf.for %k = %zero to %n step %one iter_args(%s = %none) -> f32 {
        %a = piko.load @data[%k : index] "a" : f32
        %b = piko.load @data[%k : index] "b" : f32
        %ab = arith.mulf %a, %b : f32
        %next = arith.addf %s, %ab : f32
        scf.yield %next : f32
      }
      piko.emit 0 (%i, %sum) : i32, f32
      piko.return
    }
  }

  // CHECK: piko.stage @second
  // CHECK: piko.parallel_for
  // CHECK: piko.count 9 by
  // An update counts with all of its pixel.
  // CHECK-NEXT: piko.count_element 10 @image[%{{.*}} : index] 8 bytes at 0
  // CHECK: piko.count 11 by
  // CHECK-NEXT: piko.update @image
  // CHECK: piko.count_element 12 @data[%{{.*}} : index] 4 bytes at 4
  // CHECK-NEXT: piko.store
  piko.stage @second bins [0] threads 1 : @P -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@P>):
      %zero = arith.constant 0 : index
      %four = arith.constant 4 : index
      %x = piko.get %p "x" : !piko.prim<@P> -> f32
      piko.parallel_for %four {
      ^bb0(%i: index):
        piko.update @image[%i : index] {
        ^bb0(%a: f32, %b: f32):
          piko.yield [%x, %b : f32, f32]
        }
        piko.yield
      }
      piko.store %x, @data[%zero : index] "b" : f32
      piko.return
    }
  }
}

// The iterations of a loop whose condition stands first are those that go on: of the
// branch for its body, not of the test that fails.
// CHECK-LABEL: piko.pipeline @While
// CHECK: piko.counter 3 trips of "a" inside 0
// CHECK: scf.while
// CHECK: scf.if
// CHECK-NEXT: %[[TURN:.*]] = arith.constant 1 : index
// CHECK-NEXT: piko.count 3 by %[[TURN]]
// CHECK: } else {
// CHECK-NEXT: scf.yield
piko.pipeline @While rank 1 {
  piko.buffer @numbers : @P
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@P>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %true = arith.constant true
      %false = arith.constant false
      %n = piko.get %p "i" : !piko.prim<@P> -> i32
      %last = scf.while (%i = %zero) : (i32) -> i32 {
        %less = arith.cmpi slt, %i, %n : i32
        %next, %on = scf.if %less -> (i32, i1) {
          %more = arith.addi %i, %one : i32
          scf.yield %more, %true : i32, i1
        } else {
          scf.yield %i, %false : i32, i1
        }
        scf.condition(%on) %next : i32
      } do {
      ^bb0(%i: i32):
        scf.yield %i : i32
      }
      %at = arith.index_cast %last : i32 to index
      piko.store %last, @numbers[%at : index] "i" : i32
      piko.return
    }
  }
}
