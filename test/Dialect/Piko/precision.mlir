// RUN: piko-opt %s | piko-opt | FileCheck %s
// Phases that need not compute strictly.

piko.record @F {"x" : f32 at 0} size 4 align 4

piko.pipeline @Phases rank 1 {
  piko.source @a
  piko.source @b
  piko.source @c
  piko.stage @a bins [0] threads 1 : @F -> [] {
    // CHECK: piko.process precision strict {
    piko.process precision strict {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    // CHECK: piko.process precision contracted {
    piko.process precision contracted {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @c bins [0] threads 1 : @F -> [] {
    // CHECK: piko.process precision relaxed {
    piko.process precision relaxed {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
