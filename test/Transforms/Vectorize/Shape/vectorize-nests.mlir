// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

piko.record @P {"k" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Eight searches, each of which ends when it has found something: one loop, in
// whose iterations lanes are in different searches. A search goes on, or it adds what
// it has found, and the next one begins. An iteration waits for a gather, so that two
// vectors take turns.
// CHECK-LABEL: piko.pipeline @Searches
// CHECK:         scf.while
// CHECK-SAME:      vector<32xi1>
// CHECK:         } do {
// CHECK:           piko.cpu.gather @table
// CHECK-NOT:     scf.while
// CHECK:         piko.cpu.scatter
piko.pipeline @Searches rank 1 {
  piko.buffer @table : @N
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %c8 = arith.constant 8 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once}}
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        // expected-note@+1 {{lanes go on in this loop each by itself, however often the loop inside iterates}}
        %all:2 = scf.while (%sum = %c0, %x = %c0) : (i32, i32) -> (i32, i32) {
          %more = arith.cmpi slt, %x, %c8 : i32
          scf.condition(%more) %sum, %x : i32, i32
        } do {
        ^bb0(%sum: i32, %x: i32):
          %first = arith.muli %k, %x : i32
          %found:2 = scf.while (%at = %first) : (i32) -> (i32, i32) {
            // expected-note@+1 {{lanes read 'table' in different places, by a gather}}
            %0 = piko.load checked @table[%at : i32] "n" : i32
            %1 = arith.muli %0, %0 : i32
            %2 = arith.addi %1, %0 : i32
            %3 = arith.xori %2, %k : i32
            %goes = arith.cmpi sgt, %3, %k : i32
            scf.condition(%goes) %at, %0 : i32, i32
          } do {
          ^bb0(%at: i32, %0: i32):
            %next = arith.addi %at, %c1 : i32
            scf.yield %next : i32
          }
          %more = arith.addi %sum, %found#1 : i32
          %next = arith.addi %x, %c1 : i32
          scf.yield %more, %next : i32, i32
        }
        piko.store %all#0, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// -----

piko.record @P {"k" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Loops whose ends are a fixed number of iterations from where they begin do not
// differ: only the loop around them does.
// CHECK-LABEL: piko.pipeline @Alike
// CHECK:         scf.while
// CHECK:           scf.while
piko.pipeline @Alike rank 1 {
  piko.buffer @table : @N
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %c8 = arith.constant 8 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      // expected-remark@+2 {{stage 'a': process is vectorized for 16 primitives at once}}
      // expected-note@+1 {{lanes go on in this loop each by itself}}
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %n = piko.get %p "n" : !piko.prim<@P> -> i32
        %end = arith.addi %n, %c8 : i32
        %all = scf.for %x = %c0 to %k step %c1 iter_args(%sum = %c0) -> i32 : i32 {
          %part = scf.for %y = %n to %end step %c1 iter_args(%s = %sum) -> i32 : i32 {
            %0 = arith.muli %s, %y : i32
            %1 = arith.xori %0, %x : i32
            scf.yield %1 : i32
          }
          scf.yield %part : i32
        }
        piko.store %all, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// -----

piko.record @P {"k" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// What is painted last is seen: the loops stay, and lanes take turns.
// CHECK-LABEL: piko.pipeline @Ordered
// CHECK:         scf.while
// CHECK:           scf.for
// CHECK:             scf.for
// CHECK:               piko.store %{{.*}}, checked @picture
piko.pipeline @Ordered rank 1 {
  piko.image @picture : @N rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %n = piko.get %p "n" : !piko.prim<@P> -> i32
        // expected-note@+1 {{lanes take turns to go through this loop, because an order shows of what it does}}
        scf.for %x = %c0 to %k step %c1 : i32 {
          scf.for %y = %x to %n step %c1 : i32 {
            %old = piko.load checked @picture[%y : i32] "n" : i32
            %0 = arith.muli %old, %k : i32
            %1 = arith.addi %0, %x : i32
            piko.store %1, checked @picture[%y : i32] "n" : i32
          }
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// -----

piko.record @P {"x" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @N {"x" : f32 at 0} size 4 align 4

// A loop by itself, long for some primitives: each lane takes every sixteenth
// primitive, and waits with the next one until three eighths of the lanes need
// one, or none has anything else to do. All primitives are
// counted after it.
// CHECK-LABEL: piko.pipeline @Iterates
// CHECK:         piko.cpu.items
// CHECK:         scf.while
// CHECK:         } do {
// CHECK:           scf.for
// CHECK:             arith.divf
// CHECK:           %[[WAITING:.*]] = math.ctpop %{{.*}} : i16
// CHECK:           arith.cmpi ult, %[[WAITING]], %c6_i16 : i16
// CHECK:           piko.cpu.scatter %{{.*}}, @out
// CHECK:           piko.cpu.items %{{.*}}[%{{.*}} : vector<16xindex>]
// CHECK-NOT:     scf.while
// CHECK:         %[[COUNTED:.*]] = piko.cpu.is_counted
// CHECK:         scf.if %[[COUNTED]] {
// CHECK-NEXT:      scf.for
// CHECK-NEXT:        piko.storage.next
piko.pipeline @Iterates rank 1 {
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c4 = arith.constant 4 : index
    %one = arith.constant 1.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@P>
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      // expected-remark@+2 {{stage 'a': process is vectorized for 16 primitives at once}}
      // expected-note@+1 {{lanes go on in this loop each by itself}}
      scf.for %i = %lo to %hi step %c1 {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %x = piko.get %p "x" : !piko.prim<@P> -> f32
        %last = scf.while (%at = %x) : (f32) -> f32 {
          %next = scf.for %j = %c0 to %c4 step %c1 iter_args(%y = %at) -> f32 {
            %0 = arith.divf %y, %x : f32
            %1 = math.sqrt %0 : f32
            %2 = arith.divf %1, %y : f32
            %3 = arith.divf %2, %0 : f32
            %4 = math.sqrt %3 : f32
            scf.yield %4 : f32
          }
          %goes = arith.cmpf olt, %next, %one : f32
          scf.condition(%goes) %next : f32
        } do {
        ^bb0(%at: f32):
          scf.yield %at : f32
        }
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        piko.store %last, checked @out[%k : i32] "x" : f32
        piko.storage.next %writer
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %writer
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}
