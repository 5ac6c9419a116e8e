// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-partition-program))' %s 2>&1 | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program,piko-partition-program))' --split-input-file --verify-diagnostics %s

// CHECK: error: expected a piko.program, which piko-form-program makes
piko.record @F {"x" : i32 at 0, "f" : f32 at 4} size 8 align 4
piko.pipeline @Whole rank 1 {
  piko.image @pixels : @F rank 1
  piko.buffer @sums : @F
  piko.source @update
  piko.source @list
  piko.source @add
  piko.source @take
  piko.source @two
  piko.edge @again[0] -> @again
  piko.source @again
  // expected-remark @below {{stage 'update' runs on the first rank alone: it updates pixels, and its only bin is the whole domain; give it bins of a size}}
  piko.stage @update bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @pixels[%x : i32] {
      ^bb0(%old: i32, %z: f32):
        piko.yield [%x, %z : i32, f32]
      }
      piko.return
    }
  }
  // expected-remark @below {{stage 'list' runs on the first rank alone: its only bin is the whole domain, and must be complete; give it bins of a size}}
  piko.stage @list bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%f: !piko.list<@F>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'add' runs on the first rank alone: it adds floats, whose sum depends on the order}}
  piko.stage @add bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %value = piko.get %f "f" : !piko.prim<@F> -> f32
      piko.atomic add_float @sums[%i : index] "f", %value : f32
      piko.return
    }
  }
  // expected-remark @below {{stage 'take' runs on the first rank alone: it uses what an atomic operation returns}}
  piko.stage @take bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %old = piko.atomic add @sums[%i : index] "x", %x : i32 -> i32
      piko.store %old, @sums[%i : index] "x" : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'two' runs on the first rank alone: it changes one field by two kinds of atomic operations}}
  piko.stage @two bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.atomic add @sums[%i : index] "x", %x : i32
      piko.atomic xor @sums[%i : index] "x", %x : i32
      piko.return
    }
  }
  piko.stage @again bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "f" : !piko.prim<@F> -> f32
      piko.emit 0 (%x, %z) : i32, f32
      piko.return
    }
  }
}

// -----

// Loops that are not several ones.
piko.record @L {"x" : i32 at 0} size 4 align 4
piko.pipeline @Loops rank 1 {
  piko.buffer @sums : @L
  piko.source @reads
  piko.source @moves
  piko.source @waits
  piko.edge @reads[0] -> @reads
  // expected-remark @below {{is permuted}}
  piko.edge @moves[0] -> @moves
  piko.edge @waits[0] -> @waits
  // expected-remark @below {{stage 'reads' runs on the first rank alone: it is on a cycle that reads what it writes}}
  piko.stage @reads bins [0] threads 1 : @L -> [@L] {
    piko.process {
    ^bb0(%f: !piko.prim<@L>):
      %x = piko.get %f "x" : !piko.prim<@L> -> i32
      %old = piko.load @sums[%x : i32] "x" : i32
      piko.store %x, @sums[%old : i32] "x" : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'moves' runs on the first rank alone: it is on a cycle in which primitives come to other bins}}
  piko.stage @moves bins [8] threads 1 : @L -> [@L] {
    piko.assign {
    ^bb0(%f: !piko.prim<@L>):
      %x = piko.get %f "x" : !piko.prim<@L> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@L>):
      %x = piko.get %f "x" : !piko.prim<@L> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{is merged by keys of 2 words}}
  // expected-remark @below {{stage 'waits' runs on the first rank alone: it is on a cycle with stages that wait}}
  piko.stage @waits bins [8] threads 1 : list @L -> [@L] {
    piko.assign {
    ^bb0(%f: !piko.prim<@L>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%list: !piko.list<@L>):
      %zero = arith.constant 0 : index
      %f = piko.list_at %list[%zero] : !piko.list<@L> -> !piko.prim<@L>
      %x = piko.get %f "x" : !piko.prim<@L> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
}
