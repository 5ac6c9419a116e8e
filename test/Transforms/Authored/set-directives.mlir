// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=plain:schedule=direct_map,plain:lanes=one,waits:schedule=all,waits:split=256,waits:precision=relaxed,waits:ulps=2,all:schedule=serialize,says:schedule=none,says:precision=strict,lanes:lanes=none}))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.source @plain
  piko.source @waits
  piko.source @all
  piko.source @says
  piko.source @lanes
  // A stage that says nothing gets a schedule.
  // CHECK: piko.stage @plain
  // CHECK-NEXT: piko.schedule direct_map lanes one
  // CHECK-NEXT: piko.process {
  piko.stage @plain bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // What it waits for stays.
  // CHECK: piko.stage @waits
  // CHECK-NEXT: piko.schedule all tile_split 256 end_stage [@plain] unordered
  // CHECK-NEXT: piko.process precision relaxed ulps 2 {
  piko.stage @waits bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance end_stage [@plain] unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // A tile split belongs to `all`.
  // CHECK: piko.stage @all
  // CHECK-NEXT: piko.schedule serialize{{$}}
  piko.stage @all bins [0] threads 64 : @F -> [] {
    piko.schedule all tile_split 64
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @says
  // CHECK-NEXT: piko.process precision strict {
  piko.stage @says bins [0] threads 64 : @F -> [] {
    piko.schedule direct_map
    piko.process precision relaxed {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @lanes
  // CHECK-NEXT: piko.schedule load_balance{{$}}
  piko.stage @lanes bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
