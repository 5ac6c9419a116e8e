// Where the processor has gathers, lanes that read in different places are one,
// also where LLVM would have branches, because they are slow on some machines.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --cpu x86-64-v3 | FileCheck %s
// RUN: pikoc %s --emit=assembly --cpu haswell | FileCheck %s
// CHECK: vgather{{.*}}, %{{[xy]}}mm

// Two words that are not side by side, of which one load would take both.
piko.record @V {"at" : i32 at 0, "y" : f32 at 4, "z" : f32 at 8} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%v: !piko.prim<@V>):
      %at = piko.get %v "at" : !piko.prim<@V> -> i32
      %0 = piko.load @in[%at : i32] "z" : f32
      %1 = piko.load @in[%at : i32] "at" : i32
      %2 = arith.mulf %0, %0 : f32
      piko.store %2, @in[%1 : i32] "z" : f32
      piko.return
    }
  }
}
