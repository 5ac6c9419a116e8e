// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-fuse-kernels))' --split-input-file --verify-diagnostics %s

// Lists of empty bins after a list that has none.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  // expected-note @below {{it runs for empty bins, but stage 'a' does not}}
  piko.stage @a bins [8] threads 1 : list @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.schedule load_balance every_bin
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// The wait is for all bins.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    // expected-note @below {{it waits for all of stage 'a'}}
    piko.schedule load_balance end_stage [@a]
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// The list reads what other bins write.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @sums : @F
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      %zero = arith.constant 0 : index
      // expected-note @below {{it and stage 'a' both use @sums, which one of them writes}}
      piko.store %x, @sums[%zero : index] "x" : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %v = piko.load @sums[%zero : index] "x" : i32
      piko.store %v, @sums[%v : i32] "x" : i32
      piko.return
    }
  }
}

// -----

// The wait is for a stage that runs later than the producer.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @between
  piko.stage @a bins [8] threads 1 : @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    // expected-note @below {{it waits for all of stage 'between'}}
    piko.schedule load_balance end_stage [@between]
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
  piko.stage @between bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

// Stage 'between', which updates the same pixels, runs first.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @between
  piko.stage @a bins [8] threads 1 : @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  piko.stage @between bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-note @below {{it and stage 'between' both use @image, which one of them writes}}
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %x = arith.constant 1 : i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

// A cycle.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  // expected-note @below {{stage 'a' is on a cycle}}
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [8] threads 1 : list @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
}
