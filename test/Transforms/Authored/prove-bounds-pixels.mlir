// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-prove-bounds))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// Which pixels of an image that is written are in the bin, for piko-form-tiles:
// those of a loop over the bin, and not their neighbours. Of the whole domain, and
// of an image that is only read, nobody asks.
// CHECK-LABEL: piko.pipeline @Pixels
piko.pipeline @Pixels rank 1 {
  piko.image @written : @F rank 1
  piko.image @read : @F rank 1
  piko.source @bins
  piko.source @whole
  // CHECK: piko.stage @bins
  // CHECK:   piko.load checked @written[%{{.*}} : i32] "x" {piko.inside} : i32
  // CHECK:   piko.load @written[%{{.*}} : i32] "x" : i32
  // CHECK:   piko.load checked @read[%{{.*}} : i32] "x" : i32
  // CHECK:   piko.store %{{.*}}, checked @written[%{{.*}} : i32] "x" {piko.inside} : i32
  piko.stage @bins bins [8] threads 64 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %one = arith.constant 1 : i32
      %bin = piko.bin
      %lo = piko.bin_lo %bin[0]
      %hi = piko.bin_hi %bin[0]
      %from = arith.index_cast %lo : index to i32
      %to = arith.index_cast %hi : index to i32
      piko.parallel_pixels (%from) to (%to) {
      ^bb0(%x: i32):
        %old = piko.load @written[%x : i32] "x" : i32
        %beside = arith.addi %x, %one : i32
        %other = piko.load @written[%beside : i32] "x" : i32
        %more = piko.load @read[%x : i32] "x" : i32
        %sum = arith.addi %old, %other : i32
        %all = arith.addi %sum, %more : i32
        piko.store %all, @written[%x : i32] "x" : i32
        piko.yield
      }
      piko.return
    }
  }
  // CHECK: piko.stage @whole
  // CHECK:   piko.store %{{.*}}, @written[%{{.*}} : i32] "x" : i32
  piko.stage @whole bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.store %x, @written[%x : i32] "x" : i32
      piko.return
    }
  }
}
