// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected a record, but got @F, which is none}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected bins of the pipeline's rank, 2, but got 3 extents}}
  piko.stage @a bins [8, 8, 8] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected bin extents of at least 0, but got -1}}
  piko.stage @a bins [8, -1] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{attribute 'threads' failed to satisfy constraint: 64-bit integer attribute whose value is positive}}
  piko.stage @a bins [0, 0] threads 0 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected only phases in a stage}}
    %c = arith.constant 0 : i32
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.schedule load_balance
    // expected-error@+1 {{expected at most one phase of a kind in stage 'a'}}
    piko.schedule all
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected a process phase}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected an assign phase, because one bin is not the whole domain}}
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected one block argument of type '!piko.prim<@F>'}}
    piko.process {
    ^bb0(%f: i32):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected the stage's name inside a kernel, and only there}}
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected a port or a source inside a kernel, and neither inside a stage}}
    piko.assign port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected tile_split only with 'all', but got 'load_balance'}}
    piko.schedule load_balance tile_split 4
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected a stage to wait for, but got @b, which is none}}
    piko.schedule load_balance end_stage [@b]
  }
}
