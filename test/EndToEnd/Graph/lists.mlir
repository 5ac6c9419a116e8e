// The text of the dialect, written by hand, which goes the way of C++ from there on:
// batches that depend on the bin, empty bins, and iterations that emit.
// RUN: %compare_targets %s --reference %S/../Inputs/lists.cpp --cases %s
// CASE: --count 1000
// CASE: --count 9

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4, "value" : f32 at 8, "tag" : i32 at 12} size 16 align 4
piko.record @Settings {"batch" : i32 at 0} size 4 align 4
piko.record @Pixel {"sum" : f32 at 0} size 4 align 4

piko.pipeline @Lists rank 2 {
  piko.constant @settings : @Settings
  piko.image @image : @Pixel rank 2
  piko.source @gather
  piko.edge @gather[0] -> @blend

  piko.stage @gather bins [16, 16] threads 64 : list @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %five = arith.constant 5 : i32
      %x0 = arith.subi %x, %five : i32
      piko.assign_box [%x0, %y : i32, i32] to [%x, %y : i32, i32]
      piko.return
    }
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %setting = piko.load @settings "batch" : i32
      %wide = arith.extsi %setting : i32 to i64
      %number = arith.index_cast %bin : index to i64
      %one = arith.constant 1 : i64
      %two = arith.constant 2 : i64
      %seven = arith.constant 7 : i64
      %zero = arith.constant 0 : i64
      %sum = arith.addi %wide, %number : i64
      %rest = arith.remsi %sum, %seven : i64
      %n = arith.addi %rest, %one : i64
      piko.set_batch %n
      %odd = arith.remsi %number, %two : i64
      %even = arith.cmpi eq, %odd, %zero : i64
      scf.if %even {
        piko.set_every_bin
      }
      piko.return
    }
    piko.process {
    ^bb0(%list: !piko.list<@Point>):
      %n = piko.list_size %list : !piko.list<@Point>
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %nothing = arith.constant 0.0 : f32
      %half = arith.constant 0.5 : f32
      %sum = scf.for %i = %zero to %n step %one iter_args(%s = %nothing) -> f32 {
        %p = piko.list_at %list[%i] : !piko.list<@Point> -> !piko.prim<@Point>
        %value = piko.get %p "value" : !piko.prim<@Point> -> f32
        %t = arith.mulf %s, %half : f32
        %u = arith.addf %t, %value : f32
        scf.yield %u : f32
      }
      %bin = piko.bin
      %lo0 = piko.bin_lo %bin[0]
      %lo1 = piko.bin_lo %bin[1]
      %x0 = arith.index_cast %lo0 : index to i32
      %y0 = arith.index_cast %lo1 : index to i32
      %size = arith.index_cast %n : index to i32
      piko.emit 0 (%x0, %y0, %sum, %size) : i32, i32, f32, i32
      piko.parallel_for %n {
      ^bb0(%i: index):
        %last = arith.subi %n, %one : index
        %back = arith.subi %last, %i : index
        %p = piko.list_at %list[%back] : !piko.list<@Point> -> !piko.prim<@Point>
        %x = piko.get %p "x" : !piko.prim<@Point> -> i32
        %y = piko.get %p "y" : !piko.prim<@Point> -> i32
        %value = piko.get %p "value" : !piko.prim<@Point> -> f32
        %tag = piko.get %p "tag" : !piko.prim<@Point> -> i32
        %v = arith.addf %value, %sum : f32
        piko.emit 0 (%x, %y, %v, %tag) : i32, i32, f32, i32
        %two = arith.constant 2 : i32
        %none = arith.constant 0 : i32
        %odd = arith.remsi %tag, %two : i32
        %even = arith.cmpi eq, %odd, %none : i32
        scf.if %even {
          piko.emit 0 (%x0, %y, %v, %tag) : i32, i32, f32, i32
        }
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
