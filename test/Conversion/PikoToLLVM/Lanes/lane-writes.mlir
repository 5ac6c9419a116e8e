// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=4 %s | FileCheck %s

piko.record @I {"i" : i32 at 0, "x" : f32 at 8} size 12 align 4
piko.record @V {"a" : f32 at 0, "b" : f32 at 4, "c" : f32 at 8, "d" : f32 at 12, "e" : f32 at 16, "f" : f32 at 20, "g" : f32 at 24, "n" : i32 at 32} size 36 align 4

// Where all lanes write, a transposition of 4x4 words, of which each lane stores 16
// bytes, and then three words; n, which does not lie beside them, is stored alone.
// Elsewhere each field is scattered.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[ALL:.*]] = vector.reduction <and>
// CHECK-NEXT:    scf.if %[[ALL]] {
// CHECK:           vector.shuffle %{{.*}}, %{{.*}} [0, 4, 1, 5]
// CHECK:           llvm.store %{{.*}}, %{{.*}} {alignment = 4 : i64} : vector<4xi32>, !llvm.ptr
// CHECK:           llvm.intr.masked.store %{{.*}}, %{{.*}}, %{{.*}} {alignment = 4 : i32} : vector<4xi32>, vector<4xi1> into !llvm.ptr
// CHECK:           llvm.store %{{.*}}, %{{.*}} {alignment = 4 : i64} : vector<1xi32>, !llvm.ptr
// CHECK-COUNT-3:   llvm.store %{{.*}}, %{{.*}} {alignment = 4 : i64} : vector<4xi32>, !llvm.ptr
// CHECK-NOT:       llvm.store {{.*}} vector<4xi32>
// CHECK:         } else {
// CHECK-COUNT-8:   llvm.intr.masked.scatter
// CHECK-NOT:       llvm.intr.masked.scatter
// CHECK:         }
piko.pipeline @P rank 1 {
  piko.source @a
  piko.buffer @out : @V
  piko.stage @a bins [0] threads 1 : @I -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%p: !piko.prim<@I>):
      %i = piko.get %p "i" : !piko.prim<@I> -> i32
      %x = piko.get %p "x" : !piko.prim<@I> -> f32
      %y = arith.divf %x, %x : f32
      piko.store %x, @out[%i : i32] "a" : f32
      piko.store %y, @out[%i : i32] "b" : f32
      piko.store %x, @out[%i : i32] "c" : f32
      piko.store %y, @out[%i : i32] "d" : f32
      piko.store %x, @out[%i : i32] "e" : f32
      piko.store %y, @out[%i : i32] "f" : f32
      piko.store %x, @out[%i : i32] "g" : f32
      piko.store %i, @out[%i : i32] "n" : i32
    }
  }
}
