// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-program))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-program,piko-form-program))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// A source's kernel gives its primitives bins. What runs bin by bin is permuted
// back, unless its consumer takes it in any order; a stage that collects begins
// a lineage, in the order of its bins.
// CHECK-LABEL: piko.pipeline @Chain
// CHECK:         piko.program roots [@list] {
// CHECK-NEXT:      piko.clear @image, @marks, @spare
// CHECK-NEXT:      %[[IN:.*]] = piko.feed 0 : !piko.edge<@F>
// CHECK-NEXT:      %[[PLACED:.*]] = piko.launch @source_0_binned(%[[IN]]) : (!piko.edge<@F>) -> !piko.edge<@F>
// CHECK-NEXT:      %[[BINNED:.*]] = piko.join @binned(concatenate %[[PLACED]]) : (!piko.edge<@F>) -> !piko.bins<@F>
// CHECK-NEXT:      %[[OUT:.*]]:2 = piko.launch @kernel_binned(%[[BINNED]])
// CHECK-NEXT:      %[[LIST:.*]] = piko.join @list(permute %[[OUT]]#0)
// CHECK-NEXT:      %[[LISTED:.*]] = piko.launch @kernel_list(%[[LIST]])
// CHECK-NEXT:      %[[LAST:.*]] = piko.join @last(concatenate %[[LISTED]])
// CHECK-NEXT:      piko.launch @kernel_last(%[[LAST]]) : (!piko.bins<@F>) -> ()
// CHECK-NEXT:      %[[ANY:.*]] = piko.join @any(concatenate %[[OUT]]#1)
// CHECK-NEXT:      piko.launch @kernel_any(%[[ANY]])
// CHECK-NEXT:    }
piko.pipeline @Chain rank 1 {
  piko.image @image : @F rank 1
  piko.buffer @marks : @F per_source 0
  piko.buffer @spare : @F per_source 0
  piko.buffer @host : @F
  piko.source @binned
  piko.edge @binned[0] -> @list
  piko.edge @binned[1] -> @any
  piko.edge @list[0] -> @last
  piko.stage @binned bins [8] threads 1 : @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.atomic add @marks[%x : i32] "x", %x : i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  piko.stage @list bins [8] threads 1 : list @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %one = arith.constant 1 : i32
      piko.emit 0 (%one) : i32
      piko.return
    }
  }
  piko.stage @last bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @any bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// Where edges meet, all that leads there carries keys: a word from a source, one
// more for each hop. A wait that no edge implies is a statement.
// CHECK-LABEL: piko.pipeline @Merge
// CHECK:         %[[A:.*]] = piko.join @a(concatenate %{{.*}} keys 1) keeps 1
// CHECK-NEXT:    %[[OUT:.*]]:2 = piko.launch @kernel_a(%[[A]])
// CHECK-NEXT:    %[[B:.*]] = piko.join @b(concatenate %[[OUT]]#0 keys 2) keeps 2
// CHECK-NEXT:    %[[BACK:.*]] = piko.launch @kernel_b(%[[B]])
// CHECK-NEXT:    %[[OTHER:.*]] = piko.feed 1
// CHECK-NEXT:    piko.join @meet merge(concatenate %[[OTHER]] keys 1, concatenate %[[OUT]]#1 keys 2, concatenate %[[BACK]] keys 3)
// CHECK-NEXT:    piko.launch @kernel_meet
// CHECK-NEXT:    piko.wait @meet
// CHECK-NEXT:    %[[FREE:.*]] = piko.feed 2
// CHECK-NEXT:    piko.join @free(concatenate %[[FREE]])
piko.pipeline @Merge rank 1 {
  piko.source @a
  piko.source @meet
  piko.source @free
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @meet
  piko.edge @b[0] -> @meet
  piko.stage @a bins [0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.image @last : @F rank 1
  piko.stage @meet bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @last[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
  piko.stage @free bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@meet]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// A sum and a maximum are the same in whatever order: what comes along two edges
// is not merged, and has no keys. Nor is it for a stage that says so.
// CHECK-LABEL: piko.pipeline @Commutes
// CHECK:         piko.join @sum(concatenate %{{.*}}, concatenate %{{.*}}) :
// CHECK:         piko.join @most(concatenate %{{.*}}, concatenate %{{.*}}) :
// CHECK:         piko.join @any(concatenate %{{.*}}, concatenate %{{.*}}) :
// CHECK:         piko.join @both merge(concatenate %{{.*}} keys 1, concatenate %{{.*}} keys 1) :
piko.pipeline @Commutes rank 1 {
  piko.image @sums : @F rank 1
  piko.source @sum
  piko.source @sum
  piko.source @most
  piko.source @most
  piko.source @any
  piko.source @any
  piko.source @both
  piko.source @both
  piko.stage @sum bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @sums[%x : i32] {
      ^bb0(%old: i32):
        %twice = arith.addi %x, %x : i32
        %new = arith.addi %twice, %old : i32
        piko.yield [%new : i32]
      }
      piko.return
    }
  }
  piko.stage @most bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.atomic max_signed @sums[%x : i32] "x", %x : i32
      piko.return
    }
  }
  piko.stage @any bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %old = piko.atomic add @sums[%x : i32] "x", %x : i32 -> i32
      piko.return
    }
  }
  // A sum, and then a maximum, is not what it is the other way around.
  piko.stage @both bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @sums[%x : i32] {
      ^bb0(%old: i32):
        %new = arith.addi %x, %old : i32
        piko.yield [%new : i32]
      }
      piko.update @sums[%x : i32] {
      ^bb0(%old: i32):
        %new = arith.maxsi %old, %x : i32
        piko.yield [%new : i32]
      }
      piko.return
    }
  }
}

// A loop and a stage that collects are rounds: waves first, and then the iteration of
// the list. What it emits goes around.
// CHECK-LABEL: piko.pipeline @Rounds
// CHECK:         %[[DONE:.*]] = piko.rounds(%{{.*}}) {
// CHECK-NEXT:    ^bb0(%[[FIRST:.*]]: !piko.edge<@F>, %[[MORE:.*]]: !piko.edge<@F>):
// CHECK-NEXT:      %[[LEFT:.*]]:2 = piko.waves(%[[FIRST]], %[[MORE]]) keys 2 {
// CHECK-NEXT:      ^bb0(%[[IN:.*]]: !piko.edge<@F>, %[[BACK:.*]]: !piko.edge<@F>, %[[AB:.*]]: !piko.edge<@F>, %[[BA:.*]]: !piko.edge<@F>):
// CHECK-NEXT:        %[[A:.*]] = piko.join @a merge(concatenate %[[IN]] keys 1, concatenate %[[BA]], concatenate %[[BACK]] keys 2)
// CHECK-NEXT:        %[[A_OUT:.*]]:2 = piko.launch @kernel_a(%[[A]])
// CHECK-NEXT:        %[[B:.*]] = piko.join @b(concatenate %[[AB]])
// CHECK-NEXT:        %[[B_OUT:.*]]:2 = piko.launch @kernel_b(%[[B]])
// CHECK-NEXT:        piko.leave %[[A_OUT]]#1, %[[B_OUT]]#1 : !piko.edge<@F>, !piko.edge<@F> again %[[A_OUT]]#0, %[[B_OUT]]#0 : !piko.edge<@F>, !piko.edge<@F>
// CHECK-NEXT:      }
// CHECK-NEXT:      %[[LIST:.*]] = piko.join @list(concatenate %[[LEFT]]#0)
// CHECK-NEXT:      %[[AGAIN:.*]] = piko.launch @kernel_list(%[[LIST]]) turn 0
// CHECK-NEXT:      piko.leave %[[LEFT]]#1 : !piko.edge<@F> again %[[AGAIN]] : !piko.edge<@F>
// CHECK-NEXT:    }
// CHECK-NEXT:    piko.join @last(concatenate %[[DONE]])
piko.pipeline @Rounds rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @list
  piko.edge @b[0] -> @a
  piko.edge @b[1] -> @last
  piko.edge @list[0] -> @a
  piko.stage @a bins [0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @list bins [0] threads 1 : list @F -> [@F] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
  piko.stage @last bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
