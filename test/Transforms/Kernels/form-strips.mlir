// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-program,piko-form-strips))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// Two branches that come from one primitive meet again: all of it is one group,
// and the first stage may wait for what runs before. Its tile is the chunk.
// CHECK-LABEL: piko.pipeline @Diamond
// CHECK:         piko.program roots [@split] {
// CHECK:           %[[BEFORE:.*]] = piko.feed 0
// CHECK-NEXT:      piko.join @before
// CHECK-NEXT:      piko.launch @kernel_before
// CHECK-NEXT:      %[[IN:.*]] = piko.feed 1
// CHECK-NEXT:      piko.strips(%[[IN]]) chunk 256 {
// CHECK-NEXT:      ^bb0(%[[STRIP:.*]]: !piko.edge<@F>):
// CHECK-NEXT:        piko.wait @before
// CHECK-NEXT:        %[[SPLIT:.*]] = piko.join @split(concatenate %[[STRIP]])
// CHECK-NEXT:        %[[OUT:.*]]:2 = piko.launch @kernel_split(%[[SPLIT]])
// CHECK-NEXT:        piko.join @left(concatenate %[[OUT]]#0 keys 2) keeps 2
// CHECK-NEXT:        %[[LEFT:.*]] = piko.launch @kernel_left
// CHECK-NEXT:        piko.join @meet merge(concatenate %[[OUT]]#1 keys 2, concatenate %[[LEFT]] keys 3)
// CHECK-NEXT:        piko.launch @kernel_meet
// CHECK-NEXT:        piko.leave
// CHECK-NEXT:      } : (!piko.edge<@F>) -> ()
piko.pipeline @Diamond rank 1 {
  piko.image @seen_meet : @F rank 1
  piko.source @before
  piko.source @split
  piko.edge @split[0] -> @left
  piko.edge @split[1] -> @meet
  piko.edge @left[0] -> @meet
  piko.stage @before bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @split bins [0] threads 1 : @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule all tile_split 256 end_stage [@before]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  piko.stage @left bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @meet bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen_meet[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// A cycle that collects nothing runs to its end for each strip; the list after
// it has all strips.
// CHECK-LABEL: piko.pipeline @Loop
// CHECK:           %[[LEFT:.*]] = piko.strips(%{{.*}}) {
// CHECK:             piko.launch @kernel_start
// CHECK-NEXT:        %[[WAVES:.*]] = piko.waves
// CHECK:             piko.leave %[[WAVES]]
// CHECK-NEXT:      }
// CHECK-NEXT:      %[[BINS:.*]] = piko.join @list(concatenate %[[LEFT]])
// CHECK-NEXT:      piko.launch @kernel_list(%[[BINS]])
piko.pipeline @Loop rank 1 {
  piko.source @start
  piko.edge @start[0] -> @again
  piko.edge @again[0] -> @again
  piko.edge @again[1] -> @list
  piko.stage @start bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @again bins [0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : i32
      %more = arith.cmpi ne, %x, %zero : i32
      scf.if %more {
        piko.emit 0 (%zero) : i32
      } else {
        piko.emit 1 (%x) : i32
      }
      piko.return
    }
  }
  piko.stage @list bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%f: !piko.list<@F>):
      piko.return
    }
  }
}
