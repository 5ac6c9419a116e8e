// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=4 %s | FileCheck %s

piko.record @V {"n" : i32 at 0, "x" : f32 at 4, "y" : f32 at 8} size 12 align 4
piko.record @G {"y" : f32 at 0} size 4 align 4

// Two words side by side are one load of each lane.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         vector.reduction <and>
// CHECK-COUNT-4: llvm.load %{{.*}} {alignment = 4 : i64} : !llvm.ptr -> i64
// CHECK:         vector.shuffle %{{.*}} [0, 2, 4, 6] : vector<8xi32>, vector<8xi32>
// CHECK:         vector.shuffle %{{.*}} [1, 3, 5, 7] : vector<8xi32>, vector<8xi32>
// CHECK-NOT:     llvm.intr.masked.gather
piko.pipeline @P rank 1 {
  piko.source @a
  piko.buffer @out : @G
  piko.stage @a bins [0] threads 1 : @V -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%v: !piko.prim<@V>):
      %c3 = arith.constant 3 : i32
      %x = piko.get %v "x" : !piko.prim<@V> -> f32
      %y = piko.get %v "y" : !piko.prim<@V> -> f32
      %xy = arith.addf %x, %y : f32
      %all = arith.divf %xy, %y : f32
      piko.store %all, @out[%c3 : i32] "y" : f32
      piko.return
    }
  }
}
