// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-pre-schedule))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @N {"v" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.constant @split : @N
  piko.source @same
  piko.source @fixed
  piko.source @bin
  piko.source @constant
  piko.source @loop
  piko.source @never
  // All ways end with the same, whatever was said before.
  // CHECK: piko.stage @same
  // CHECK-NEXT: piko.schedule all tile_split 16 batch 4 every_bin resolved{{$}}
  piko.stage @same bins [0] threads 64 : list @F -> [] {
    piko.schedule direct_map batch 4 dynamic {
    ^bb0(%bin: index):
      %one = arith.constant 1 : index
      %odd = arith.cmpi eq, %bin, %one : index
      %serialize = arith.constant 2 : i32
      %all = arith.constant 3 : i32
      %none = arith.constant 0 : i64
      %split = arith.constant 16 : i64
      scf.if %odd {
        piko.set_schedule %serialize tile_split %none
        piko.set_schedule %all tile_split %split
        piko.set_every_bin
      } else {
        piko.set_every_bin
        piko.set_schedule %all tile_split %split
      }
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
  // A tile split has no effect on another kind; waits stay.
  // CHECK: piko.stage @fixed
  // CHECK-NEXT: piko.schedule serialize end_stage [@same] resolved{{$}}
  piko.stage @fixed bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance end_stage [@same] dynamic {
    ^bb0(%bin: index):
      %serialize = arith.constant 2 : i32
      %split = arith.constant 16 : i64
      piko.set_schedule %serialize tile_split %split
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @bin
  // CHECK-NEXT: piko.schedule load_balance dynamic
  piko.stage @bin bins [0] threads 64 : @F -> [] {
    // expected-remark @below {{stage 'bin' is scheduled bin by bin}}
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %one = arith.constant 1 : index
      %odd = arith.cmpi eq, %bin, %one : index
      %serialize = arith.constant 2 : i32
      %none = arith.constant 0 : i64
      // expected-note @below {{this may be another for another bin}}
      scf.if %odd {
        piko.set_schedule %serialize tile_split %none
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @constant
  // CHECK-NEXT: piko.schedule load_balance dynamic
  piko.stage @constant bins [0] threads 64 : @F -> [] {
    // expected-remark @below {{stage 'constant' is scheduled bin by bin}}
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %all = arith.constant 3 : i32
      %v = piko.load @split "v" : i32
      %split = arith.extsi %v : i32 to i64
      // expected-note @below {{this may be another for another bin}}
      piko.set_schedule %all tile_split %split
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // A loop may say nothing, unless that is the same.
  // CHECK: piko.stage @loop
  // CHECK-NEXT: piko.schedule direct_map resolved{{$}}
  piko.stage @loop bins [0] threads 64 : @F -> [] {
    piko.schedule direct_map dynamic {
    ^bb0(%bin: index):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %map = arith.constant 1 : i32
      %none = arith.constant 0 : i64
      scf.for %i = %zero to %bin step %one {
        piko.set_schedule %map tile_split %none
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // What is an error when the pipeline runs stays one.
  // CHECK: piko.stage @never
  // CHECK-NEXT: piko.schedule load_balance dynamic
  piko.stage @never bins [0] threads 64 : list @F -> [] {
    // expected-remark @below {{stage 'never' is scheduled bin by bin}}
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %none = arith.constant 0 : i64
      // expected-note @below {{this may be another for another bin}}
      piko.set_batch %none
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}
