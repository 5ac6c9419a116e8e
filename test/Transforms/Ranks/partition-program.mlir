// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program,piko-partition-program))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Each rank moves its part of the source. What it emits goes to the owners of
// bins, with the lineage of source and of the hop; it is theirs alone after that,
// and what they have drawn goes to the first rank.
// CHECK-LABEL: piko.pipeline @Draw
// CHECK:         piko.program ranks {
// CHECK-NEXT:      piko.partition @move parts
// CHECK-NEXT:      piko.partition @draw bins
// CHECK-NEXT:      piko.partition @count bins
// CHECK:           %[[SOURCE:.*]] = piko.feed 0
// CHECK-NEXT:      piko.join @move(concatenate %[[SOURCE]] keys 1) keeps 1
// CHECK-NEXT:      %[[MOVED:.*]] = piko.launch @kernel_move
// CHECK-NEXT:      %[[HERE:.*]] = piko.exchange %[[MOVED]]
// CHECK-NEXT:      piko.join @draw(concatenate %[[HERE]] keys 2)
// CHECK-NEXT:      %[[DRAWN:.*]] = piko.launch @kernel_draw
// CHECK-NEXT:      piko.join @count(concatenate %[[DRAWN]])
// CHECK-NEXT:      piko.keep @counts
// CHECK-NEXT:      piko.launch @kernel_count
// CHECK-DAG:       piko.share @color of @draw to_first
// CHECK-DAG:       piko.share @counts reduce ["n", "add"]
piko.pipeline @Draw rank 2 {
  piko.image @color : @F rank 2
  piko.buffer @counts : @N
  piko.source @move
  piko.edge @move[0] -> @draw
  piko.edge @draw[0] -> @count
  piko.stage @move bins [0, 0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @draw bins [8, 8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @color[%x, %y : i32, i32] {
      ^bb0(%r: i32, %g: i32):
        piko.yield [%x, %r : i32, i32]
      }
      piko.emit 0 (%x, %y) : i32, i32
      piko.return
    }
  }
  piko.stage @count bins [8, 8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : i32
      %i = arith.constant 0 : index
      piko.atomic add @counts[%i : index] "n", %one : i32
      piko.return
    }
  }
}

// A stage that waits begins a lineage by its bins, which takes a word more where
// ranks share them; another one reads all of an image that they have written.
// CHECK-LABEL: piko.pipeline @Wait
// CHECK:         piko.program roots [@draw] ranks {
// CHECK-NEXT:      piko.partition @draw bins
// CHECK-NOT:       piko.partition
// CHECK:           %[[DRAWN:.*]] = piko.launch @kernel_draw
// CHECK:           %[[HERE:.*]] = piko.exchange %[[DRAWN]]
// CHECK-NEXT:      piko.join @last(concatenate %[[HERE]] keys 3)
// CHECK-NEXT:      piko.share @color of @draw
// CHECK-NEXT:      piko.launch @kernel_last
// CHECK-NOT:       piko.share
piko.pipeline @Wait rank 2 {
  piko.image @color : @N rank 2
  piko.source @draw
  piko.edge @draw[0] -> @last
  piko.stage @draw bins [8, 8] threads 64 : list @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%list: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %f = piko.list_at %list[%zero] : !piko.list<@F> -> !piko.prim<@F>
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @color[%x, %y : i32, i32] {
      ^bb0(%n: i32):
        piko.yield [%x : i32]
      }
      piko.emit 0 (%x, %y) : i32, i32
      piko.return
    }
  }
  piko.stage @last bins [0, 0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%list: !piko.list<@F>):
      %zero = arith.constant 0 : i32
      %n = piko.load @color[%zero, %zero : i32, i32] "n" : i32
      piko.return
    }
  }
}
