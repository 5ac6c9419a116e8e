// atomic.cpp, written by hand.
// RUN: piko-compare %s --reference %S/atomic.cpp --count 50000 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Statistics {"sum" : i32 at 0, "least" : i32 at 4, "most" : i32 at 8,
  "least2" : i32 at 12, "most2" : i32 at 16, "all" : i32 at 20, "any" : i32 at 24,
  "odd" : i32 at 28} size 32 align 4
piko.record @uint {"value" : i32 at 0} size 4 align 4

piko.pipeline @Atomics rank 2 {
  piko.buffer @statistics : @Statistics
  piko.buffer @histogram : @uint
  piko.source @gather
  piko.stage @gather bins [0, 0] threads 64 : @Point -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %one = arith.constant 1 : i32
      %four = arith.constant 4 : i32
      %five = arith.constant 5 : i32
      %half = arith.constant 31 : i32
      %i = arith.divsi %tag, %four : i32
      %difference = arith.subi %x, %y : i32
      %xs = arith.subi %x, %half : i32
      %ys = arith.subi %y, %half : i32
      %x5 = arith.subi %x, %five : i32
      piko.atomic add @statistics[%i : i32] "sum", %difference : i32
      piko.atomic min_signed @statistics[%i : i32] "least", %xs : i32
      piko.atomic max_signed @statistics[%i : i32] "most", %ys : i32
      piko.atomic min_unsigned @statistics[%i : i32] "least2", %x : i32
      piko.atomic max_unsigned @statistics[%i : i32] "most2", %x5 : i32
      piko.atomic and @statistics[%i : i32] "all", %x : i32
      piko.atomic or @statistics[%i : i32] "any", %y : i32
      piko.atomic xor @statistics[%i : i32] "odd", %y : i32
      piko.atomic add @histogram[%x : i32] "value", %one : i32
      piko.return
    }
  }
}
