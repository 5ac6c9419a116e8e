// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-uplift-pixel-loops),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

// Both ways to write a bound, what is computed for a row, and an emission.
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Clipped
// CHECK:         %[[LAST:.*]] = arith.minsi
// CHECK:         %[[END:.*]] = arith.addi %[[LAST]], %c1_i32
// CHECK:         piko.parallel_pixels(%[[X0:.*]], %[[Y0:.*]]) to(%[[X1:.*]], %[[END]]) {
// CHECK-NEXT:    ^bb0(%[[X:.*]]: i32, %[[Y:.*]]: i32):
// CHECK-NEXT:      %[[ROW:.*]] = arith.muli %[[Y]]
// CHECK-NEXT:      %[[SUM:.*]] = arith.addi %[[X]], %[[ROW]]
// CHECK-NEXT:      piko.emit 0(%[[SUM]], %[[Y]])
// CHECK-NEXT:      piko.yield
// CHECK-NOT:     scf.while
piko.pipeline @Clipped rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @b bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @a bins [8, 8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : i32
      %bin = piko.bin
      %bx = piko.bin_lo %bin[0]
      %by = piko.bin_lo %bin[1]
      %ex = piko.bin_hi %bin[0]
      %ey = piko.bin_hi %bin[1]
      %x0 = arith.index_cast %bx : index to i32
      %y0 = arith.index_cast %by : index to i32
      %x1 = arith.index_cast %ex : index to i32
      %yend = arith.index_cast %ey : index to i32
      %yin = arith.subi %yend, %one : i32
      %limit = piko.get %f "y" : !piko.prim<@F> -> i32
      %last = arith.minsi %yin, %limit : i32
      %end = scf.while (%y = %y0) : (i32) -> i32 {
        %more = arith.cmpi sle, %y, %last : i32
        scf.condition(%more) %y : i32
      } do {
      ^bb0(%y: i32):
        %row = arith.muli %y, %limit : i32
        scf.for %x = %x0 to %x1 step %one : i32 {
          %sum = arith.addi %x, %row : i32
          piko.emit 0 (%sum, %y) : i32, i32
        }
        %next = arith.addi %y, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}

// -----

// A test around the body clips the box; that of the bin's number is dropped.
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @D {"z" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Guarded
// CHECK-DAG:     %[[BIN:.*]] = piko.bin
// CHECK-DAG:     piko.bin_lo
// CHECK-DAG:     piko.bin_hi
// CHECK:         piko.parallel_pixels(%{{.*}}) to(%{{.*}}) {
// CHECK-NEXT:    ^bb0(%[[X:.*]]: i32):
// CHECK-NEXT:      piko.update @image[%[[X]] : i32]
// CHECK-NOT:     piko.bin_at
piko.pipeline @Guarded rank 1 {
  piko.image @image : @D rank 1 clear [0 : i32]
  piko.source @a
  piko.stage @a bins [8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : i32
      %x0 = piko.get %f "x" : !piko.prim<@F> -> i32
      %last = piko.get %f "y" : !piko.prim<@F> -> i32
      %end = scf.while (%x = %x0) : (i32) -> i32 {
        %more = arith.cmpi sge, %last, %x : i32
        scf.condition(%more) %x : i32
      } do {
      ^bb0(%x: i32):
        %at = piko.bin_at %x : i32
        %bin = piko.bin
        %own = arith.cmpi eq, %bin, %at : index
        scf.if %own {
          piko.update @image[%x : i32] {
          ^bb0(%z: i32):
            %new = arith.addi %z, %x : i32
            piko.yield [%new : i32]
          }
        }
        %next = arith.addi %x, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}

// -----

// A last pixel that may be the largest int, where another bound ends the loop.
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @D {"z" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Saturated
// CHECK:         %[[IN:.*]] = arith.minsi %{{.*}}, %c2147483646_i32
// CHECK:         %[[NEXT:.*]] = arith.addi %[[IN]], %c1_i32
// CHECK:         %[[HI:.*]] = arith.minsi %{{.*}}, %[[NEXT]]
// CHECK:         piko.parallel_pixels(%c0_i32) to(%[[HI]]) {
piko.pipeline @Saturated rank 1 {
  piko.image @image : @D rank 1 clear [0 : i32]
  piko.source @a
  piko.stage @a bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %value = arith.constant 7 : i32
      %size = piko.domain[0]
      %end = arith.index_cast %size : index to i32
      %last = piko.get %f "y" : !piko.prim<@F> -> i32
      %r = scf.while (%x = %zero) : (i32) -> i32 {
        %in = arith.cmpi slt, %x, %end : i32
        %more = arith.cmpi sle, %x, %last : i32
        %both = arith.andi %in, %more : i1
        scf.condition(%both) %x : i32
      } do {
      ^bb0(%x: i32):
        piko.store %value, @image[%x : i32] "z" : i32
        %next = arith.addi %x, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}

// -----

// A bound that the counter ends at only if it meets it, and that it has perhaps
// passed.
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @D {"z" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Passed
// CHECK-NOT:     piko.parallel_pixels
piko.pipeline @Passed rank 1 {
  piko.image @image : @D rank 1 clear [0 : i32]
  piko.source @a
  piko.stage @a bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %value = arith.constant 7 : i32
      %size = piko.domain[0]
      %end = arith.index_cast %size : index to i32
      %last = piko.get %f "y" : !piko.prim<@F> -> i32
      // expected-remark@+1 {{this loop over pixels of stage 'a' stays one that counts; parallelForPixels(lo, hi, f) has independent iterations}}
      %r = scf.while (%x = %zero) : (i32) -> i32 {
        %in = arith.cmpi slt, %x, %end : i32
        // expected-note@+1 {{the counter may pass this bound}}
        %more = arith.cmpi ne, %x, %last : i32
        %both = arith.andi %in, %more : i1
        scf.condition(%both) %x : i32
      } do {
      ^bb0(%x: i32):
        piko.store %value, @image[%x : i32] "z" : i32
        %next = arith.addi %x, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}
