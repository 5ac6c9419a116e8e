// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-own-pixels))' --split-input-file --verify-diagnostics %s

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @TwoPixels rank 2 {
  piko.image @depth : @F rank 2
  piko.source @test
  piko.stage @test bins [0, 0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      // expected-remark @below {{stage 'test' shares no bin by its pixels}}
      piko.update @depth[%x, %y : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      // expected-note @below {{this update may be at another pixel}}
      piko.update @depth[%y, %x : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @MovingPixel rank 2 {
  piko.image @depth : @F rank 2
  piko.source @test
  piko.stage @test bins [0, 0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %four = arith.constant 4 : index
      // expected-note @below {{the pixel depends on this, not only on the primitive's fields and on constants}}
      scf.for %i = %zero to %four step %one {
        // expected-remark @below {{stage 'test' shares no bin by its pixels}}
        piko.update @depth[%i, %i : index, index] {
        ^bb0(%a: i32, %b: i32):
          piko.yield [%b, %a : i32, i32]
        }
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @List rank 1 {
  piko.image @depth : @F rank 1
  piko.source @test
  piko.stage @test bins [0] threads 64 : list @F -> [] {
    // expected-note @below {{the phase takes a list, which may be of primitives that update any pixel}}
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      // expected-remark @below {{stage 'test' shares no bin by its pixels}}
      piko.update @depth[%zero : index] {
      ^bb0(%a: i32):
        piko.yield [%a : i32]
      }
      piko.return
    }
  }
}

// -----

// The pixel of an iteration.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Iterations rank 1 {
  piko.image @depth : @F rank 1
  piko.source @test
  piko.stage @test bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %n = arith.constant 8 : index
      // expected-note @below {{the pixel depends on this}}
      piko.parallel_for %n {
      ^bb0(%i: index):
        // expected-remark @below {{stage 'test' shares no bin by its pixels}}
        piko.update @depth[%i : index] {
        ^bb0(%a: i32):
          piko.yield [%a : i32]
        }
        piko.yield
      }
      piko.return
    }
  }
}
