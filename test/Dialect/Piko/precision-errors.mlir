// RUN: piko-opt --split-input-file --verify-diagnostics %s

// Kernels hold what has been computed with its precision.
piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Kernel rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
  }
  piko.kernel @k {
    // expected-error @below {{expected a precision only in a piko.stage}}
    piko.process of @a precision relaxed {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
