// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Indices that the host's contracts are about need no test.
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-prove-bounds))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @Triangle {"v" : i32[3 : 4] at 0, "kind" : i8 at 12} size 16 align 4
piko.record @Index {"value" : i16 at 0} size 2 align 2
piko.record @Vertex {"z" : f32 at 0, "next" : i32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @Proved
// expected-remark@+1 {{the indices of 4 of 9 accesses to state are tested}}
piko.pipeline @Proved rank 1 {
  piko.buffer @order : @Index
  piko.buffer @vertices : @Vertex
  piko.buffer @table : @Vertex
  piko.source @draw
  piko.contract source 0 "v" indexes @vertices
  piko.contract source 0 "kind" unsigned indexes @table
  piko.contract @order "value" unsigned indexes @vertices
  piko.contract @vertices "next" indexes @vertices
  piko.stage @draw bins [0] threads 1 : @Triangle -> [] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      %one = arith.constant 1 : index
      %v = piko.get %t "v"[%one] : !piko.prim<@Triangle> -> i32
      // CHECK: piko.load checked @vertices
      %z = piko.load @vertices[%v : i32] "z" : f32
      // What follows it is in the buffer, too; what is behind it may not be.
      // CHECK: piko.load checked @vertices
      %next = piko.load @vertices[%v : i32] "next" : i32
      // CHECK: piko.load checked @vertices
      %there = piko.load @vertices[%next : i32] "z" : f32
      %one32 = arith.constant 1 : i32
      %behind = arith.addi %v, %one32 : i32
      // CHECK: piko.load @vertices
      // expected-remark@+1 {{the index of 'vertices' is tested}}
      %other = piko.load @vertices[%behind : i32] "z" : f32
      // An index of one buffer is none of another.
      // CHECK: piko.load @table
      // expected-remark@+1 {{the index of 'table' is tested}}
      %wrong = piko.load @table[%v : i32] "z" : f32
      // Without a sign a number is one when it is widened so.
      %kind = piko.get %t "kind" : !piko.prim<@Triangle> -> i8
      %wide = arith.extui %kind : i8 to i32
      // CHECK: piko.load checked @table
      %k = piko.load @table[%wide : i32] "z" : f32
      %signed = arith.extsi %kind : i8 to i32
      // CHECK: piko.load @table
      // expected-remark@+1 {{the index of 'table' is tested}}
      %s = piko.load @table[%signed : i32] "z" : f32
      // A read that fails gives 0, at which there may be nothing else to read.
      // expected-remark@+1 {{the index of 'order' is tested}}
      %first = piko.load @order[%behind : i32] "value" : i16
      %index = arith.index_castui %first : i16 to index
      // CHECK: piko.load checked @vertices
      %p = piko.load @vertices[%index : index] "z" : f32
      piko.return
    }
  }
}

// Both sources have to promise it.
// CHECK-LABEL: piko.pipeline @TwoSources
// expected-remark@+1 {{the indices of 1 of 1 accesses to state are tested}}
piko.pipeline @TwoSources rank 1 {
  piko.buffer @vertices : @Vertex
  piko.source @draw
  piko.source @draw
  piko.contract source 0 "v" indexes @vertices
  piko.contract source 0 "kind" below 4
  piko.contract source 1 "kind" below 4
  piko.stage @draw bins [0] threads 1 : @Triangle -> [] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      %zero = arith.constant 0 : index
      %v = piko.get %t "v"[%zero] : !piko.prim<@Triangle> -> i32
      // CHECK: piko.load @vertices
      // expected-remark@+1 {{the index of 'vertices' is tested}}
      %z = piko.load @vertices[%v : i32] "z" : f32
      piko.return
    }
  }
}

// What is emitted is an index only where it has been one.
// CHECK-LABEL: piko.pipeline @Emitted
// expected-remark@+1 {{the indices of 1 of 4 accesses to state are tested}}
piko.pipeline @Emitted rank 1 {
  piko.buffer @order : @Index
  piko.buffer @vertices : @Vertex
  piko.source @pass
  piko.edge @pass[0] -> @pass2
  piko.edge @pass2[0] -> @pass2
  piko.edge @pass2[1] -> @draw
  piko.contract source 0 "v" indexes @vertices
  piko.contract source 0 "kind" indexes @vertices
  piko.contract @vertices "next" indexes @vertices
  piko.stage @pass bins [0] threads 1 : @Triangle -> [@Triangle] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      %zero = arith.constant 0 : index
      %v = piko.get %t "v"[%zero] : !piko.prim<@Triangle> -> i32
      %kind = piko.get %t "kind" : !piko.prim<@Triangle> -> i8
      // CHECK: piko.load checked @vertices
      %n = piko.load @vertices[%v : i32] "next" : i32
      piko.emit 0 (%n, %v, %v, %kind) : i32, i32, i32, i8
      piko.return
    }
  }
  // On a cycle.
  piko.stage @pass2 bins [0] threads 1 : @Triangle -> [@Triangle, @Triangle] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %v = piko.get %t "v"[%zero] : !piko.prim<@Triangle> -> i32
      %w = piko.get %t "v"[%one] : !piko.prim<@Triangle> -> i32
      %none = arith.constant 5 : i8
      // CHECK: piko.load checked @vertices
      %n = piko.load @vertices[%v : i32] "next" : i32
      piko.emit 0 (%w, %n, %v, %none) : i32, i32, i32, i8
      piko.emit 1 (%w, %n, %v, %none) : i32, i32, i32, i8
      piko.return
    }
  }
  piko.stage @draw bins [0] threads 1 : @Triangle -> [] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      %zero = arith.constant 0 : index
      %v = piko.get %t "v"[%zero] : !piko.prim<@Triangle> -> i32
      %kind = piko.get %t "kind" : !piko.prim<@Triangle> -> i8
      // CHECK: piko.load checked @vertices
      %z = piko.load @vertices[%v : i32] "z" : f32
      %wide = arith.extsi %kind : i8 to i32
      // CHECK: piko.load @vertices
      // expected-remark@+1 {{the index of 'vertices' is tested}}
      %k = piko.load @vertices[%wide : i32] "z" : f32
      piko.return
    }
  }
}

// What a loop carries is an index if all that it comes from is one, or the first.
// CHECK-LABEL: piko.pipeline @Carried
// expected-remark@+1 {{the indices of 1 of 4 accesses to state are tested}}
piko.pipeline @Carried rank 1 {
  piko.buffer @vertices : @Vertex
  piko.source @draw
  piko.contract @vertices "next" indexes @vertices
  piko.stage @draw bins [0] threads 1 : @Triangle -> [] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      // CHECK: scf.while
      // CHECK:   piko.load checked @vertices
      // CHECK:   piko.load checked @vertices
      %last = scf.while (%at = %zero) : (i32) -> i32 {
        %z = piko.load @vertices[%at : i32] "z" : f32
        %limit = arith.constant 1.0 : f32
        %more = arith.cmpf olt, %z, %limit : f32
        scf.condition(%more) %at : i32
      } do {
      ^bb0(%at: i32):
        %next = piko.load @vertices[%at : i32] "next" : i32
        scf.yield %next : i32
      }
      // CHECK: piko.load checked @vertices
      %end = piko.load @vertices[%last : i32] "next" : i32
      %less = arith.subi %end, %one : i32
      // CHECK: piko.load @vertices
      // expected-remark@+1 {{the index of 'vertices' is tested}}
      %other = piko.load @vertices[%less : i32] "z" : f32
      piko.return
    }
  }
}
