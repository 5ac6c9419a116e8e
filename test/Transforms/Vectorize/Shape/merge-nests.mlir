// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=8 merge-gain=1000}))' --split-input-file %s 2>/dev/null | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=8 merge-gain=1000},piko-vectorize),canonicalize,cse)' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefix=LANES
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=8 merge-gain=0}))' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefix=NEVER

piko.record @P {"k" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// A loop under a condition, in a loop, with the loop over primitives: one loop, in
// each turn of which lanes make an iteration of the innermost one, or all else.
// CHECK-LABEL: piko.pipeline @Nest
// CHECK:         scf.for
// CHECK-NOT:       memref<1xindex>
// CHECK:           scf.while
// CHECK:             %[[SIDE:.*]], %[[TAKES:.*]] = piko.cpu.elect %{{.*}} second 3
// CHECK:             scf.if %[[SIDE]]
// CHECK:               scf.if %[[TAKES]]
// CHECK:                 arith.xori
// CHECK:             } else {
// CHECK:               scf.if %[[TAKES]]
// CHECK:                 math.sqrt
// CHECK-NOT:     scf.while
// CHECK:         } {piko.lanes, piko.mapping = #piko<lanes items>, piko.vector_lanes = 8 : i64}

// By their numbers: the second side from three eighths on. Who waits keeps what it has.
// LANES-LABEL: piko.pipeline @Nest
// LANES:         scf.while
// LANES:           %[[FIRST:.*]] = math.ctpop %[[A:.*]] : i8
// LANES:           %[[THREE:.*]] = arith.muli %[[FIRST]], %c3_i8
// LANES:           %[[SECOND:.*]] = math.ctpop %[[B:.*]] : i8
// LANES:           %[[FIVE:.*]] = arith.muli %[[SECOND]], %c5_i8
// LANES:           %[[SIDE:.*]] = arith.cmpi ugt, %[[THREE]], %[[FIVE]]
// LANES:           %[[BITS:.*]] = arith.select %[[SIDE]], %[[A]], %[[B]]
// LANES:           %[[VECTOR:.*]] = vector.broadcast %[[BITS]] : i8 to vector<1xi8>
// LANES:           %[[TAKES:.*]] = vector.bitcast %[[VECTOR]] : vector<1xi8> to vector<8xi1>
// LANES:           scf.if %[[SIDE]]
// LANES:             %[[NEW:.*]] = arith.xori
// LANES:             arith.select %[[TAKES]]

// NEVER-LABEL: piko.pipeline @Nest
// NEVER-NOT:     piko.cpu.elect
// NEVER:         piko.vector_lanes = 8
piko.pipeline @Nest rank 1 {
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %c7 = arith.constant 7 : i32
    %zero = arith.constant 0.0 : f32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %n = piko.get %p "n" : !piko.prim<@P> -> i32
        %all:2 = scf.while (%sum = %zero, %x = %c0) : (f32, i32) -> (f32, i32) {
          %more = arith.cmpi slt, %x, %n : i32
          scf.condition(%more) %sum, %x : f32, i32
        } do {
        ^bb0(%sum: f32, %x: i32):
          %first = arith.muli %k, %x : i32
          %some = arith.cmpi ne, %first, %c7 : i32
          %found = scf.if %some -> (i32) {
            %last = scf.while (%at = %first) : (i32) -> i32 {
              %goes = arith.cmpi sgt, %at, %c7 : i32
              scf.condition(%goes) %at : i32
            } do {
            ^bb0(%at: i32):
              %half = arith.shrsi %at, %c1 : i32
              %next = arith.xori %half, %x : i32
              scf.yield %next : i32
            }
            %odd = arith.addi %last, %x : i32
            scf.yield %odd : i32
          } else {
            scf.yield %k : i32
          }
          %float = arith.sitofp %found : i32 to f32
          %root = math.sqrt %float : f32
          %next = arith.addf %sum, %root : f32
          %other = arith.addi %x, %c1 : i32
          scf.yield %next, %other : f32, i32
        }
        %whole = arith.fptosi %all#0 : f32 to i32
        piko.store %whole, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// -----

piko.record @P {"k" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// A range inside of a loop, whose ends lanes have of their own, is not merged: ranges
// differ little.
// CHECK-LABEL: piko.pipeline @Range
// CHECK-NOT:     piko.cpu.elect
// CHECK:         piko.storage.close_bins
piko.pipeline @Range rank 1 {
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %n = piko.get %p "n" : !piko.prim<@P> -> i32
        %sum = scf.for %x = %c0 to %n step %c1 iter_args(%s = %k) -> (i32) : i32 {
          %t = arith.muli %s, %s : i32
          %v = arith.xori %t, %x : i32
          %w = arith.muli %v, %t : i32
          scf.yield %w : i32
        }
        piko.store %sum, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}
