// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages))' --split-input-file --verify-diagnostics %s

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @WaitsForItsOwnWork rank 2 {
  piko.source @in
  piko.edge @in[0] -> @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  // expected-error @below {{stage 'in' waits for stage 'b', which cannot finish before it}}
  piko.stage @in bins [0, 0] threads 1 : @F -> [@F] {
    piko.schedule load_balance end_stage [@b]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-note @below {{it is fed by stage 'in'}}
  piko.stage @b bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @WaitsOnItsCycle rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  // expected-note @below {{it is fed by stage 'b'}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-error @below {{stage 'b' waits for stage 'a', which cannot finish before it}}
  piko.stage @b bins [0, 0] threads 1 : @F -> [@F] {
    piko.schedule load_balance end_stage [@a]
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
  // expected-error @below {{expected waits that can end, but got a circle of edges and waits among 'a' 'b'}}
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
