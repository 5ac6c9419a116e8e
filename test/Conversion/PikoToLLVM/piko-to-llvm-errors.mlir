// RUN: piko-opt --convert-piko-to-llvm --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    // expected-error @below {{expected the resolved level, but got a phase}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
