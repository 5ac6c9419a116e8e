// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  // expected-error@+1 {{expected phases (the kernels level) or loops (the resolved level), but got both}}
  piko.kernel @k {
    %n = piko.threads
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
  // expected-error@+1 {{expected at most one process phase, but got 2}}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
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
    %bins = piko.open_bins @a : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected bins of record @F, but got @G}}
    %bins = piko.open_bins @a : !piko.bins<@G>
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
