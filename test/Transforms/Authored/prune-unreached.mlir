// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s --split-input-file --verify-diagnostics --pass-pipeline='builtin.module(piko.pipeline(piko-prune-unreached))' | FileCheck %s

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"z" : f32 at 0} size 4 align 4

// A cycle that nothing enters goes as a whole; the port after it moves up.
// CHECK-LABEL: piko.pipeline @Cycle
// CHECK-NOT: piko.edge @shade[0] -> @trace
// CHECK: piko.edge @shade[0] -> @end
// CHECK-NOT: @trace
// CHECK: piko.stage @shade {{.*}} -> [@G] {
// CHECK: piko.emit 0(
piko.pipeline @Cycle rank 1 {
  piko.buffer @out : @F
  piko.source @shade
  piko.edge @shade[0] -> @trace
  piko.edge @shade[1] -> @end
  piko.edge @trace[0] -> @trace
  piko.edge @trace[1] -> @end
  piko.stage @shade bins [0] threads 1 : @F -> [@F, @G] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.emit 1 (%z) : f32
      piko.return
    }
  }
  // expected-remark@+1 {{stage 'trace' is removed, because no primitive can reach it}}
  piko.stage @trace bins [0] threads 1 : @F -> [@F, @G] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.emit 0 (%z) : f32
      piko.emit 1 (%z) : f32
      piko.return
    }
  }
  piko.stage @end bins [0] threads 1 : @G -> [] {
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      %zero = arith.constant 0 : index
      %z = piko.get %g "z" : !piko.prim<@G> -> f32
      piko.store %z, @out[%zero : index] "z" : f32
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4

// A stage that runs for empty bins stays, with its edge, though nothing comes;
// so does one that another waits for.
// CHECK-LABEL: piko.pipeline @Kept
// CHECK: piko.edge @a[0] -> @every
// CHECK: piko.edge @a[1] -> @waited
// CHECK-NOT: @gone
// CHECK: piko.stage @every
// CHECK: piko.stage @waited
piko.pipeline @Kept rank 1 {
  piko.source @a
  piko.source @b
  piko.edge @a[0] -> @every
  piko.edge @a[1] -> @waited
  piko.edge @a[2] -> @gone
  piko.stage @a bins [0] threads 1 : @F -> [@F, @F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@waited]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @every bins [0] threads 1 : list @F -> [] {
    piko.schedule load_balance every_bin
    piko.process {
    ^bb0(%f: !piko.list<@F>):
      piko.return
    }
  }
  piko.stage @waited bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-remark@+1 {{stage 'gone' is removed, because no primitive can reach it}}
  piko.stage @gone bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
