// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.image @i : @V rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.update @i[%x, %x : i32, i32] {
      ^bb0(%v: f32):
        // expected-error@+1 {{expected the numbers of record @V, ('f32'), but got ('i32')}}
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.image @i : @V rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %r = piko.update @i[%x, %x : i32, i32] {
      ^bb0(%v: f32):
        // expected-error@+1 {{expected results of types ('i32'), but got ('f32')}}
        piko.yield [%v : f32] results [%v : f32]
      } -> i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Bypass rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        // expected-error @below {{expected an update to see @image only through the pixel that it is given}}
        %live = piko.load @image[%x : i32] "x" : i32
        piko.yield [%live : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @C {"n" : i32 at 0, "f" : f32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.source @a
  piko.stage @a bins [0] threads 1 : @C -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@C>):
      %x = piko.get %f "n" : !piko.prim<@C> -> i32
      // expected-error @below {{expected stage 'a' to be unordered, because the result of an atomic shows the order of its primitives}}
      %old = piko.atomic add @b[%x : i32] "n", %x : i32 -> i32
      piko.return
    }
  }
}

// -----

piko.record @C {"n" : i32 at 0, "f" : f32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.source @a
  piko.stage @a bins [0] threads 1 : @C -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@C>):
      %x = piko.get %f "n" : !piko.prim<@C> -> i32
      %y = piko.get %f "f" : !piko.prim<@C> -> f32
      // expected-error @below {{expected stage 'a' to be unordered, because a float atomic shows the order of its primitives}}
      piko.atomic add_float @b[%x : i32] "f", %y : f32
      piko.return
    }
  }
}

// -----

piko.record @C {"n" : i32 at 0, "f" : f32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.kernel @k {
    %x = arith.constant 0 : i32
    // expected-error @below {{expected a float for 'add_float', but got 'add_float' of type 'i32'}}
    piko.atomic add_float @b[%x : i32] "n", %x : i32
  }
}

// -----

piko.record @C {"n" : i32 at 0, "f" : f32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.kernel @k {
    %x = arith.constant 0 : i32
    // expected-error @below {{expected a result of type 'i32', but got 'i64'}}
    %old = piko.atomic add @b[%x : i32] "n", %x : i32 -> i64
  }
}

// -----

piko.record @C {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.source @a
  piko.stage @a bins [4] threads 1 : @C -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@C>):
      %x = piko.get %p "n" : !piko.prim<@C> -> i32
      // expected-error @below {{'piko.store' op expected to be inside a process phase, because only process phases may change state}}
      piko.store %x, @b[%x : i32] "n" : i32
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@C>):
      piko.return
    }
  }
}

// -----

// A phase in a kernel is told from another as well.
piko.record @C {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.source @a
  piko.stage @a bins [4] threads 1 : @C -> [] {
    piko.schedule serialize
  }
  piko.kernel @k {
    piko.assign of @a source 0 {
    ^bb0(%p: !piko.prim<@C>):
      %x = piko.get %p "n" : !piko.prim<@C> -> i32
      %true = arith.constant true
      scf.if %true {
        // expected-error @below {{'piko.atomic' op expected to be inside a process phase, because only process phases may change state}}
        piko.atomic add @b[%x : i32] "n", %x : i32
      }
      piko.assign_all
      piko.return
    }
  }
}

// -----

piko.record @C {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.source @a
  piko.stage @a bins [0] threads 1 : @C -> [] {
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %x = arith.constant 1 : i32
      // expected-error @below {{'piko.store' op expected to be inside a process phase, because only process phases may change state}}
      piko.store %x, @b[%x : i32] "n" : i32
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@C>):
      piko.return
    }
  }
}

// -----

piko.record @C {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @i : @C rank 1
  piko.source @a
  piko.stage @a bins [4] threads 1 : @C -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@C>):
      %x = piko.get %p "n" : !piko.prim<@C> -> i32
      // expected-error @below {{'piko.update' op expected to be inside a process phase, because only process phases may change state}}
      piko.update @i[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%old : i32]
      }
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@C>):
      piko.return
    }
  }
}
