// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=16 %s | FileCheck %s

piko.record @I {"i" : i32 at 0} size 4 align 4
piko.record @V {"z" : f32 at 0} size 4 align 4

// Lanes that fail do so in a loop, in which LLVM would not see that hardly any does.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[OUTSIDE:.*]] = vector.reduction <or>
// CHECK-NEXT:    %[[INSIDE:.*]] = arith.cmpi eq, %[[OUTSIDE]], %false
// CHECK:         %[[ALL:.*]] = arith.andi %{{.*}}, %[[INSIDE]] : i1
// CHECK-NEXT:    scf.if %[[ALL]] -> (vector<16xf32>)
// CHECK:         %[[HIT:.*]] = vector.reduction <or>
// CHECK-NEXT:    scf.if %[[HIT]] -> (vector<16xf32>)
// CHECK:         %[[RARE:.*]] = llvm.intr.expect %[[OUTSIDE]], %false : i1
// CHECK-NEXT:    scf.if %[[RARE]] {
// CHECK:           scf.while
// CHECK:             llvm.call @pikoir_fail_index
// CHECK:         llvm.intr.expect
// What every lane does one after the other is no failure.
// CHECK-NOT:     llvm.intr.expect
// CHECK:         scf.while
// CHECK:         func.func @P.setup
piko.pipeline @P rank 1 {
  piko.source @a
  piko.buffer @table : @V
  piko.buffer @out : @V
  piko.stage @a bins [0] threads 1 : @I -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%p: !piko.prim<@I>):
      %i = piko.get %p "i" : !piko.prim<@I> -> i32
      %x = piko.load @table[%i : i32] "z" : f32
      %y = arith.divf %x, %x : f32
      piko.store %y, @out[%i : i32] "z" : f32
    }
  }
}
