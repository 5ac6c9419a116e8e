// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-program,piko-form-work,piko-map-threads{threads=32},piko-to-grids))' --split-input-file | FileCheck %s

// What is concatenated needs no positions: nobody asks where it was emitted.
piko.record @F {"x" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.kernel @kernel_copy
// CHECK:         piko.storage.append
// CHECK-NOT:     piko.storage.next
// CHECK-LABEL: piko.kernel @kernel_last
piko.pipeline @Concatenated rank 1 {
  piko.image @sums : @F rank 1
  piko.source @copy
  piko.edge @copy[0] -> @last
  piko.stage @copy bins [0] threads 32 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @last bins [0] threads 32 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @sums[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

// What runs bin by bin is permuted into the order of lineage, by positions.
piko.record @F {"x" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.kernel @kernel_copy
// CHECK:         piko.storage.append
// CHECK:         piko.storage.next
// CHECK:         piko.join @last(permute
piko.pipeline @Permuted rank 1 {
  piko.image @sums : @F rank 1
  piko.source @copy
  piko.edge @copy[0] -> @last
  piko.stage @copy bins [8] threads 32 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @last bins [0] threads 32 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @sums[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}
