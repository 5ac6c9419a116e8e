// two-ports.cpp, written by hand.
// RUN: piko-compare %s --reference %S/two-ports.cpp --count 5000 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Count {"amount" : i32 at 0} size 4 align 4
piko.record @Pixel {"sum" : f32 at 0, "last" : i32 at 4} size 8 align 4
piko.record @int {"value" : i32 at 0} size 4 align 4

piko.pipeline @TwoPorts rank 2 {
  piko.image @image : @Pixel rank 2 clear [0.0 : f32, -1 : i32]
  piko.buffer @counts : @int
  piko.source @split
  piko.edge @split[0] -> @draw
  piko.edge @split[1] -> @add

  piko.stage @split bins [0, 0] threads 64 : @Point -> [@Point, @Count] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %three = arith.constant 3 : i32
      %four = arith.constant 4 : i32
      %third = arith.remsi %tag, %three : i32
      %counted = arith.cmpi eq, %third, %zero : i32
      scf.if %counted {
        piko.emit 1 (%tag) : i32
      }
      %copies = arith.remsi %tag, %four : i32
      %width = piko.domain[0]
      %w = arith.index_cast %width : index to i32
      scf.for %i = %zero to %copies step %one : i32 {
        %moved = arith.addi %x, %i : i32
        %at = arith.remsi %moved, %w : i32
        %next = arith.addi %i, %one : i32
        %factor = arith.sitofp %next : i32 to f32
        %scaled = arith.mulf %value, %factor : f32
        piko.emit 0 (%at, %y, %scaled, %tag) : i32, i32, f32, i32
      }
      piko.return
    }
  }

  piko.stage @draw bins [8, 8] threads 64 : @Point -> [] {
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
      %half = arith.constant 0.5 : f32
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%sum: f32, %last: i32):
        %faded = arith.mulf %sum, %half : f32
        %new = arith.addf %faded, %value : f32
        piko.yield [%new, %tag : f32, i32]
      }
      piko.return
    }
  }

  piko.stage @add bins [0, 0] threads 64 : @Count -> [] {
    piko.process {
    ^bb0(%c: !piko.prim<@Count>):
      %amount = piko.get %c "amount" : !piko.prim<@Count> -> i32
      %one = arith.constant 1 : i32
      piko.atomic add @counts[%amount : i32] "value", %one : i32
      piko.return
    }
  }
}
