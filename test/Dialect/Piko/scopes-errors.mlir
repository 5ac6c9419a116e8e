// RUN: piko-opt %s --split-input-file --verify-diagnostics

// Phases, stages, kernels and programs have names of their own: what one says of
// a value is no reference to one of another that stands after it.

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{use of undeclared SSA value name}}
      piko.assign_to %v
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = arith.constant 0 : index
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      // expected-error@+1 {{use of undeclared SSA value name}}
      piko.set_batch %v
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = arith.constant 1 : i64
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @one {
    // expected-error@+1 {{use of undeclared SSA value name}}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @other {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{use of undeclared SSA value name}}
      piko.place %f of @a in %edge : !piko.prim<@F>
    }
  }
  piko.program {
    %edge = piko.feed 0 : !piko.edge<@F>
  }
}
