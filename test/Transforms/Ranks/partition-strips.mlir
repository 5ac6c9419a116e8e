// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program,piko-form-strips,piko-partition-program))' --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Each rank has a part of each strip, and ranks exchange what follows from it
// before the next one. Pixels stay with the owners of bins until the end.
// CHECK-LABEL: piko.pipeline @Draw
// CHECK:           %[[SOURCE:.*]] = piko.feed 0
// CHECK-NEXT:      piko.strips(%[[SOURCE]]) {
// CHECK-NEXT:      ^bb0(%[[STRIP:.*]]: !piko.edge<@F>):
// CHECK-NEXT:        piko.join @move(concatenate %[[STRIP]])
// CHECK-NEXT:        %[[MOVED:.*]] = piko.launch @kernel_move
// CHECK-NEXT:        %[[HERE:.*]] = piko.exchange %[[MOVED]]
// CHECK-NEXT:        piko.join @draw(concatenate %[[HERE]])
// CHECK-NEXT:        piko.launch @kernel_draw
// CHECK-NEXT:        piko.leave
// CHECK:           piko.share @color of @draw to_first
piko.pipeline @Draw rank 2 {
  piko.image @color : @F rank 2
  piko.source @move
  piko.edge @move[0] -> @draw
  piko.stage @move bins [0, 0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @draw bins [8, 8] threads 64 : @F -> [] {
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
      piko.return
    }
  }
}

// What leaves strips would have to wait for the last one.
// CHECK-LABEL: piko.pipeline @Leave
// CHECK:           piko.program ranks
// CHECK-NOT:       piko.strips
// CHECK:           piko.exchange
piko.pipeline @Leave rank 2 {
  piko.image @color : @F rank 2
  piko.source @move
  piko.edge @move[0] -> @turn
  piko.edge @turn[0] -> @draw
  // expected-remark@+1 {{ranks run no strips of the source, as what leaves a strip would wait for the last one}}
  piko.stage @move bins [0, 0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @turn bins [0, 0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  // expected-remark@+1 {{stage 'draw' does not run in strips: its process phase takes a list}}
  piko.stage @draw bins [8, 8] threads 64 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%list: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %f = piko.list_at %list[%zero] : !piko.list<@F> -> !piko.prim<@F>
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @color[%x, %y : i32, i32] {
      ^bb0(%r: i32, %g: i32):
        piko.yield [%x, %y : i32, i32]
      }
      piko.return
    }
  }
}

// What one stage adds to the other one takes the largest of, so that ranks
// would bring it together twice in each strip.
// CHECK-LABEL: piko.pipeline @Alternate
// CHECK-NOT:       piko.strips
piko.pipeline @Alternate rank 2 {
  piko.buffer @counts : @N
  piko.source @move
  piko.edge @move[0] -> @draw
  // expected-remark@+1 {{ranks run no strips of the source, as they would share state after each}}
  piko.stage @move bins [0, 0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %i = arith.constant 0 : index
      piko.atomic add @counts[%i : index] "n", %x : i32
      piko.emit 0 (%x, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @draw bins [8, 8] threads 64 : @F -> [] {
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
      %i = arith.constant 0 : index
      piko.atomic max_signed @counts[%i : index] "n", %x : i32
      piko.return
    }
  }
}
