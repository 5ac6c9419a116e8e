// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-map-lanes))' --split-input-file --verify-diagnostics=only-expected %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    // expected-warning@+1 {{lanes of stage 'a' are not given 'iterations': there is no parallel loop that does anything}}
    piko.schedule load_balance lanes iterations
  }
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : list @F -> [] {
    // expected-error@+1 {{expected lanes of stage 'a' to be given 'one', but got 'items': a list is one item}}
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    // expected-error@+1 {{expected lanes of stage 'a' to be given 'iterations' or 'one', but got 'items': the iterations of a parallel loop meet}}
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 4 : index
        // expected-note@+1 {{see here}}
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.sync
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    // expected-error@+1 {{expected lanes of stage 'a' to be given 'items', 'iterations' or 'one', but got 'collapsed': there are effects outside of the parallel loop}}
    piko.schedule load_balance lanes collapsed
  }
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 4 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.yield
        }
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-note@+1 {{see here}}
        piko.store %x, @out[%n : index] "x" : i32
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected lanes of stage 'a' to be given 'items' or 'one', but got 'collapsed': there is no parallel loop}}
      piko.items of @a lanes collapsed {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}
