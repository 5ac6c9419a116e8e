// RUN: piko-compare %s --reference %S/Inputs/barriers.cpp --count 1000 | FileCheck %s
// RUN: piko-compare %s --reference %S/Inputs/barriers.cpp --count 17 | FileCheck %s
// CHECK: equal

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Pixel {"sum" : f32 at 0} size 4 align 4

piko.pipeline @Barriers rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @mix
  piko.edge @mix[0] -> @blend

  piko.stage @mix bins [16, 16] threads 64 : list @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %five = arith.constant 5 : i32
      %x0 = arith.subi %x, %five : i32
      piko.assign_box [%x0, %y : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%list: !piko.list<@Point>):
      %n = piko.list_size %list : !piko.list<@Point>
      %c0 = arith.constant 0 : index
      %c1 = arith.constant 1 : index
      %c2 = arith.constant 2 : index
      %c3 = arith.constant 3 : index
      %c64 = arith.constant 64 : index
      %shared = memref.alloca() : memref<64xf32>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %mine = memref.alloca() : memref<3xf32>
        %p = piko.list_at %list[%i] : !piko.list<@Point> -> !piko.prim<@Point>
        %x = piko.get %p "x" : !piko.prim<@Point> -> i32
        %y = piko.get %p "y" : !piko.prim<@Point> -> i32
        %value = piko.get %p "value" : !piko.prim<@Point> -> f32
        %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
        %two = arith.constant 2.0 : f32
        %three = arith.constant 3.0 : f32
        %twice = arith.mulf %value, %two : f32
        %thrice = arith.mulf %value, %three : f32
        memref.store %value, %mine[%c0] : memref<3xf32>
        memref.store %twice, %mine[%c1] : memref<3xf32>
        memref.store %thrice, %mine[%c2] : memref<3xf32>
        %own = arith.remui %i, %c64 : index
        memref.store %value, %shared[%own] : memref<64xf32>
        piko.emit 0 (%x, %y, %value, %tag) : i32, i32, f32, i32
        piko.sync
        %i1 = arith.addi %i, %c1 : index
        %i1n = arith.remui %i1, %n : index
        %next = arith.remui %i1n, %c64 : index
        %fromNext = memref.load %shared[%next] : memref<64xf32>
        %t = arith.index_cast %tag : i32 to index
        %place = arith.remui %t, %c3 : index
        %old = memref.load %mine[%place] : memref<3xf32>
        %new = arith.addf %old, %fromNext : f32
        memref.store %new, %mine[%place] : memref<3xf32>
        %total = piko.reduce %value : f32 {
        ^bb0(%a: f32, %b: f32):
          %weight = arith.constant 0.75 : f32
          %weighed = arith.mulf %b, %weight : f32
          %c = arith.addf %a, %weighed : f32
          piko.yield results [%c : f32]
        }
        %half = arith.constant 0.5 : f32
        %iInt = arith.index_cast %i : index to i32
        %iFloat = arith.sitofp %iInt : i32 to f32
        %empty = arith.addf %iFloat, %half : f32
        %before = piko.scan %value empty %empty : f32 {
        ^bb0(%a: f32, %b: f32):
          %weight = arith.constant 0.75 : f32
          %weighed = arith.mulf %b, %weight : f32
          %c = arith.addf %a, %weighed : f32
          piko.yield results [%c : f32]
        }
        %rank = piko.sort %value : f32
        %q = piko.list_at %list[%rank] : !piko.list<@Point> -> !piko.prim<@Point>
        %qx = piko.get %q "x" : !piko.prim<@Point> -> i32
        %qy = piko.get %q "y" : !piko.prim<@Point> -> i32
        %t1 = arith.addi %t, %c1 : index
        %place1 = arith.remui %t1, %c3 : index
        %mine1 = memref.load %mine[%place1] : memref<3xf32>
        %mineTotal = arith.addf %mine1, %total : f32
        %qValue = arith.addf %mineTotal, %before : f32
        %qTag = arith.index_cast %rank : index to i32
        piko.emit 0 (%qx, %qy, %qValue, %qTag) : i32, i32, f32, i32
        %one = arith.constant 1 : i32
        %size = arith.index_cast %n : index to i32
        %end, %sum = scf.while (%stride = %one, %s = %qValue) : (i32, f32) -> (i32, f32) {
          %goesOn = arith.cmpi slt, %stride, %size : i32
          scf.condition(%goesOn) %stride, %s : i32, f32
        } do {
        ^bb0(%stride: i32, %s: f32):
          %strideIndex = arith.index_cast %stride : i32 to index
          %far = arith.addi %i, %strideIndex : index
          %farN = arith.remui %far, %n : index
          %farPlace = arith.remui %farN, %c64 : index
          %other = memref.load %shared[%farPlace] : memref<64xf32>
          piko.sync
          %otherSum = arith.addf %other, %s : f32
          memref.store %otherSum, %shared[%own] : memref<64xf32>
          %halved = arith.mulf %s, %half : f32
          %nextSum = arith.addf %halved, %other : f32
          %four = arith.constant 4 : i32
          %rest = arith.remsi %stride, %four : i32
          %isOne = arith.cmpi eq, %rest, %one : i32
          scf.if %isOne {
            piko.emit 0 (%x, %y, %nextSum, %stride) : i32, i32, f32, i32
          }
          piko.sync
          %doubled = arith.addi %stride, %stride : i32
          scf.yield %doubled, %nextSum : i32, f32
        }
        %ten = arith.constant 10.0 : f32
        %large = arith.cmpf ogt, %total, %ten : f32
        %last = scf.if %large -> f32 {
          %none = arith.constant 0.0 : f32
          %scanned = piko.scan %sum empty %none : f32 {
          ^bb0(%a: f32, %b: f32):
            %weight = arith.constant 0.75 : f32
            %weighed = arith.mulf %b, %weight : f32
            %c = arith.addf %a, %weighed : f32
            piko.yield results [%c : f32]
          }
          scf.yield %scanned : f32
        } else {
          %negative = arith.negf %sum : f32
          scf.yield %negative : f32
        }
        piko.emit 0 (%qx, %qy, %last, %qTag) : i32, i32, f32, i32
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
