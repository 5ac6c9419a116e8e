// RUN: piko-compare %s --reference %S/Inputs/unordered.cpp --count 4000 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Sums {"total" : f32 at 0, "wide" : f64 at 8, "next" : i32 at 16} size 24 align 8
piko.record @Count {"value" : i32 at 0} size 4 align 4

piko.pipeline @Takes rank 2 {
  piko.buffer @sums : @Sums
  piko.buffer @taken : @Count
  piko.source @take
  piko.edge @take[0] -> @tally

  piko.stage @take bins [16, 16] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      piko.assign_box [%x, %y : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %first = arith.constant 0 : index
      %one = arith.constant 1 : i32
      %c64 = arith.constant 64 : i32
      %wide = arith.extf %value : f32 to f64
      piko.atomic add_float @sums[%first : index] "total", %value : f32
      piko.atomic add_float @sums[%first : index] "wide", %wide : f64
      %place = piko.atomic add @sums[%first : index] "next", %one : i32 -> i32
      %x = arith.remsi %place, %c64 : i32
      piko.emit 0 (%x, %y, %value, %tag) : i32, i32, f32, i32
      piko.return
    }
  }

  piko.stage @tally bins [0, 0] threads 64 : @Point -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %one = arith.constant 1 : i32
      piko.atomic add @taken[%x : i32] "value", %one : i32
      piko.return
    }
  }
}
