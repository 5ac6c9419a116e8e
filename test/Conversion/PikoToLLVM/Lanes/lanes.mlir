// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu %s | FileCheck %s

piko.record @F {"lo" : i32 at 0, "hi" : i32 at 4, "w" : f32 at 8} size 12 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.record @C {"r" : f32 at 0, "g" : f32 at 4} size 40 align 4

// Pixels that lie one after the other are loaded and stored as a vector; with
// many words between them, they are scattered. An element of a buffer is found
// for each lane.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[STEPS:.*]] = arith.constant dense<[0, 40, 80, 120, 160, 200, 240, 280, 320, 360, 400, 440, 480, 520, 560, 600]> : vector<16xi64>
// CHECK:         llvm.intr.masked.gather %{{.*}} : (vector<16x!llvm.ptr>, vector<16xi1>, vector<16xf32>) -> vector<16xf32>
// CHECK:         llvm.intr.masked.load %{{.*}} : (!llvm.ptr, vector<16xi1>, vector<16xf32>) -> vector<16xf32>
// CHECK:         llvm.intr.masked.store %{{.*}} : vector<16xf32>, vector<16xi1> into !llvm.ptr
// CHECK:         %[[EACH:.*]] = llvm.getelementptr %{{.*}}[%[[STEPS]]] : (!llvm.ptr, vector<16xi64>) -> vector<16x!llvm.ptr>, i8
// CHECK:         llvm.intr.masked.scatter %{{.*}}, %{{.*}}, %{{.*}} : vector<16xf32>, vector<16xi1> into vector<16x!llvm.ptr>
piko.pipeline @P rank 2 {
  piko.buffer @table : @D
  piko.image @depth : @D rank 2
  piko.image @color : @C rank 2
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
        %c3 = arith.constant 3 : i32
        %at = arith.andi %x, %c3 : i32
        %t = piko.load @table[%at : i32] "z" : f32
        %v = arith.mulf %t, %w : f32
        %isNear = piko.update @depth[%x, %y : i32, i32] {
        ^bb0(%z: f32):
          %near = arith.cmpf olt, %v, %z : f32
          %new = arith.select %near, %v, %z : f32
          piko.yield [%new : f32] results [%near : i1]
        } -> i1
        scf.if %isNear {
          piko.update @color[%x, %y : i32, i32] {
          ^bb0(%r: f32, %g: f32):
            piko.yield [%v, %g : f32, f32]
          }
        }
        piko.yield
      }
    }
  }
}
