// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-resolve-kernels))' --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Batches rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error @below {{not supported yet: batch in stage 'a'}}
    piko.schedule load_balance batch 32
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
