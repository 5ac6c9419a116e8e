// update-order.cpp's pipe Small, written by hand.
// RUN: piko-compare %s --reference %S/update-order.cpp --pipe Small --count 20000 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Pixel {"value" : f32 at 0, "passes" : i32 at 4} size 8 align 4

piko.pipeline @Small rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @spread
  piko.edge @spread[0] -> @blend
  piko.edge @blend[0] -> @drop

  piko.stage @spread bins [16, 16] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %zero = arith.constant 0 : i32
      %all = arith.cmpi eq, %tag, %zero : i32
      scf.if %all {
        piko.assign_all
      } else {
        %x0 = arith.subi %x, %tag : i32
        piko.assign_box [%x0, %y : i32, i32] to [%x, %y : i32, i32]
      }
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %bin = piko.bin
      %lo = piko.bin_lo %bin[0]
      %x0 = arith.index_cast %lo : index to i32
      %zero = arith.constant 0 : i32
      %two = arith.constant 2 : i32
      %four = arith.constant 4 : i32
      %half = arith.constant 0.5 : f32
      %offset = arith.remsi %tag, %four : i32
      %at = arith.addi %x0, %offset : i32
      %halved = arith.mulf %value, %half : f32
      %float = arith.sitofp %x0 : i32 to f32
      %marked = arith.addf %halved, %float : f32
      piko.emit 0 (%at, %y, %marked, %tag) : i32, i32, f32, i32
      %odd = arith.remsi %tag, %two : i32
      %even = arith.cmpi eq, %odd, %zero : i32
      scf.if %even {
        piko.emit 0 (%x, %y, %value, %tag) : i32, i32, f32, i32
      }
      piko.return
    }
  }

  piko.stage @blend bins [8, 8] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %bin = piko.bin_at %x, %y : i32, i32
      %zero = arith.constant 0 : index
      %inside = arith.cmpi sge, %bin, %zero : index
      scf.if %inside {
        piko.assign_to %bin
      }
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %fade = arith.constant 0.875 : f32
      %one = arith.constant 1 : i32
      %passed = piko.update @image[%x, %y : i32, i32] {
      ^bb0(%old: f32, %passes: i32):
        %larger = arith.cmpf ogt, %value, %old : f32
        %faded = arith.mulf %old, %fade : f32
        %new = arith.select %larger, %value, %faded : f32
        %count = arith.addi %passes, %one : i32
        piko.yield [%new, %count : f32, i32] results [%larger : i1]
      } -> i1
      scf.if %passed {
        piko.emit 0 (%x, %y, %value, %tag) : i32, i32, f32, i32
      }
      piko.return
    }
  }

  piko.stage @drop bins [0, 0] threads 64 : @Point -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      piko.return
    }
  }
}
