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
        // expected-error@+1 {{expected piko.sync, piko.reduce, piko.scan, piko.sort or piko.grouped, which loops can be cut at, but got 'piko_test.meet'}}
        piko_test.meet
        piko.yield
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected the numbers of record @F, 1 of types ('i32'), but got ('i32', 'i32')}}
      piko_test.emit_same 0 %x times 2
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
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
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected an effect, because it emits, but it says that it has none}}
      piko_test.emit_nothing
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
        %sum = piko.reduce %i32 : i32 {
        ^bb0(%a: i32, %b: i32):
          // expected-error@+1 {{expected to be outside the function of a reduce}}
          piko_test.scribble @counts[%i]
          piko.yield results [%a : i32]
        }
        piko.yield
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @counts : @F
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      // expected-error@+1 {{expected to be inside a process phase, because only process phases may change state}}
      piko_test.scribble @counts[%zero]
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

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        // expected-error@+1 {{expected an update to see @image only through the pixel that it is given}}
        piko_test.smear @image
        piko.yield [%old : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @counts : @F
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected a schedule to read constants only, but got @counts}}
      %n = piko_test.peek @counts[%bin]
      piko.return
    }
    piko.assign {
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

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @counts : @F
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      // expected-note@+1 {{it is written here}}
      piko_test.scribble @counts[%zero]
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      // expected-error@+1 {{expected the assign phase of stage 'b' to read what is complete when its primitives arrive, but stage 'a' may still write @counts}}
      %n = piko_test.peek @counts[%zero]
      %at = arith.index_cast %n : i32 to index
      piko.assign_to %at
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
