// RUN: piko-compare %s --reference %S/Inputs/cycles.cpp --count 300 | FileCheck %s
// RUN: piko-compare %s --reference %S/Inputs/cycles.cpp --count 300 --runs 1 --strip 7 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Pixel {"sum" : f32 at 0} size 4 align 4

piko.pipeline @Cycles rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @walk
  piko.source @rounds
  piko.edge @walk[0] -> @walk
  piko.edge @walk[1] -> @rounds
  piko.edge @rounds[0] -> @rounds
  piko.edge @rounds[1] -> @blend

  piko.stage @walk bins [8, 8] threads 64 : @Point -> [@Point, @Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      piko.assign_box [%x, %y : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
      %c0 = arith.constant 0 : i32
      %c3 = arith.constant 3 : i32
      %c5 = arith.constant 5 : i32
      %c7 = arith.constant 7 : i32
      %c20 = arith.constant 20 : i32
      %c48 = arith.constant 48 : i32
      %c64 = arith.constant 64 : i32
      %one = arith.constant 1.0 : f32
      %some = arith.cmpi sgt, %tag, %c0 : i32
      scf.if %some {
        %x5 = arith.addi %x, %c5 : i32
        %right = arith.remsi %x5, %c64 : i32
        %more = arith.addf %value, %one : f32
        %less = arith.subi %tag, %c7 : i32
        piko.emit 0 (%right, %y, %more, %less) : i32, i32, f32, i32
      }
      piko.emit 1 (%x, %y, %value, %tag) : i32, i32, f32, i32
      %many = arith.cmpi sgt, %tag, %c20 : i32
      scf.if %many {
        %y3 = arith.addi %y, %c3 : i32
        %down = arith.remsi %y3, %c48 : i32
        %negative = arith.negf %value : f32
        %less = arith.subi %tag, %c20 : i32
        piko.emit 0 (%x, %down, %negative, %less) : i32, i32, f32, i32
      }
      piko.return
    }
  }

  piko.stage @rounds bins [16, 16] threads 64 : list @Point -> [@Point, @Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %two = arith.constant 2 : i32
      %x0 = arith.subi %x, %two : i32
      piko.assign_box [%x0, %y : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.schedule load_balance batch 5
    piko.process {
    ^bb0(%list: !piko.list<@Point>):
      %n = piko.list_size %list : !piko.list<@Point>
      piko.parallel_for %n {
      ^bb0(%i: index):
      %p = piko.list_at %list[%i] : !piko.list<@Point> -> !piko.prim<@Point>
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
        %two = arith.constant 2 : index
        %none = arith.constant 0 : index
        %c0 = arith.constant 0 : i32
        %c4 = arith.constant 4 : i32
        %c16 = arith.constant 16 : i32
        %c64 = arith.constant 64 : i32
        %half = arith.constant 0.5 : f32
        %odd = arith.remui %i, %two : index
        %even = arith.cmpi eq, %odd, %none : index
        %some = arith.cmpi sgt, %tag, %c0 : i32
        %again = arith.andi %even, %some : i1
        scf.if %again {
          %x16 = arith.addi %x, %c16 : i32
          %right = arith.remsi %x16, %c64 : i32
          %less = arith.divsi %tag, %c4 : i32
          piko.emit 0 (%right, %y, %value, %less) : i32, i32, f32, i32
        }
        %halved = arith.mulf %value, %half : f32
        piko.emit 1 (%x, %y, %halved, %tag) : i32, i32, f32, i32
        piko.yield
      }
      piko.return
    }
  }

  piko.stage @blend bins [8, 8] threads 64 : @Point -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      piko.assign_box [%x, %y : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %value = piko.get %p "value" : !piko.prim<@Point> -> f32
      %c = arith.constant 0.75 : f32
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%old: f32):
        %a = arith.mulf %old, %c : f32
        %b = arith.addf %a, %value : f32
        piko.yield [%b : f32]
      }
      piko.return
    }
  }
}
