// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=4 %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8, "n" : i32 at 24} size 28 align 4
piko.record @W {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8} size 12 align 4
piko.record @G {"y" : f32 at 0} size 4 align 4

// For each lane a load of the 16 bytes that have x, y and z, of zeros where it
// does not read, and a transposition of 4x4 words; n, which is beyond, alone is a
// gather.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[ALL:.*]] = vector.reduction <and>
// CHECK-NEXT:    scf.if %[[ALL]] -> (vector<4xi64>) {
// CHECK:           llvm.ptrtoint
// CHECK:           arith.select %{{.*}} : vector<4xi1>, vector<4xi64>
// CHECK:         }
// CHECK-COUNT-4: llvm.load %{{.*}} {alignment = 4 : i64} : !llvm.ptr -> vector<4xi32>
// CHECK:         vector.shuffle %{{.*}}, %{{.*}} [0, 4, 1, 5]
// CHECK-NEXT:    vector.shuffle %{{.*}}, %{{.*}} [2, 6, 3, 7]
// CHECK-NEXT:    vector.shuffle %{{.*}}, %{{.*}} [0, 4, 1, 5]
// CHECK-NEXT:    vector.shuffle %{{.*}}, %{{.*}} [2, 6, 3, 7]
// CHECK-NEXT:    vector.shuffle %{{.*}}, %{{.*}} [0, 1, 4, 5]
// CHECK-NEXT:    vector.shuffle %{{.*}}, %{{.*}} [2, 3, 6, 7]
// CHECK:         vector.bitcast %{{.*}} : vector<4xi32> to vector<4xf32>
// CHECK:         llvm.intr.masked.gather
// CHECK-NOT:     llvm.intr.masked.gather
//
// A record of 12 bytes has no 16 to load.
// CHECK-LABEL: func.func private @P.kernel_b
// CHECK-NOT:     llvm.load %{{.*}} -> vector<4xi32>
// CHECK-COUNT-3: llvm.intr.masked.gather
// CHECK-NOT:     llvm.intr.masked.gather
piko.pipeline @P rank 1 {
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @V -> [@G] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%v: !piko.prim<@V>):
      %x = piko.get %v "x" : !piko.prim<@V> -> f32
      %y = piko.get %v "y" : !piko.prim<@V> -> f32
      %z = piko.get %v "z" : !piko.prim<@V> -> f32
      %n = piko.get %v "n" : !piko.prim<@V> -> i32
      %xy = arith.addf %x, %y : f32
      %xyz = arith.addf %xy, %z : f32
      %f = arith.sitofp %n : i32 to f32
      %all = arith.divf %xyz, %f : f32
      piko.emit 0 (%all) : f32
    }
  }
  piko.stage @b bins [0] threads 1 : @W -> [@G] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%w: !piko.prim<@W>):
      %x = piko.get %w "x" : !piko.prim<@W> -> f32
      %y = piko.get %w "y" : !piko.prim<@W> -> f32
      %z = piko.get %w "z" : !piko.prim<@W> -> f32
      %xy = arith.divf %x, %y : f32
      %xyz = arith.addf %xy, %z : f32
      piko.emit 0 (%xyz) : f32
    }
  }
  piko.buffer @out : @G
  piko.stage @c bins [0] threads 1 : @G -> [] {
    piko.schedule load_balance end_stage [@a, @b]
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      %c0 = arith.constant 0 : i32
      %y = piko.get %g "y" : !piko.prim<@G> -> f32
      piko.store %y, @out[%c0 : i32] "y" : f32
    }
  }
  piko.edge @a[0] -> @c
  piko.edge @b[0] -> @c
}
