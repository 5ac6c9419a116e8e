// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program))' %s | FileCheck %s

// Stages may stand in any order: what feeds a kernel, and what it waits for, runs
// before it.
// CHECK-LABEL: piko.pipeline @Order
// CHECK:         piko.program
// CHECK:           piko.launch @kernel_a
// CHECK:           piko.launch @kernel_c
// CHECK:           piko.launch @kernel_b
// CHECK-NOT:       piko.launch
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Order rank 1 {
  piko.source @a
  piko.edge @a[0] -> @c
  piko.edge @c[0] -> @b
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @c bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
