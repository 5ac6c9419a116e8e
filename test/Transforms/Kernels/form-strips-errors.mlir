// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-strips))' --split-input-file %s 2>&1 | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program,piko-form-strips))' --split-input-file --verify-diagnostics %s

// CHECK: error: expected a piko.program, which piko-form-program makes
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @List rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  // expected-remark @below {{stage 'a' does not run in strips: no stage that could follow it in them takes what it emits}}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: its process phase takes a list, which must be complete}}
  piko.stage @b bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%f: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Waits rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  // expected-note @below {{because of this}}
  piko.edge @b[0] -> @c
  piko.source @d
  // expected-remark @below {{stage 'd' does not run in strips: no stage that}}
  piko.stage @d bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'a' does not run in strips: no stage that}}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: it waits, so that what it emits is in the order of its bins}}
  piko.stage @b bins [4] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    // expected-note @below {{because of this}}
    piko.schedule load_balance end_stage [@d]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'c' does not run in strips: stage 'b', which feeds it, does not run in strips with it}}
  piko.stage @c bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

// What waits for a whole stage, or emits bin by bin.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @EndStage rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  // expected-remark @below {{stage 'a' does not run in strips: no stage that}}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: it waits for stage 'a', which runs in the same strips}}
  piko.stage @b bins [0] threads 1 : @F -> [] {
    // expected-note @below {{because of this}}
    piko.schedule load_balance end_stage [@a]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @EndBin rank 1 {
  piko.source @a
  // expected-remark @below {{stage 'a' does not run in strips: it waits until nothing can reach its bins}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    // expected-note @below {{because of this}}
    piko.schedule load_balance end_bin
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

// From C++ a schedule has the place of its stage, which the remark has named.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @OnePlace rank 1 {
  piko.source @a
  // expected-remark @unknown {{stage 'a' does not run in strips: it waits until nothing can reach its bins}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance end_bin loc(unknown)
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  } loc(unknown)
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Bins rank 1 {
  piko.source @first
  piko.source @a
  // expected-note @below {{because of this}}
  piko.edge @a[0] -> @b
  // expected-remark @below {{stage 'first' does not run in strips: no stage that}}
  piko.stage @first bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'a' does not run in strips: it waits, so that what it emits is in the order of its bins}}
  piko.stage @a bins [4] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    // expected-note @below {{because of this}}
    piko.schedule load_balance end_stage [@first]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: stage 'a', which feeds it}}
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Sources rank 1 {
  piko.image @seen_c : @F rank 1
  piko.image @seen_a : @F rank 1
  piko.source @a
  piko.source @a
  piko.source @b
  piko.source @c
  piko.edge @b[0] -> @c
  // expected-remark @+2 {{what comes to stage 'a' is merged by keys of 1 word: it comes from source 0, source 1}}
  // expected-remark @below {{stage 'a' does not run in strips: several sources feed it}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen_a[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: no stage that}}
  piko.stage @b bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @+2 {{what comes to stage 'c' is merged by keys of 2 words: it comes from source 3, stage 'b'}}
  // expected-remark @below {{stage 'c' does not run in strips: a source feeds it, too}}
  piko.stage @c bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen_c[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

// Both write it, and lineage interleaves them; strips would show.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @State rank 1 {
  piko.buffer @sum : @F
  piko.source @a
  piko.edge @a[0] -> @b
  // expected-remark @+2 {{stage 'a' does not run in strips: no stage that}}
  // expected-note @below {{because of this}}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.atomic add @sum[%x : i32] "x", %x : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: it and stage 'a' both use @sum, which one of them writes}}
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.store %x, @sum[%x : i32] "x" : i32
      piko.return
    }
  }
}

// -----

// What a stage that waits emits comes after all that a source leads to.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Lineages rank 1 {
  piko.image @seen_meet : @F rank 1
  piko.source @before
  piko.source @a
  piko.edge @a[0] -> @waits
  piko.edge @a[1] -> @meet
  piko.edge @waits[0] -> @meet
  // expected-remark @below {{stage 'before' does not run in strips: no stage that}}
  piko.stage @before bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @a bins [0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  piko.stage @waits bins [0] threads 1 : @F -> [@F] {
    piko.schedule load_balance end_stage [@before]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @+2 {{what comes to stage 'meet' is merged by keys of 2 words: it comes from stage 'a', stage 'waits'}}
  // expected-remark @below {{stage 'meet' does not run in strips: what reaches it is of several lineages, one of which comes after the other}}
  piko.stage @meet bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen_meet[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

// A pass may have found that nothing reaches a stage.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Unfed rank 1 {
  piko.image @seen : @F rank 1
  piko.source @a
  piko.edge @b[0] -> @b
  // expected-note @below {{because of this}}
  piko.edge @b[1] -> @c
  // expected-remark @below {{stage 'a' does not run in strips: no stage that}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run in strips: nothing feeds it}}
  piko.stage @b bins [0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'c' does not run in strips: stage 'b', which feeds it, does not run in strips with it}}
  piko.stage @c bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}
