// RUN: piko-opt %s | piko-opt | FileCheck %s
// Stages, the three phases, and every directive.

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @Phases
piko.pipeline @Phases rank 2 {
  piko.source @all
  piko.source @waits
  piko.source @maps
  piko.source @serial
  piko.source @collects
  // CHECK: piko.stage @all bins [8, 16] threads 64 : @F -> [] {
  // CHECK-NEXT: piko.assign {
  // CHECK-NEXT: ^bb0(%[[PRIM:.*]]: !piko.prim<@F>):
  // CHECK-NEXT: piko.assign_all
  // CHECK: piko.schedule all tile_split 256
  // CHECK-NEXT: piko.process {
  piko.stage @all bins [8, 16] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule all tile_split 256
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @waits bins [0, 0] threads 1 lineage 4 tile 32 split placed : @F -> []
  // CHECK-NEXT: piko.schedule load_balance end_stage [@all, @maps]
  piko.stage @waits bins [0, 0] threads 1 lineage 4 tile 32 split placed : @F -> [] {
    piko.schedule load_balance end_stage [@all, @maps]
  }
  // CHECK: piko.stage @maps label "Maps (1)" bins
  // CHECK-NEXT: piko.schedule direct_map end_bin
  piko.stage @maps label "Maps (1)" bins [0, 0] threads 1 : @F -> [] {
    piko.schedule direct_map end_bin
  }
  // CHECK: piko.schedule serialize unordered
  piko.stage @serial bins [0, 0] threads 1 : @F -> [] {
    piko.schedule serialize unordered
  }
  // CHECK: piko.stage @collects bins [0, 0] threads 1 lineage 5 split ordered : list @F -> []
  // CHECK-NEXT: piko.schedule load_balance batch 32 every_bin
  piko.stage @collects bins [0, 0] threads 1 lineage 5 split ordered : list @F -> [] {
    piko.schedule load_balance batch 32 every_bin
  }
}

// What a schedule says about each bin.
// CHECK-LABEL: piko.pipeline @Dynamic
piko.pipeline @Dynamic rank 2 {
  piko.source @a
  piko.stage @a bins [8, 8] threads 64 : list @F -> [] {
    // CHECK: piko.schedule all tile_split 8 batch 4 dynamic {
    // CHECK-NEXT: ^bb0(%{{.*}}: index):
    piko.schedule all tile_split 8 batch 4 dynamic {
    ^bb0(%bin: index):
      %kind = arith.constant 3 : i32
      %n = arith.constant 64 : i64
      // CHECK: piko.set_schedule %[[KIND:.*]] tile_split %[[N:.*]]
      // CHECK-NEXT: piko.set_batch %[[N]]
      // CHECK-NEXT: piko.set_every_bin
      // CHECK-NEXT: piko.return
      piko.set_schedule %kind tile_split %n
      piko.set_batch %n
      piko.set_every_bin
      piko.return
    }
  }
}
