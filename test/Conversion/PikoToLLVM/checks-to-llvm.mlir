// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Checks become calls of the runtime with the place in the text.
// RUN: piko-opt %s --piko-add-checks=numbers=F.z --piko-synthesize --piko-to-machine --piko-to-cpu | FileCheck %s

piko.record @F {"z" : f32 at 0, "i" : i32 at 4} size 8 align 4

// CHECK: llvm.mlir.global internal constant @[[PLACE:piko.text.[0-9]+]]("{{.*}}checks-to-llvm.mlir:[[#@LINE+23]]\00")

// CHECK-LABEL: func.func private @P.kernel_a
// CHECK: %[[AT:.*]] = llvm.mlir.addressof @[[PLACE]] :
// CHECK: llvm.call @pikoir_check_call(
// CHECK: llvm.call @pikoir_check_access({{.*}}, %[[AT]])
// CHECK: llvm.call @pikoir_check_value(
// CHECK: llvm.call @pikoir_check_place(
// CHECK: %[[ID:.*]] = llvm.call @pikoir_check_emit(
// CHECK: llvm.store %[[ID]]
// CHECK-LABEL: func.func @P.setup
// CHECK: llvm.call @pikoir_declare_checked_record(
// CHECK: llvm.call @pikoir_declare_number(
piko.pipeline @P rank 1 {
  piko.buffer @data : @F
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %i = piko.get %f "i" : !piko.prim<@F> -> i32
      piko.store %z, @data[%zero : index] "z" : f32
      piko.emit 0 (%z, %i) : f32, i32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
