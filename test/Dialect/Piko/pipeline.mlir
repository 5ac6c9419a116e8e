// RUN: piko-opt %s | piko-opt | FileCheck %s
// What is not in the text form is not in the operations: two passes through
// the parser and the printer change nothing.

// CHECK: piko.record @Fragment {"pos.x" : f32 at 0, "id" : i32 at 4, "weights" : f32[4 : 4] at 8, "m" : f64[2 : 24, 3 : 8] at 24} size 72 align 8
piko.record @Fragment {"pos.x" : f32 at 0, "id" : i32 at 4, "weights" : f32[4 : 4] at 8, "m" : f64[2 : 24, 3 : 8] at 24} size 72 align 8
// CHECK: piko.record @Empty {} size 1 align 1
piko.record @Empty {} size 1 align 1
// CHECK: piko.record @"scene::Light" {"flags" : i8 at 0, "kind" : i16 at 2, "seed" : i64 at 8} size 16 align 8
piko.record @"scene::Light" {"flags" : i8 at 0, "kind" : i16 at 2, "seed" : i64 at 8} size 16 align 8
piko.record @Depth {"z" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @Graph rank 2 {
piko.pipeline @Graph rank 2 {
  // CHECK-NEXT: piko.constant @camera : @Depth
  piko.constant @camera : @Depth
  // CHECK-NEXT: piko.constant @far : @Depth value [2.000000e+00 : f32]
  piko.constant @far : @Depth value [2.0 : f32]
  // CHECK-NEXT: piko.buffer @lights : @"scene::Light"
  piko.buffer @lights : @"scene::Light"
  // CHECK-NEXT: piko.buffer @shaded : @Depth per_source 1
  piko.buffer @shaded : @Depth per_source 1
  // CHECK-NEXT: piko.image @depth : @Depth rank 2 clear [1.000000e+00 : f32]
  piko.image @depth : @Depth rank 2 clear [1.0 : f32]
  // CHECK-NEXT: piko.image @ids : @Empty rank 2
  piko.image @ids : @Empty rank 2
  // CHECK-NEXT: piko.source @first
  // CHECK-NEXT: piko.source @second
  // CHECK-NEXT: piko.edge @first[0] -> @second
  piko.source @first
  piko.source @second
  piko.edge @first[0] -> @second
  piko.stage @first bins [0, 0] threads 64 : @Depth -> [@Depth] {
    piko.process {
    ^bb0(%p: !piko.prim<@Depth>):
      %z = piko.get %p "z" : !piko.prim<@Depth> -> f32
      piko.emit 0 (%z) : f32
      piko.return
    }
  }
  piko.stage @second bins [0, 0] threads 64 : @Depth -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@Depth>):
      piko.return
    }
  }
}

// CHECK-LABEL: piko.pipeline @Volume rank 3 {
// CHECK-NEXT: piko.image @density : @Depth rank 3
piko.pipeline @Volume rank 3 {
  piko.image @density : @Depth rank 3
}

// The attribute has a form of its own, for use outside of records.
// CHECK: module attributes {test.field = #piko.field<"w" : f32[16 : 4] at 8>}
module attributes {test.field = #piko.field<"w" : f32[16 : 4] at 8>} {}

// CHECK: piko.pipeline @Small rank 3 max_extent 4096 {
piko.pipeline @Small rank 3 max_extent 4096 {
}
