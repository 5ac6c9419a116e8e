// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-units --split-input-file --verify-diagnostics=only-expected
// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-gpu --split-input-file --verify-diagnostics=only-expected

// Of a parallel loop of another dialect no other loops can be made.

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @counts : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected piko.parallel_for or piko.parallel_pixels, of which other loops can be made, but got 'piko_test.each'}}
      piko_test.each {
      ^bb0(%i: index):
        piko.atomic add @counts[%i : index] "x", %x : i32
      }
    }
  }
}

// -----

// Nor where its iterations meet.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Meets rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected piko.parallel_for or piko.parallel_pixels, of which other loops can be made, but got 'piko_test.each'}}
      piko_test.each {
      ^bb0(%i: index):
        piko.sync
      }
    }
  }
}
