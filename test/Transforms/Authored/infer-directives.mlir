// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-infer-directives))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @T {"lo" : i32 at 0, "hi" : i32 at 4} size 8 align 4
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// By range: what is emitted is cut at the bounds of the bin. By induction:
// `@test` gets `x` from `@shade`, whose bins are by `x`.
// CHECK-LABEL: piko.pipeline @Range
piko.pipeline @Range rank 2 {
  piko.source @raster
  piko.edge @raster[0] -> @shade
  piko.edge @shade[0] -> @test
  piko.stage @raster bins [8, 0] threads 64 : @T -> [@F] {
    piko.assign {
    ^bb0(%t: !piko.prim<@T>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%t: !piko.prim<@T>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %bin = piko.bin
      %lo = piko.bin_lo %bin[0]
      %hi = piko.bin_hi %bin[0]
      %height = piko.domain[1]
      %lo32 = arith.index_cast %lo : index to i32
      %hi32 = arith.index_cast %hi : index to i32
      %height32 = arith.index_cast %height : index to i32
      %first = piko.get %t "lo" : !piko.prim<@T> -> i32
      %last = piko.get %t "hi" : !piko.prim<@T> -> i32
      %begin = arith.maxsi %lo32, %first : i32
      %end = arith.minsi %last, %hi32 : i32
      scf.while (%x = %begin) : (i32) -> i32 {
        %more = arith.cmpi slt, %x, %end : i32
        scf.condition(%more) %x : i32
      } do {
      ^bb0(%x: i32):
        %y = arith.maxsi %first, %zero : i32
        %inside = arith.cmpi slt, %y, %height32 : i32
        scf.if %inside {
          piko.emit 0 (%x, %y) : i32, i32
        }
        %next = arith.addi %x, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
  // CHECK: piko.stage @shade
  piko.stage @shade bins [8, 0] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      // CHECK: piko.assign_previous inferred
      // expected-remark @below {{stage 'shade' keeps each primitive in the bin that it was emitted from}}
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%x, %y) : i32, i32
      piko.return
    }
  }
  // A condition stays: at most the bin before.
  // CHECK: piko.stage @test
  piko.stage @test bins [8, 0] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      %zero = arith.constant 0 : i32
      %some = arith.cmpi sgt, %x, %zero : i32
      // CHECK:      scf.if
      // CHECK-NEXT:   piko.assign_previous inferred
      scf.if %some {
        // expected-remark @below {{stage 'test' keeps each primitive in the bin}}
        piko.assign_to %b
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// By range: both ways to clamp, as no bin is empty.
// CHECK-LABEL: piko.pipeline @Clamped
piko.pipeline @Clamped rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8, 0] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %minus_one = arith.constant -1 : i32
      %zero = arith.constant 0 : i32
      %bin = piko.bin
      %lo = piko.bin_lo %bin[0]
      %hi = piko.bin_hi %bin[0]
      %height = piko.domain[1]
      %lo32 = arith.index_cast %lo : index to i32
      %hi32 = arith.index_cast %hi : index to i32
      %height32 = arith.index_cast %height : index to i32
      %last_x = arith.addi %hi32, %minus_one : i32
      %last_y = arith.addi %height32, %minus_one : i32
      %right = arith.maxsi %x, %lo32 : i32
      %column = arith.minsi %last_x, %right : i32
      %above = arith.minsi %y, %last_y : i32
      %row = arith.maxsi %above, %zero : i32
      piko.emit 0 (%column, %row) : i32, i32
      piko.return
    }
  }
  // CHECK: piko.stage @b
  piko.stage @b bins [8, 0] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      // CHECK: piko.assign_previous inferred
      // expected-remark @below {{stage 'b' keeps each primitive in the bin}}
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// By function: any computation of what is handed on unchanged.
// CHECK-LABEL: piko.pipeline @Function
piko.pipeline @Function rank 2 {
  piko.source @a
  piko.edge @a[0] -> @same
  piko.edge @a[1] -> @other
  piko.stage @a bins [8, 8] threads 64 : @T -> [@F, @F] {
    piko.assign {
    ^bb0(%t: !piko.prim<@T>):
      %lo = piko.get %t "lo" : !piko.prim<@T> -> i32
      %seven = arith.constant 7 : i32
      %b = arith.andi %lo, %seven : i32
      %bin = arith.index_cast %b : i32 to index
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%t: !piko.prim<@T>):
      %lo = piko.get %t "lo" : !piko.prim<@T> -> i32
      %hi = piko.get %t "hi" : !piko.prim<@T> -> i32
      piko.emit 0 (%hi, %lo) : i32, i32
      // expected-note @below {{'x' is not proved to be at least the bin's lower bound here; if it always is, promise that by assignToPreviousBins}}
      piko.emit 1 (%hi, %lo) : i32, i32
      piko.return
    }
  }
  // CHECK: piko.stage @same
  piko.stage @same bins [8, 8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %seven = arith.constant 7 : i32
      %b = arith.andi %y, %seven : i32
      %bin = arith.index_cast %b : i32 to index
      // CHECK: piko.assign_previous inferred
      // expected-remark @below {{stage 'same' keeps each primitive}}
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // CHECK: piko.stage @other
  piko.stage @other bins [8, 8] threads 64 : @F -> [] {
    // expected-remark @below {{the bins of stage 'other' are not known}}
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      // CHECK: piko.assign_to
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// Wrapping around is no way to stay above the lower bound, a bound of another
// dimension is none, and what holds only where it is emitted says nothing about
// earlier iterations of a loop.
// CHECK-LABEL: piko.pipeline @Wrong
piko.pipeline @Wrong rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 64 : @T -> [@F] {
    piko.assign {
    ^bb0(%t: !piko.prim<@T>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%t: !piko.prim<@T>):
      %one = arith.constant 1 : i32
      %bin = piko.bin
      %lo = piko.bin_lo %bin[0]
      %hi = piko.bin_hi %bin[0]
      %lo32 = arith.index_cast %lo : index to i32
      %hi32 = arith.index_cast %hi : index to i32
      %first = piko.get %t "lo" : !piko.prim<@T> -> i32
      scf.while (%x = %lo32, %other = %first) : (i32, i32) -> (i32, i32) {
        %more = arith.cmpi slt, %x, %hi32 : i32
        scf.condition(%more) %x, %other : i32, i32
      } do {
      ^bb0(%x: i32, %other: i32):
        %above = arith.cmpi sge, %other, %lo32 : i32
        scf.if %above {
          // expected-note @below {{'x' is not proved to be at least the bin's lower bound here; if it always is, promise that by assignToPreviousBins}}
          piko.emit 0 (%x, %x) : i32, i32
        }
        %next = arith.addi %other, %one : i32
        scf.yield %next, %next : i32, i32
      }
      piko.return
    }
  }
  // CHECK: piko.stage @b
  // CHECK: piko.assign_to
  piko.stage @b bins [8] threads 64 : @F -> [] {
    // expected-remark @below {{the bins of stage 'b' are not known}}
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
