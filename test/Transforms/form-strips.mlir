// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-strips))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// Two branches that come from one primitive meet again: all of it is one group,
// and the first stage may wait for what runs before. Its tile is the chunk.
// CHECK-LABEL: piko.pipeline @Diamond
// CHECK-NOT:     piko.strips
// CHECK:         piko.kernel @kernel_before
// CHECK-NOT:     piko.strips
// CHECK:         piko.strips source 1 [@kernel_split, @kernel_left, @kernel_meet] chunk 256
// CHECK-NEXT:    piko.kernel @kernel_split
// CHECK-NOT:     piko.strips
piko.pipeline @Diamond rank 1 {
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
      piko.return
    }
  }
}

// A cycle that collects nothing runs to its end for each strip; the list behind
// it has all strips.
// CHECK-LABEL: piko.pipeline @Loop
// CHECK:         piko.strips source 0 [@kernel_start, @kernel_again]
// CHECK-NOT:     chunk
// CHECK:         piko.kernel @kernel_start
// CHECK:         piko.kernel @kernel_list
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
