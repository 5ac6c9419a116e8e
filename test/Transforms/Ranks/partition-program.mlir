// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program,piko-partition-program))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Each rank moves its part of the source. What it emits goes to the owners of
// bins, and needs no keys, as the parts are in the order of ranks; it is theirs
// alone after that, and what they have drawn goes to the first rank.
// CHECK-LABEL: piko.pipeline @Draw
// CHECK:         piko.program ranks {
// CHECK-NEXT:      piko.partition @move parts
// CHECK-NEXT:      piko.partition @draw bins
// CHECK-NEXT:      piko.partition @count bins
// CHECK-NEXT:      piko.common @color of @draw
// CHECK:           %[[SOURCE:.*]] = piko.feed 0
// CHECK-NEXT:      piko.join @move(concatenate %[[SOURCE]])
// CHECK-NEXT:      %[[MOVED:.*]] = piko.launch @kernel_move
// CHECK-NEXT:      %[[HERE:.*]] = piko.exchange %[[MOVED]]
// CHECK-NEXT:      piko.join @draw(concatenate %[[HERE]])
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

// A vertex shader runs on each rank, because what it stores takes longer to send.
// The bins of a source that take long to find are found for a part of it, and
// exchanged. What atomics have changed goes to the owners of pixels.
// CHECK-LABEL: piko.pipeline @Vertices
// CHECK:         piko.partition @shade all
// CHECK-NEXT:    piko.partition @setup parts
// CHECK-NEXT:    piko.partition @fill bins owners blocks
// CHECK-NOT:     piko.common
// CHECK-NOT:     piko.keep @vertices
// CHECK:         piko.launch @kernel_shade
// CHECK-NOT:     piko.share @vertices
// CHECK:         piko.keep @best cleared
// CHECK-NEXT:    piko.launch @kernel_setup
// CHECK:         %[[BINS:.*]] = piko.launch @source_2_fill
// CHECK:         %[[OWN:.*]] = piko.exchange %[[BINS]]
// CHECK-NEXT:    piko.join @fill(concatenate %[[OWN]])
// CHECK-NEXT:    piko.share @best of @fill to_owners reduce ["n", "max_signed"]
// CHECK-NEXT:    piko.launch @kernel_fill
// CHECK-NEXT:    piko.share @best of @fill to_first
piko.pipeline @Vertices rank 1 {
  piko.image @best : @N rank 1
  piko.buffer @vertices : @N per_source 0
  piko.buffer @table : @N
  piko.source @shade
  piko.source @setup
  piko.source @fill
  piko.stage @shade bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %sum = arith.addi %x, %y : i32
      piko.store %sum, @vertices[%x : i32] "n" : i32
      piko.return
    }
  }
  piko.stage @setup bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance end_stage [@shade]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.load @vertices[%x : i32] "n" : i32
      piko.atomic max_signed @best[%x : i32] "n", %n : i32
      piko.return
    }
  }
  piko.stage @fill bins [8] threads 64 : @F -> [] {
    piko.schedule direct_map end_stage [@setup]
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %many = arith.constant 100 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %most = scf.for %i = %zero to %many step %one iter_args(%m = %x) -> i32 {
        %n = piko.load @table[%i : index] "n" : i32
        %next = arith.maxsi %m, %n : i32
        scf.yield %next : i32
      }
      %b = piko.bin_at %most : i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @best[%x : i32] {
      ^bb0(%n: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// What comes from several sources is in no order of ranks, and so it has keys. A
// loop whose calls may run anywhere is divided as a whole.
// CHECK-LABEL: piko.pipeline @Loops
// CHECK:         piko.partition @first parts
// CHECK-NEXT:    piko.partition @again parts
// CHECK-NEXT:    piko.partition @draw bins
// CHECK:         piko.waves
// CHECK:         %[[HERE:.*]] = piko.exchange
// CHECK-NEXT:    %[[LOOP:.*]] = piko.exchange
// CHECK-NEXT:    piko.join @draw merge(concatenate %[[HERE]] keys 2, concatenate %[[LOOP]] keys 2)
piko.pipeline @Loops rank 1 {
  piko.image @pixels : @N rank 1
  piko.source @first
  piko.source @first
  piko.source @again
  piko.edge @again[0] -> @again
  piko.edge @first[0] -> @draw
  piko.edge @again[1] -> @draw
  piko.stage @first bins [0] threads 64 : @N -> [@N] {
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %n = piko.get %f "n" : !piko.prim<@N> -> i32
      piko.emit 0 (%n) : i32
      piko.return
    }
  }
  piko.stage @again bins [0] threads 64 : @N -> [@N, @N] {
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %one = arith.constant 1 : i32
      %n = piko.get %f "n" : !piko.prim<@N> -> i32
      %next = arith.shrsi %n, %one : i32
      %more = arith.cmpi sgt, %next, %one : i32
      scf.if %more {
        piko.emit 0 (%next) : i32
      } else {
        piko.emit 1 (%next) : i32
      }
      piko.return
    }
  }
  piko.stage @draw bins [8] threads 64 : @N -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@N>):
      %n = piko.get %f "n" : !piko.prim<@N> -> i32
      %b = piko.bin_at %n : i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %n = piko.get %f "n" : !piko.prim<@N> -> i32
      piko.update @pixels[%n : i32] {
      ^bb0(%m: i32):
        piko.yield [%n : i32]
      }
      piko.return
    }
  }
}

// What stays in its bin comes to the first rank all the same, where that alone
// runs the stage: of two kinds of atomics the order shows.
// CHECK-LABEL:   piko.pipeline @First
// CHECK:         piko.program ranks {
// CHECK-NEXT:      piko.partition @draw bins
// CHECK-NOT:       piko.partition
// CHECK:           %[[ALL:.*]] = piko.launch @kernel_draw
// CHECK:           %[[HERE:.*]] = piko.exchange %[[ALL]]
// CHECK:           piko.join @count(concatenate %[[HERE]] keys 2)
piko.pipeline @First rank 2 {
  piko.buffer @counts : @N
  piko.source @draw
  piko.edge @draw[0] -> @count
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
      piko.atomic min_signed @counts[%i : index] "n", %one : i32
      piko.return
    }
  }
}
