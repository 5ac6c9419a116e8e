// RUN: piko-opt --convert-piko-to-llvm --split-input-file --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    // expected-error @below {{expected the machine level, but got a phase}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    // expected-error @below {{expected the machine level, but got a phase}}
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  // expected-error @below {{expected to open the bins of one stage or source, or to begin one schedule}}
  piko.kernel @k {
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = arith.constant 8 : index
    // expected-error @below {{failed to legalize operation 'piko.parallel_for'}}
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.yield
    }
  }
  piko.program {
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @k(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// expected-error @below {{expected a piko.program, which piko-form-program makes}}
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
