// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels))' --split-input-file --verify-diagnostics %s

// The reader's source comes before the writer's.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @SourceTooEarly rank 1 {
  piko.buffer @bins : @F
  piko.source @read
  piko.source @write
  piko.stage @write bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-note @below {{it is written here}}
      piko.store %x, @bins[%x : i32] "x" : i32
      piko.return
    }
  }
  piko.stage @read bins [4] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@write]
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error @below {{expected the assign phase of stage 'read' to read what is complete when its primitives arrive, but stage 'write' may still write @bins}}
      %b = piko.load @bins[%x : i32] "x" : i32
      %bin = piko.bin_at %b : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

// Without a wait.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoWait rank 1 {
  piko.buffer @bins : @F
  piko.source @write
  piko.source @read
  piko.stage @write bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-note @below {{it is written here}}
      piko.atomic add @bins[%x : i32] "x", %x : i32
      piko.return
    }
  }
  piko.stage @read bins [4] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error @below {{stage 'write' may still write @bins}}
      %b = piko.load @bins[%x : i32] "x" : i32
      %bin = piko.bin_at %b : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
