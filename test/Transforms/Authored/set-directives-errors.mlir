// What cannot be set, and why; nothing that could change a result can.
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=c:schedule=serialize}))' %s 2>&1 | FileCheck %s --check-prefix=UNKNOWN
// UNKNOWN: :[[#@LINE+24]]:1: error: piko-set-directives: expected a stage, but got 'c'; the pipeline has 'a', 'b'
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a=serialize}))' %s 2>&1 | FileCheck %s --check-prefix=FORM
// FORM: error: piko-set-directives: expected STAGE:KEY=VALUE, but got 'a=serialize'
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:schedule=never}))' %s 2>&1 | FileCheck %s --check-prefix=SCHEDULE
// SCHEDULE: :[[#@LINE+23]]:3: error: piko-set-directives: cannot set schedule of stage 'a' to 'never': expected load_balance, direct_map, serialize, all or none
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:lanes=two}))' %s 2>&1 | FileCheck %s --check-prefix=LANES
// LANES: error: piko-set-directives: cannot set lanes of stage 'a' to 'two': expected items, iterations, collapsed, one or none
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:precision=fast}))' %s 2>&1 | FileCheck %s --check-prefix=PRECISION
// PRECISION: error: piko-set-directives: cannot set precision of stage 'a' to 'fast': expected strict, contracted or relaxed
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:unordered=true}))' %s 2>&1 | FileCheck %s --check-prefix=RESULTS
// RESULTS: error: piko-set-directives: cannot set unordered of stage 'a' to 'true': expected schedule, split, lanes, precision or ulps, because others may change results
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:split=0}))' %s 2>&1 | FileCheck %s --check-prefix=SPLIT
// SPLIT: error: piko-set-directives: cannot set split of stage 'a' to '0': expected a number of primitives
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:split=8}))' %s 2>&1 | FileCheck %s --check-prefix=ALL
// ALL: error: piko-set-directives: cannot set split of stage 'a' to '8': its schedule is not all
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:schedule=none}))' %s 2>&1 | FileCheck %s --check-prefix=MORE
// MORE: error: piko-set-directives: cannot set schedule of stage 'a' to 'none': its schedule says more than where bins run
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=b:schedule=serialize}))' %s 2>&1 | FileCheck %s --check-prefix=DYNAMIC
// DYNAMIC: :[[#@LINE+16]]:3: error: piko-set-directives: cannot set schedule of stage 'b' to 'serialize': its schedule depends on the bin or on constants
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:lanes=one,a:lanes=items}))' %s 2>&1 | FileCheck %s --check-prefix=TWICE
// TWICE: error: piko-set-directives: cannot set lanes of stage 'a' to 'items': it is set twice

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @P rank 1 {
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance end_stage [@b]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0] threads 64 : @F -> [] {
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %kind = arith.constant 1 : i32
      %split = arith.constant 0 : i64
      piko.set_schedule %kind tile_split %split
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-set-directives{set=a:ulps=none}))' %s 2>&1 | FileCheck %s --check-prefix=ULPS
// ULPS: error: piko-set-directives: cannot set ulps of stage 'a' to 'none': expected a number of units, at least 1
