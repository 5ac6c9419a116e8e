// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  // expected-error@+1 {{expected phases (the kernels level) or work (the machine level), but got both}}
  piko.kernel @k {
    %n = piko.cpu.threads
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    // expected-error@+1 {{expected to be the first of its kernel, or after a local barrier that names @a}}
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected a stage, but got @b, which is none}}
    piko.process of @b {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected the stage's name inside a kernel, and only there}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected a port or a source inside a kernel, and neither inside a stage}}
    piko.assign of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
  }
}

// -----

piko.pipeline @P rank 2 {
  piko.kernel @k {
    // expected-error@+1 {{expected a stage, but got @a, which is none}}
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected bins of record @F, but got @G}}
    %bins = piko.storage.open_bins @a : !piko.bins<@G>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoProcess rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  // expected-error @below {{expected a process phase, or the assign phase of one source alone}}
  piko.kernel @k {
    piko.assign of @a port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    // expected-error @below {{expected a list of record @F, which the bins hold, but got @G}}
    %l = piko.storage.list %bins[%zero to %zero] : !piko.bins<@F> -> !piko.list<@G>
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
    // expected-error @below {{expected a primitive of record @F, which the bins hold, but got @G}}
    %p = piko.storage.item %bins[%zero] : !piko.bins<@F> -> !piko.prim<@G>
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
    %one = arith.constant 1 : i32
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a port below 0, which is how many the kernel of stage 'a' has, but got 0}}
    %p = piko.storage.append %w[0] (%one) : i32 -> !piko.prim<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @G {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : i32
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a primitive of record @F, which port 0 emits, but got @G}}
    %p = piko.storage.append %w[0] (%one) : i32 -> !piko.prim<@G>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    %wide = arith.constant 0 : i64
    // expected-error @below {{expected the numbers of record @F, ('i32'), but got ('i64')}}
    %p = piko.storage.append %w[0] (%wide) : i64 -> !piko.prim<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a tile only in a stage that is divided into tiles, but @a is not}}
    piko.storage.append_bin %w[0] of @a in %zero tile %zero
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected the number of a source of @a, but got 65536}}
    %bins = piko.storage.open_bins @a source 65536 : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  // expected-error@+1 {{expected a 'piko.bins' of the same stage as in @kernel_b, which precedes none}}
  piko.kernel @first precedes @kernel_b {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
  piko.kernel @kernel_b {
    piko.bins of @b {
    ^bb0(%bin: index):
      piko.items of @b {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @sums : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  // expected-error@+1 {{expected neither emissions nor updates, because it precedes another kernel}}
  piko.kernel @first precedes @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @sums[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}
