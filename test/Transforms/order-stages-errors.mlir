// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages))' --split-input-file --verify-diagnostics %s

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @Cycle rank 2 {
  piko.source @in
  piko.edge @in[0] -> @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  piko.stage @in bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-error @below {{not supported yet: expected a graph of stages without cycles, but got a cycle of edges or waits among 'a' 'b'}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @WaitsInACircle rank 2 {
  piko.source @a
  piko.source @b
  // expected-error @below {{a cycle of edges or waits among 'a' 'b'}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@b]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0, 0] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@a]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
