// join.cpp, written by hand.
// RUN: piko-compare %s --reference %S/join.cpp --count 5000 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Pixel {"sum" : f32 at 0} size 4 align 4

piko.pipeline @JoinPipe rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @split
  piko.edge @split[0] -> @join
  piko.edge @split[1] -> @detour
  piko.edge @detour[0] -> @join

  piko.stage @split bins [0, 0] threads 64 : @Point -> [@Point, @Point] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %one = arith.constant 1 : i32
      %two = arith.constant 2 : i32
      %zero = arith.constant 0 : i32
      %unit = arith.constant 1.0 : f32
      %odd = arith.andi %tag, %one : i32
      %first = arith.cmpi eq, %odd, %zero : i32
      scf.if %first {
        piko.emit 0 (%x, %y, %value, %tag) : i32, i32, f32, i32
      } else {
        piko.emit 1 (%x, %y, %value, %tag) : i32, i32, f32, i32
      }
      %more = arith.addf %value, %unit : f32
      %half = arith.divsi %tag, %two : i32
      %bit = arith.andi %half, %one : i32
      %second = arith.cmpi eq, %bit, %zero : i32
      scf.if %second {
        piko.emit 0 (%x, %y, %more, %tag) : i32, i32, f32, i32
      } else {
        piko.emit 1 (%x, %y, %more, %tag) : i32, i32, f32, i32
      }
      piko.emit 0 (%x, %y, %more, %tag) : i32, i32, f32, i32
      piko.return
    }
  }

  piko.stage @detour bins [16, 16] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %three = arith.constant 3 : i32
      %x0 = arith.subi %x, %three : i32
      %y0 = arith.subi %y, %three : i32
      piko.assign_box [%x0, %y0 : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %bin = piko.bin
      %number = arith.index_cast %bin : index to i64
      %float = arith.sitofp %number : i64 to f32
      %negative = arith.negf %value : f32
      %marked = arith.addf %negative, %float : f32
      piko.emit 0 (%x, %y, %marked, %tag) : i32, i32, f32, i32
      piko.emit 0 (%x, %y, %value, %tag) : i32, i32, f32, i32
      piko.return
    }
  }

  piko.stage @join bins [0, 0] threads 64 : @Point -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %width = piko.domain[0]
      %height = piko.domain[1]
      %w = arith.index_cast %width : index to i32
      %h = arith.index_cast %height : index to i32
      %left = arith.cmpi slt, %x, %w : i32
      %above = arith.cmpi slt, %y, %h : i32
      %inside = arith.andi %left, %above : i1
      %fade = arith.constant 0.75 : f32
      scf.if %inside {
        piko.update @image[%x, %y : i32, i32] {
        ^bb0(%sum: f32):
          %faded = arith.mulf %sum, %fade : f32
          %new = arith.addf %faded, %value : f32
          piko.yield [%new : f32]
        }
      }
      piko.return
    }
  }
}
