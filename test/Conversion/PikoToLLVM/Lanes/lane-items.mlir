// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu %s | FileCheck %s

piko.record @F {"at" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @G {"y" : f32 at 0} size 4 align 4

// The addresses of 16 primitives, through their order where there is one; a
// field of each, which without an order is one of vectors of whole records, masked
// where some lanes have none; and a writer that asks once whether primitives are
// counted.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[SIZE:.*]] = arith.constant dense<8> : vector<16xi64>
// CHECK:         %[[STEPS:.*]] = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]> : vector<16xi64>
// CHECK:         %[[NUMBERS:.*]] = scf.if %{{.*}} -> (vector<16xi64>) {
// CHECK:           %[[ORDER:.*]] = llvm.intr.masked.load %{{.*}} : (!llvm.ptr, vector<16xi1>, vector<16xi32>) -> vector<16xi32>
// CHECK:           arith.extui %[[ORDER]] : vector<16xi32> to vector<16xi64>
// CHECK:         } else {
// CHECK:           arith.addi %{{.*}}, %[[STEPS]] : vector<16xi64>
// CHECK:         }
// CHECK:         %[[BYTES:.*]] = arith.muli %[[NUMBERS]], %[[SIZE]] : vector<16xi64>
// CHECK:         %[[SUM:.*]] = arith.addi %[[BYTES]], %{{.*}} : vector<16xi64>
// CHECK:         scf.if %{{.*}} -> (vector<16xf32>) {
// CHECK:           llvm.inttoptr %{{.*}} : vector<16xi64> to vector<16x!llvm.ptr>
// CHECK:           llvm.intr.masked.gather %{{.*}} : (vector<16x!llvm.ptr>, vector<16xi1>, vector<16xf32>) -> vector<16xf32>
// CHECK:         } else {
// CHECK:           %[[ALL:.*]] = vector.reduction <and>
// CHECK:           %[[ROW:.*]]:2 = scf.if %[[ALL]]
// CHECK-COUNT-2:     llvm.load %{{.*}} {alignment = 4 : i64} : !llvm.ptr -> vector<16xi32>
// CHECK:           } else {
// CHECK-COUNT-2:     llvm.intr.masked.load
// CHECK:           }
// CHECK:           vector.shuffle %[[ROW]]#0, %[[ROW]]#1 [1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31]
// CHECK:         }
// CHECK:         math.sqrt %{{.*}} : vector<16xf32>
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %root = math.sqrt %z : f32
      %half = math.sqrt %root : f32
      piko.emit 0 (%half) : f32
    }
  }
  piko.buffer @out : @G
  piko.stage @b bins [0] threads 1 : @G -> [] {
    piko.schedule load_balance end_stage [@a]
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      %c0 = arith.constant 0 : i32
      %y = piko.get %g "y" : !piko.prim<@G> -> f32
      piko.store %y, @out[%c0 : i32] "y" : f32
    }
  }
  piko.edge @a[0] -> @b
}
