// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a port, because the kernel is not that of a source}}
    piko.storage.append_bin %w of @a in %zero
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a stage, but got @b, which is none}}
    piko.storage.append_bin %w[0] of @b in %zero
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    // expected-error @below {{expected a stage, but got @b, which is none}}
    %n = piko.begin_schedule @b
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    // expected-error @below {{expected the process phase of @a before it}}
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    // expected-error @below {{expected to stand before a process phase}}
    piko.local_barrier @a[0] -> @b
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    // expected-error @below {{expected an edge from port 1 of @a to @b, but there is none}}
    piko.local_barrier @a[1] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [4] threads 1 : list @F -> [] {}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    // expected-error @below {{expected stages with bins of one size, but got [8] and [4]}}
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    // expected-error @below {{expected a stage that waits for its bin, but @b does not}}
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    // expected-error @below {{expected a stage, but got @c, which is none}}
    %v = piko.cpu.open_writer %bins[%u] of @c : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    // expected-error @below {{expected a writer of @b, but got one of 'a'}}
    piko.storage.local_bin @b from %w[0] writer %w {
    ^bb0(%local: !piko.bins<@F>):
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    // expected-error @below {{expected a port below 1, which is how many the kernel of stage 'a' has, but got 1}}
    piko.storage.local_bin @b from %w[1] writer %w {
    ^bb0(%local: !piko.bins<@F>):
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    // expected-error @below {{expected one block argument of type '!piko.bins<@F>'}}
    piko.storage.local_bin @b from %w[0] writer %w {
    ^bb0(%local: index):
    }
  }
}
