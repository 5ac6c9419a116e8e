// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=4 %s | FileCheck %s
// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=4 --piko-cpu-to-llvm %s | piko-translate --mlir-to-llvmir | FileCheck %s --check-prefix=IR
// LLVM is told what accesses touch, so that a store to a buffer is none to
// another field, to another buffer, to primitives or to what the runtime holds.

piko.record @F {"x" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @C {"scale" : f32 at 0} size 4 align 4

// CHECK-DAG: #[[ROOT:.*]] = #llvm.tbaa_root<id = "piko">
// CHECK-DAG: #[[OUT_X:.*]] = #llvm.tbaa_type_desc<id = "state out.x", members = {<#[[ROOT]], 0>}>
// CHECK-DAG: #[[OUT_V:.*]] = #llvm.tbaa_type_desc<id = "state out.v", members = {<#[[ROOT]], 0>}>
// CHECK-DAG: #[[SCALE:.*]] = #llvm.tbaa_type_desc<id = "state camera.scale", members = {<#[[ROOT]], 0>}>
// CHECK-DAG: #[[FAILURE:.*]] = #llvm.tbaa_type_desc<id = "failure", members = {<#[[ROOT]], 0>}>
// CHECK-DAG: #[[RUNTIME:.*]] = #llvm.tbaa_type_desc<id = "runtime", members = {<#[[ROOT]], 0>}>
// CHECK-DAG: #[[PRIM_X:.*]] = #llvm.tbaa_type_desc<id = "primitive F.x", members = {<#[[RUNTIME]], 0>}>
// CHECK-DAG: #[[EMITTED_X:.*]] = #llvm.tbaa_type_desc<id = "primitive F.b.x", members = {<#[[RUNTIME]], 0>}>
// CHECK-DAG: #[[OUT_X_TAG:.*]] = #llvm.tbaa_tag<base_type = #[[OUT_X]], access_type = #[[OUT_X]], offset = 0>
// CHECK-DAG: #[[OUT_V_TAG:.*]] = #llvm.tbaa_tag<base_type = #[[OUT_V]], access_type = #[[OUT_V]], offset = 0>
// CHECK-DAG: #[[SCALE_TAG:.*]] = #llvm.tbaa_tag<base_type = #[[SCALE]], access_type = #[[SCALE]], offset = 0, constant = true>
// CHECK-DAG: #[[FAILURE_TAG:.*]] = #llvm.tbaa_tag<base_type = #[[FAILURE]],
// CHECK-DAG: #[[PRIM_X_TAG:.*]] = #llvm.tbaa_tag<base_type = #[[PRIM_X]],
// CHECK-DAG: #[[EMITTED_X_TAG:.*]] = #llvm.tbaa_tag<base_type = #[[EMITTED_X]],

// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         llvm.load %{{.*}} {tbaa = [#[[PRIM_X_TAG]]]} : !llvm.ptr -> i32
// CHECK:         llvm.load %{{.*}} {tbaa = [#[[SCALE_TAG]]]} : !llvm.ptr -> f32
// CHECK:         llvm.store %{{.*}} {tbaa = [#[[OUT_V_TAG]]]} : f32
// CHECK:         llvm.atomicrmw {{.*}} {tbaa = [#[[OUT_X_TAG]]]}
// CHECK:         llvm.call @pikoir_fail_index({{.*}}) {tbaa = [#[[FAILURE_TAG]]]}
// CHECK:         llvm.call @pikoir_append_inline({{.*}})
// CHECK:         llvm.store %{{.*}} {tbaa = [#[[EMITTED_X_TAG]]]} : i32

// Calls, too: what a failed test calls leaves state as it is.
// IR: call void @pikoir_fail_index({{.*}}), !tbaa ![[TAG:[0-9]+]]
// IR: ![[TAG]] = !{![[FAILURE:[0-9]+]], ![[FAILURE]], i64 0}
// IR: ![[FAILURE]] = !{!"failure",
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.constant @camera : @C
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %s = piko.load @camera "scale" : f32
      piko.store %s, @out[%x : i32] "v" : f32
      piko.atomic add @out[%x : i32] "x", %x : i32
      piko.emit 0 (%x, %s) : i32, f32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.store %x, @out[%x : i32] "x" : i32
      piko.return
    }
  }
}
