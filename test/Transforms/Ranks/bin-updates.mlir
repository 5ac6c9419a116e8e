// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-bin-updates))' --split-input-file %s | FileCheck %s

// A stage that updates the pixel of its primitive gets bins, and its primitives
// go where the pixel is; one outside of the domain goes to the first bin, whose
// process phase says so. Where an assign phase names the same bin it stays.
// CHECK-LABEL: piko.pipeline @Pixels
// CHECK:         piko.stage @mark bins [32, 32]
// CHECK-NEXT:      piko.assign {
// CHECK-NEXT:      ^bb0(%[[F:.*]]: !piko.prim<@F>):
// CHECK:           %[[X:.*]] = piko.get %[[F]] "x"
// CHECK:           %[[Y:.*]] = piko.get %[[F]] "y"
// CHECK:           %[[AT:.*]] = piko.bin_at %[[X]], %[[Y]]
// CHECK:           %[[BIN:.*]] = arith.maxsi %[[AT]]
// CHECK:           piko.assign_to %[[BIN]]
// CHECK:         piko.stage @again bins [32, 32]
// CHECK-NEXT:      piko.assign {
// CHECK-NEXT:      ^bb0
// CHECK-NEXT:        piko.get
// CHECK-NEXT:        %[[SAME:.*]] = piko.bin_at
// CHECK-NEXT:        piko.assign_to %[[SAME]]
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @Pixels rank 2 {
  piko.image @pixels : @F rank 2
  piko.source @mark
  piko.edge @mark[0] -> @again
  piko.stage @mark bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @pixels[%x, %y : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @again bins [0, 0] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %at = piko.bin_at %x, %x : i32, i32
      piko.assign_to %at
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @pixels[%x, %x : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      piko.return
    }
  }
}

// -----

// Not where a call updates two pixels, or one that follows from state; where the
// bin can be seen; or where the assign phase names another bin.
// CHECK-LABEL: piko.pipeline @Others
// CHECK:         piko.stage @two bins [0]
// CHECK:         piko.stage @loaded bins [0]
// CHECK:         piko.stage @bin bins [0]
// CHECK:         piko.stage @waits bins [0]
// CHECK:         piko.stage @assigned bins [0]
// CHECK:         piko.stage @previous bins [0]
// CHECK:         piko.stage @last bins [0]
piko.record @N {"n" : i32 at 0} size 4 align 4
piko.pipeline @Others rank 1 {
  piko.image @pixels : @N rank 1
  piko.buffer @places : @N
  piko.source @two
  piko.source @loaded
  piko.source @bin
  piko.source @waits
  piko.source @assigned
  piko.source @previous
  piko.edge @waits[0] -> @last
  piko.edge @previous[0] -> @last
  piko.stage @two bins [0] threads 1 : @N -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %x = piko.get %f "n" : !piko.prim<@N> -> i32
      %y = arith.addi %x, %x : i32
      piko.update @pixels[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%x : i32]
      }
      piko.update @pixels[%y : i32] {
      ^bb0(%a: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
  piko.stage @loaded bins [0] threads 1 : @N -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %i = arith.constant 0 : index
      %x = piko.load @places[%i : index] "n" : i32
      piko.update @pixels[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
  piko.stage @bin bins [0] threads 1 : @N -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %x = piko.get %f "n" : !piko.prim<@N> -> i32
      %bin = piko.bin
      %n = arith.index_cast %bin : index to i32
      piko.update @pixels[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%n : i32]
      }
      piko.return
    }
  }
  piko.stage @waits bins [0] threads 1 : @N -> [@N] {
    piko.schedule load_balance end_bin
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %x = piko.get %f "n" : !piko.prim<@N> -> i32
      piko.update @pixels[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%x : i32]
      }
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @assigned bins [0] threads 1 : @N -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@N>):
      %x = piko.get %f "n" : !piko.prim<@N> -> i32
      %y = arith.addi %x, %x : i32
      %at = piko.bin_at %y : i32
      piko.assign_to %at
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %x = piko.get %f "n" : !piko.prim<@N> -> i32
      piko.update @pixels[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
  piko.stage @previous bins [0] threads 1 : @N -> [@N] {
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      %x = piko.get %f "n" : !piko.prim<@N> -> i32
      piko.update @pixels[%x : i32] {
      ^bb0(%a: i32):
        piko.yield [%x : i32]
      }
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @last bins [0] threads 1 : @N -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@N>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@N>):
      piko.return
    }
  }
}
