// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-units --split-input-file --verify-diagnostics=only-expected

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected an operation that says what it does, but 'piko_test.mystery' may have any effect}}
      piko_test.mystery
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected an operation that says what it does, but 'piko_test.mystery' may have any effect}}
      piko_test.mystery
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @counts : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %n = arith.constant 8 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        %i32 = arith.index_cast %i : index to i32
        piko.store %i32, @counts[%i : index] "x" : i32
        // expected-error@+1 {{expected piko.sync, piko.reduce, piko.scan or piko.sort, which loops can be cut at, but got 'piko_test.meet'}}
        piko_test.meet
        piko.yield
      }
      piko.return
    }
  }
}
