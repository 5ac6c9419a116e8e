// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-fuse-kernels))' --split-input-file --verify-diagnostics %s

// A source feeds it, too.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.source @b
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
  // expected-note @below {{it is fed from several places}}
  piko.stage @b bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// Bins of other sizes.
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
  // expected-note @below {{its bins are of another size}}
  piko.stage @b bins [16] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// One thread would run all of the screen.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  // expected-note @below {{one bin is the whole domain, which several threads share}}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = arith.constant 1 : i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' does not run bin by bin after stage 'a'}}
  piko.stage @b bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// Several threads run a bin.
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
    // expected-note @below {{bins of stage 'a' are cut into tiles, which several threads take}}
    piko.schedule all tile_split 16
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
    piko.schedule all tile_split 16
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// A core of its own.
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
    // expected-note @below {{direct_map may choose another core than load_balance of stage 'a'}}
    piko.schedule direct_map
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// One core for one stage, all cores for the other.
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
    piko.schedule serialize
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
    // expected-note @below {{load_balance may choose another core than serialize of stage 'a'}}
    piko.schedule load_balance end_bin
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// A schedule for each bin.
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
    // expected-note @below {{the schedule of stage 'b' depends on the bin}}
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      piko.set_every_bin
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

// Another bin.
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
      // expected-note @below {{the bin is not known to be the same}}
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}
