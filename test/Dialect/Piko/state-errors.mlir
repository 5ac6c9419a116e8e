// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected a constant, buffer or image, but got @none, which is none}}
      %v = piko.load @none "value" : f32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-note@+1 {{the state is declared here}}
  piko.buffer @b : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected 1 indices into @b, but got 0}}
      %v = piko.load @b "value" : f32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-note@+1 {{the state is declared here}}
  piko.constant @c : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected 0 indices into @c, but got 1}}
      %v = piko.load @c[%x : i32] "value" : f32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-note@+1 {{the state is declared here}}
  piko.image @i : @V rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected 2 indices into @i, but got 1}}
      %v = piko.load @i[%x : i32] "value" : f32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.buffer @b : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected field 'value' to be of type 'f32', but got 'i32'}}
      %v = piko.load @b[%x : i32] "value" : i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.constant @c : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected a buffer or an image, but got the constant @c}}
      piko.store %z, @c "value" : f32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.constant @c : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected a buffer or an image, but got the constant @c}}
      piko.atomic add @c "value", %x : i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.buffer @b : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected field 'value' to be of type 'f32', but got 'i32'}}
      piko.atomic add @b[%x : i32] "value", %x : i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.buffer @b : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected a dimension below 1, but got 1}}
      %n = piko.extent @b[1]
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-note@+1 {{the state is declared here}}
  piko.buffer @b : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected 1 indices into @b, but got 2}}
      piko.prefetch @b[%x, %x : i32, i32]
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.buffer @b : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected an image, but got @b, which is none}}
      piko.update @b[%x, %x : i32, i32] {
      ^bb0(%v: f32):
        piko.yield [%v : f32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @V {"value" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-note@+1 {{the state is declared here}}
  piko.image @i : @V rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-error@+1 {{expected 2 indices into @i, but got 1}}
      piko.update @i[%x : i32] {
      ^bb0(%v: f32):
        piko.yield [%v : f32]
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
      // expected-error@+1 {{expected a block argument for each number of record @V, ('f32'), but got ('i32')}}
      piko.update @i[%x, %x : i32, i32] {
      ^bb0(%v: i32):
        piko.yield [%z : f32]
      }
      piko.return
    }
  }
}
