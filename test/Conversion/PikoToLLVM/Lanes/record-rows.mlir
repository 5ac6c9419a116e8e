// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=16 %s | FileCheck %s
// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=8 %s | FileCheck %s --check-prefix=EIGHT

piko.record @F {"lo" : i32 at 0, "hi" : i32 at 4, "w" : f32 at 8} size 12 align 4
piko.record @C {"r" : f32 at 0, "g" : f32 at 4, "b" : f32 at 8, "z" : f32 at 12} size 16 align 4
piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8} size 12 align 4

// Pixels of four words that lie one after the other: four vectors, each with those
// of four lanes, as far as these are in the mask. Pairs of words are brought
// together first, then one word of each. Three words are written; the fourth one is
// in no mask.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[M0:.*]] = vector.shuffle %[[M:.*]], %[[M]] [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3] : vector<16xi1>, vector<16xi1>
// CHECK:         llvm.intr.masked.load %{{.*}}, %[[M0]], %{{.*}} {alignment = 4 : i32} : (!llvm.ptr, vector<16xi1>, vector<16xi32>) -> vector<16xi32>
// CHECK-COUNT-3: llvm.intr.masked.load
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [1, 3, 5, 7, 9, 11, 13, 15] : vector<8xi64>, vector<8xi64>
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [1, 3, 5, 7, 9, 11, 13, 15] : vector<8xi64>, vector<8xi64>
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31] : vector<16xi32>, vector<16xi32>
// CHECK:         %[[WRITTEN:.*]] = arith.andi %{{.*}}, %{{.*}} : vector<16xi1>
// CHECK:         llvm.intr.masked.store %{{.*}}, %{{.*}}, %[[WRITTEN]] {alignment = 4 : i32} : vector<16xi32>, vector<16xi1> into !llvm.ptr
// CHECK-COUNT-3: llvm.intr.masked.store
//
// Of three words, one vector after the other adds to each.
// CHECK-COUNT-3: llvm.intr.masked.load
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, -1, -1, -1, -1, -1] : vector<16xi32>, vector<16xi32>
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29] : vector<16xi32>, vector<16xi32>
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [0, 16, -1, 1, 17, -1, 2, 18, -1, 3, 19, -1, 4, 20, -1, 5] : vector<16xi32>, vector<16xi32>
// CHECK-NOT:     llvm.intr.masked.{{gather|scatter}}
//
// EIGHT-LABEL: func.func private @P.kernel_a
// EIGHT:         llvm.intr.masked.gather
// EIGHT:         llvm.intr.masked.scatter
piko.pipeline @P rank 2 {
  piko.image @color : @C rank 2
  piko.image @sums : @V rank 2
  piko.source @a
  piko.stage @a bins [16, 16] threads 16 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
    }
    piko.schedule load_balance lanes iterations
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %lo = piko.get %f "lo" : !piko.prim<@F> -> i32
      %hi = piko.get %f "hi" : !piko.prim<@F> -> i32
      %w = piko.get %f "w" : !piko.prim<@F> -> f32
      piko.parallel_pixels (%lo, %lo) to (%hi, %hi) {
      ^bb0(%x: i32, %y: i32):
        %i = arith.sitofp %x : i32 to f32
        %v = arith.mulf %i, %w : f32
        piko.update @color[%x, %y : i32, i32] {
        ^bb0(%r: f32, %g: f32, %b: f32, %z: f32):
          %near = arith.mulf %v, %z : f32
          piko.yield [%near, %near, %near, %z : f32, f32, f32, f32]
        }
        piko.update @sums[%x, %y : i32, i32] {
        ^bb0(%r: f32, %g: f32, %b: f32):
          %s = arith.addf %v, %r : f32
          %t = arith.addf %s, %g : f32
          %u = arith.addf %t, %b : f32
          piko.yield [%s, %t, %u : f32, f32, f32]
        }
        piko.yield
      }
    }
  }
}
