// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages),piko-prune)' --split-input-file --verify-diagnostics %s | FileCheck %s

// `@look` and what only it needs go, and the port after its own moves up. The
// wait for `@drop` becomes one for what came before it.
// CHECK-LABEL: piko.pipeline @Ports
// CHECK:         piko.edge @split[0] -> @keep carried 4
// CHECK-NOT:     piko.edge
// CHECK:         piko.stage @split bins [0] threads 64 lineage 1 : @F -> [@F] {
// CHECK:           piko.emit 0(%{{.*}}) : f32
// CHECK-NOT:       piko.emit
// CHECK:         piko.stage @other bins [0] threads 64 lineage 0 : @F -> [] {
// CHECK-NEXT:      piko.process {
// CHECK-NEXT:      ^bb0
// CHECK-NEXT:      }
// CHECK-NOT:     piko.stage @look
// CHECK:         piko.stage @keep bins [0] threads 64 lineage 4
// CHECK-NOT:     piko.stage @drop
// CHECK:         piko.stage @late bins [0] threads 64 lineage 5
// CHECK-NEXT:      piko.schedule load_balance end_stage [@split, @other]
piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Ports rank 1 {
  piko.buffer @out : @F
  piko.source @other
  piko.source @split
  piko.source @late
  piko.edge @split[0] -> @look
  piko.edge @split[1] -> @keep
  piko.edge @look[0] -> @drop
  // expected-remark @below {{stage 'other' is emptied, because nothing it does can be observed}}
  piko.stage @other bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %y = arith.addf %x, %x : f32
      piko.return
    }
  }
  piko.stage @split bins [0] threads 64 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %y = arith.addf %x, %x : f32
      piko.emit 0 (%y) : f32
      piko.emit 1 (%x) : f32
      piko.return
    }
  }
  // A test has found that the bin is inside.
  // expected-remark @below {{stage 'look' is removed, because nothing it does can be observed}}
  piko.stage @look bins [8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %c = arith.constant 3 : i32
      %b = piko.bin_at %c : i32
      %i = arith.index_cast %b : index to i64
      %none = arith.constant -1 : i64
      %outside = arith.cmpi eq, %i, %none : i64
      scf.if %outside {
      } else {
        piko.assign_to %b
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      piko.emit 0 (%x) : f32
      piko.return
    }
  }
  // expected-remark @below {{stage 'drop' is removed, because nothing it does can be observed}}
  piko.stage @drop bins [0] threads 64 : list @F -> [] {
    piko.schedule load_balance end_stage [@other]
    piko.process {
    ^bb0(%f: !piko.list<@F>):
      piko.return
    }
  }
  piko.stage @keep bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      piko.store %x, @out[%i : index] "x" : f32
      piko.return
    }
  }
  piko.stage @late bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance end_stage [@drop]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 1 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      piko.store %x, @out[%i : index] "x" : f32
      piko.return
    }
  }
}

// -----

// What may end with an error stays: a bin that nothing has tested, a cycle, a
// schedule that a run computes, a barrier.
// CHECK-LABEL: piko.pipeline @Errors
// CHECK-DAG:     piko.edge @errors[0] -> @cycle
// CHECK-DAG:     piko.edge @cycle[0] -> @cycle
// CHECK:         piko.stage @errors
// CHECK:           piko.assign_to
// CHECK:           piko.emit 0
// CHECK:         piko.stage @cycle
// CHECK:           piko.emit 0
// CHECK-LABEL: piko.pipeline @MoreErrors
// CHECK:         piko.edge @scheduled[0] -> @barrier
// CHECK:           piko.set_batch
// CHECK:           piko.emit 0
// CHECK:           piko.sync
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Errors rank 1 {
  piko.source @errors
  // expected-remark @below {{edge to stage 'cycle' carries 1 instead of 4 bytes}}
  piko.edge @errors[0] -> @cycle
  // expected-remark @below {{edge to stage 'cycle' carries 1 instead of 4 bytes}}
  piko.edge @cycle[0] -> @cycle
  piko.stage @errors bins [8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x : i32
      %zero = arith.constant 0 : index
      %outside = arith.cmpi slt, %b, %zero : index
      scf.if %outside {
        piko.assign_to %b
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-note @below {{nothing depends on 'x'}}
  piko.stage @cycle bins [0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
}
piko.pipeline @MoreErrors rank 1 {
  piko.source @scheduled
  // expected-remark @below {{edge to stage 'barrier' carries 1 instead of 4 bytes}}
  piko.edge @scheduled[0] -> @barrier
  piko.stage @scheduled bins [0] threads 64 : list @F -> [@F] {
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %n = arith.index_cast %bin : index to i64
      piko.set_batch %n
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.list<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-note @below {{nothing depends on 'x'}}
  piko.stage @barrier bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %n = arith.constant 8 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.sync
        piko.yield
      }
      piko.return
    }
  }
}
