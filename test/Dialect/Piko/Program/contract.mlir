// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s | piko-opt | FileCheck %s

piko.record @Triangle {"v" : i32[3 : 4] at 0, "kind" : i8 at 12} size 16 align 4
piko.record @Index {"value" : i64 at 0} size 8 align 8
piko.record @Vertex {"z" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.buffer @order : @Index
  piko.buffer @vertices : @Vertex per_source 0
  piko.source @draw
  // CHECK: piko.contract source 0 "v" indexes @vertices
  piko.contract source 0 "v" indexes @vertices
  // CHECK: piko.contract source 0 "kind" unsigned below 200
  piko.contract source 0 "kind" unsigned below 200
  // CHECK: piko.contract @order "value" indexes @order
  piko.contract @order "value" indexes @order
  piko.stage @draw bins [0] threads 1 : @Triangle -> [] {
    piko.process {
    ^bb0(%t: !piko.prim<@Triangle>):
      piko.return
    }
  }
}
