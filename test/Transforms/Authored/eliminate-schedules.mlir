// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-eliminate-schedules))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.source @any
  piko.source @map
  piko.source @waits
  piko.source @lists
  // CHECK: piko.stage @any
  // CHECK-NEXT: piko.process
  piko.stage @any bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @map
  // CHECK-NEXT: piko.schedule direct_map
  piko.stage @map bins [0] threads 64 : @F -> [] {
    piko.schedule direct_map
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @waits
  // CHECK-NEXT: piko.schedule load_balance end_stage [@any] resolved
  piko.stage @waits bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance end_stage [@any]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @lists
  // CHECK-NEXT: piko.schedule load_balance batch 4 resolved
  piko.stage @lists bins [0] threads 64 : list @F -> [] {
    piko.schedule load_balance batch 4
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}
