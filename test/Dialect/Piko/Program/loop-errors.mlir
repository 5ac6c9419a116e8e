// RUN: piko-opt --split-input-file --verify-diagnostics %s

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    // expected-error@+1 {{expected one block argument of type 'index'}}
    piko.parallel_for %n {
    ^bb0(%i: i32):
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    // expected-error@+1 {{expected its body to end with a piko.yield of nothing}}
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.yield results [%i : index]
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %n = arith.constant 8 : index
      // expected-error@+1 {{expected to be inside a process phase}}
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.yield
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.update @image[%n : index] {
    ^bb0(%z: f32):
      // expected-error@+1 {{expected to be outside an update}}
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.yield
      }
      piko.yield [%z : f32]
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    // expected-error@+1 {{expected to be inside a parallel_for}}
    piko.sync
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    // expected-note@+1 {{the outer one is here}}
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.parallel_for %n {
      ^bb0(%j: index):
        // expected-error@+1 {{expected to be inside a parallel_for that is not nested}}
        piko.sync
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.parallel_for %n {
    ^bb0(%i: index):
      %v = arith.constant 1 : i32
      %r = piko.reduce %v : i32 {
      ^bb0(%a: i32, %b: i32):
        // expected-error@+1 {{expected to be outside the body of a reduce}}
        piko.sync
        piko.yield results [%a : i32]
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.parallel_for %n {
    ^bb0(%i: index):
      %v = arith.constant 1 : i32
      // expected-error@+1 {{expected block arguments of types ('i32', 'i32'), but got ('i32')}}
      %r = piko.reduce %v : i32 {
      ^bb0(%a: i32):
        piko.yield results [%a : i32]
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.parallel_for %n {
    ^bb0(%i: index):
      %v = arith.constant 1 : i32
      // expected-error@+1 {{expected its body to yield results of types ('i32')}}
      %r = piko.scan %v empty %v : i32 {
      ^bb0(%a: i32, %b: i32):
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.parallel_for %n {
    ^bb0(%i: index):
      // expected-error@+1 {{expected at least one number to combine}}
      "piko.reduce"() ({
      ^bb0:
        piko.yield
      }) : () -> ()
      piko.yield
    }
  }
}

// -----

piko.record @C {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @C
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.parallel_for %n {
    ^bb0(%i: index):
      %v = arith.constant 1 : i32
      %r = piko.reduce %v : i32 {
      ^bb0(%a: i32, %b: i32):
        // expected-error@+1 {{expected to be outside the function of a reduce}}
        piko.atomic add @b[%n : index] "n", %a : i32
        piko.yield results [%a : i32]
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 2 {
  piko.kernel @k {
    %n = arith.constant 8 : i32
    // expected-error@+1 {{expected a box of 2 dimensions, as its pipeline has, but got 1}}
    piko.parallel_pixels (%n) to (%n) {
    ^bb0(%x: i32):
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 2 {
  piko.kernel @k {
    %n = arith.constant 8 : i32
    // expected-error@+1 {{expected 2 block arguments of type 'i32', but got ('i32', 'index')}}
    piko.parallel_pixels (%n, %n) to (%n, %n) {
    ^bb0(%x: i32, %y: index):
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : i32
    // expected-error@+1 {{expected its body to end with a piko.yield of nothing}}
    piko.parallel_pixels (%n) to (%n) {
    ^bb0(%x: i32):
      piko.yield results [%x : i32]
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : i32
    %m = arith.constant 8 : index
    // expected-note@+1 {{the outer one is here}}
    piko.parallel_for %m {
    ^bb0(%i: index):
      piko.parallel_pixels (%n) to (%n) {
      ^bb0(%x: i32):
        // expected-error@+1 {{expected to be inside a parallel_pixels that is not nested}}
        piko.sync
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

func.func @no_pipeline(%n: i32) {
  // expected-error@+1 {{expected to be inside a pipeline}}
  piko.parallel_pixels (%n) to (%n) {
  ^bb0(%x: i32):
    piko.yield
  }
  return
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    piko.parallel_for %n {
    ^bb0(%i: index):
      // expected-error@+1 {{expected block arguments of types ('index', 'i1'), but got ('index')}}
      piko.grouped where %yes by %i : index with %yes : i1 {
      ^bb0(%key: index):
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    piko.parallel_for %n {
    ^bb0(%i: index):
      // expected-error@+1 {{expected its body to yield results of types ('i1')}}
      %r = piko.grouped where %yes by %i : index {
      ^bb0(%key: index):
        piko.yield results [%key : index]
      } -> i1
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    // expected-error@+1 {{expected to be inside a parallel_for or a parallel_pixels}}
    piko.grouped where %yes by %n : index {
    ^bb0(%key: index):
      piko.yield
    }
  }
}

// -----

piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @Pixel rank 1
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.grouped where %yes by %i : index {
      ^bb0(%key: index):
        // expected-error@+1 {{expected to be of the pixel that is the key}}
        piko.update @image[%n : index] in %n {
        ^bb0(%old: i32):
          piko.yield [%old : i32]
        }
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @Pixel rank 1
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.grouped where %yes by %i : index {
      ^bb0(%key: index):
        // expected-error@+1 {{expected to name the bin that its pixel must be in}}
        piko.update @image[%key : index] {
        ^bb0(%old: i32):
          piko.yield [%old : i32]
        }
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    %table = memref.alloca() : memref<4xi32>
    piko.parallel_for %n {
    ^bb0(%i: index):
      // expected-error@+1 {{expected numbers and primitives for values, but got 'memref<4xi32>'}}
      piko.grouped where %yes by %i : index with %table : memref<4xi32> {
      ^bb0(%key: index, %t: memref<4xi32>):
        piko.yield
      }
      piko.yield
    }
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    %yes = arith.constant true
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.grouped where %yes by %i : index {
      ^bb0(%key: index):
        // expected-error@+1 {{expected to be outside the body of a grouped}}
        piko.sync
        piko.yield
      }
      piko.yield
    }
  }
}
