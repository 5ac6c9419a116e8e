// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-narrow-integers{lanes=8}),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-narrow-integers{lanes=-8}))' %s 2>&1 | FileCheck %s --check-prefix=LANES
// LANES: error: expected at least 0 lanes, but got -8

piko.record @V {"n" : i64 at 0, "k" : i32 at 8} size 16 align 8

piko.pipeline @P rank 2 {
  piko.buffer @in : @V
  piko.image @out : @V rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @V -> [] {}

  // Loop interchange: strips of 8 columns, and of each the rows that both
  // half-planes reach at one of its outer columns, which is found for four strips
  // at once. A box that lies outside of one has none.
  // CHECK-LABEL: piko.kernel @triangle
  // CHECK:         %[[ABOVE:.*]] = arith.cmpi sge, %{{.*}}, %c0_i64 : i64
  // CHECK:         %[[BELOW:.*]] = arith.cmpi sge, %{{.*}}, %c0_i64 : i64
  // CHECK:         %[[REACHES:.*]] = arith.andi %[[ABOVE]], %[[BELOW]] : i1
  // CHECK:         scf.if %{{.*}} {
  // CHECK-NEXT:      scf.if %[[REACHES]] {
  // CHECK:             %[[STEP:.*]] = arith.sitofp %{{.*}} : i32 to f64
  // CHECK:             arith.divf %{{.*}}, %[[STEP]] : f64
  // CHECK:             scf.for %[[GROUP:.*]] = %c3_i32 to %c61_i32 step %c32_i32
  // CHECK:               arith.maxsi %{{.*}} : vector<4xi32>
  // CHECK-COUNT-2:       arith.fptosi %{{.*}} : vector<4xf64> to vector<4xi32>
  // CHECK:               %[[LAST:.*]] = arith.minsi %{{.*}}, %c61_i32
  // CHECK:               scf.for %[[LEFT:.*]] = %[[GROUP]] to %[[LAST]] step %c8_i32
  // CHECK-COUNT-2:         vector.extract %{{.*}} : i32 from vector<4xi32>
  // CHECK:                 %[[NEXT:.*]] = arith.addi %[[LEFT]], %c8_i32 overflow<nsw>
  // CHECK:                 %[[RIGHT:.*]] = arith.minsi %[[NEXT]], %c61_i32
  // CHECK:                 scf.for %[[Y:.*]] = %{{.*}} to %{{.*}} step %c1_i32 iter_args
  // CHECK:                   scf.for %[[X:.*]] = %[[LEFT]] to %[[RIGHT]] step %c1_i32
  // CHECK:                     arith.cmpi sge, %{{.*}}, %c0_i32 : i32
  // CHECK:                     piko.store %{{.*}}, checked @out[%{{.*}}, %{{.*}}
  // CHECK:                   } {piko.lanes}
  // CHECK:                 } {piko.rows}
  // CHECK:         } else {
  // CHECK:           scf.for %{{.*}} = %c1_i32 to %c50_i32 step %c1_i32
  // CHECK:             scf.for %{{.*}} = %c3_i32 to %c61_i32 step %c1_i32
  piko.kernel @triangle {
    %zero = arith.constant 0 : index
    %left = arith.constant 3 : i32
    %right = arith.constant 61 : i32
    %top = arith.constant 1 : i32
    %bottom = arith.constant 50 : i32
    %one = arith.constant 1 : i32
    %none = arith.constant 0 : i64
    %n = piko.load @in[%zero : index] "n" : i64
    // expected-remark@below {{where they fit, 1 comparisons and 0 conversions of these iterations take 32 bits instead of 64}}
    // expected-remark@below {{where they fit into 32 bits, 2 comparisons bound the rows of each strip of 8 columns}}
    scf.for %y = %top to %bottom step %one : i32 {
      %y64 = arith.extsi %y : i32 to i64
      %py = arith.muli %n, %y64 : i64
      scf.for %x = %left to %right step %one : i32 {
        %x64 = arith.extsi %x : i32 to i64
        %px = arith.muli %n, %x64 : i64
        %e = arith.addi %px, %py : i64
        %d = arith.subi %py, %px : i64
        %f = arith.addi %d, %n : i64
        %bits = arith.ori %e, %f : i64
        %isInside = arith.cmpi sge, %bits, %none : i64
        scf.if %isInside {
          %at = arith.index_cast %x : i32 to index
          %row = arith.index_cast %y : i32 to index
          piko.store %n, checked @out[%at, %row : index, index] "n" : i64
        }
      } {piko.lanes}
    } {piko.rows}
  }

  // Edges of 32 bits, in nested conditions; the second one is inside where it is
  // negative. Where they overflow, the loops are as they were.
  // CHECK-LABEL: piko.kernel @narrow
  // CHECK:         scf.if
  // CHECK:           scf.for {{.*}} step %c32_i32
  // CHECK-COUNT-2:     arith.fptosi
  // CHECK:             scf.for {{.*}} step %c8_i32
  // CHECK:         } else {
  // CHECK:           arith.cmpi sge, %{{.*}}, %c0_i32 : i32
  piko.kernel @narrow {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %k = piko.load @in[%zero : index] "k" : i32
    %n = piko.load @in[%zero : index] "n" : i64
    // expected-remark@below {{where they fit into 32 bits, 2 comparisons bound}}
    scf.for %y = %lo to %hi step %one : i32 {
      %py = arith.muli %k, %y : i32
      scf.for %x = %lo to %hi step %one : i32 {
        %e = arith.subi %py, %x : i32
        %isIn = arith.cmpi sge, %e, %lo : i32
        scf.if %isIn {
          %f = arith.addi %py, %x : i32
          %isUnder = arith.cmpi slt, %f, %k : i32
          scf.if %isUnder {
            %at = arith.index_cast %x : i32 to index
            %row = arith.index_cast %y : i32 to index
            piko.store %n, checked @out[%at, %row : index, index] "n" : i64
          }
        }
      } {piko.lanes}
    } {piko.rows}
  }

  // What rows hand on, and nobody uses after them, begins with what it has in the
  // strip's first row.
  // CHECK-LABEL: piko.kernel @carried
  // CHECK:         scf.if %{{.*}} {
  // CHECK:           scf.for {{.*}} step %c8_i32
  // CHECK:             %[[BEHIND:.*]] = arith.addi %{{.*}}, %{{.*}} : i64
  // CHECK:             scf.for {{.*}} iter_args(%{{.*}} = %[[BEHIND]], %{{.*}} = %{{.*}}) -> (i64, i32)
  // CHECK:         } else {
  // CHECK:           scf.for {{.*}} iter_args(%{{.*}} = %{{.*}}) -> (i64)
  piko.kernel @carried {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %none = arith.constant 0 : i64
    %n = piko.load @in[%zero : index] "n" : i64
    // expected-remark@below {{1 comparisons and 0 conversions}}
    // expected-remark@below {{1 comparisons bound the rows}}
    %end = scf.for %y = %lo to %hi step %one iter_args(%py = %n) -> i64 : i32 {
      scf.for %x = %lo to %hi step %one : i32 {
        %x64 = arith.extsi %x : i32 to i64
        %px = arith.muli %n, %x64 : i64
        %e = arith.addi %px, %py : i64
        %isIn = arith.cmpi sge, %e, %none : i64
        scf.if %isIn {
          %at = arith.index_cast %x : i32 to index
          %row = arith.index_cast %y : i32 to index
          piko.store %n, checked @out[%at, %row : index, index] "n" : i64
        }
      } {piko.lanes}
      %next = arith.addi %py, %n : i64
      scf.yield %next : i64
    } {piko.rows}
  }

  // Where lanes may be primitives, each finds the rows of its strips one after the
  // other.
  // CHECK-LABEL: piko.kernel @items
  // CHECK-NOT:     vector
  // CHECK:         scf.for {{.*}} step %c8_i32
  // CHECK:           arith.fptosi %{{.*}} : f64 to i32
  // CHECK-NOT:     vector
  // CHECK-LABEL: piko.kernel @left
  piko.kernel @items {
    %zero = arith.constant 0 : index
    %first = arith.constant 1 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %k = piko.load @in[%zero : index] "k" : i32
    scf.for %i = %zero to %first step %first {
      // expected-remark@below {{1 comparisons bound the rows}}
      scf.for %y = %lo to %hi step %one : i32 {
        %py = arith.muli %k, %y : i32
        scf.for %x = %lo to %hi step %one : i32 {
          %e = arith.subi %py, %x : i32
          %isIn = arith.cmpi sge, %e, %lo : i32
          scf.if %isIn {
            %at = arith.index_cast %x : i32 to index
            %row = arith.index_cast %y : i32 to index
            piko.store %k, checked @out[%at, %row : index, index] "k" : i32
          }
        } {piko.lanes}
      } {piko.rows}
    } {piko.lanes, piko.mapping = #piko<lanes items>}
  }

  // What is left in rows: a pixel that another one reads, one whose row and column
  // change places, what is not under a condition alone, upright bounds, and loops
  // that keep their order.
  // CHECK-NOT:     step %c8_i32
  // CHECK-LABEL: piko.kernel @end
  piko.kernel @left {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %k = piko.load @in[%zero : index] "k" : i32
    scf.for %y = %lo to %hi step %one : i32 {
      %py = arith.muli %k, %y : i32
      scf.for %x = %lo to %hi step %one : i32 {
        %e = arith.subi %py, %x : i32
        %isIn = arith.cmpi sge, %e, %lo : i32
        scf.if %isIn {
          %at = arith.index_cast %x : i32 to index
          %row = arith.index_cast %y : i32 to index
          %other = piko.load checked @out[%at, %zero : index, index] "n" : i64
          piko.store %other, checked @out[%at, %row : index, index] "n" : i64
        }
      } {piko.lanes}
    } {piko.rows}
    scf.for %y = %lo to %hi step %one : i32 {
      %py = arith.muli %k, %y : i32
      scf.for %x = %lo to %hi step %one : i32 {
        %e = arith.subi %py, %x : i32
        %isIn = arith.cmpi sge, %e, %lo : i32
        scf.if %isIn {
          %at = arith.index_cast %x : i32 to index
          %row = arith.index_cast %y : i32 to index
          %other = piko.load checked @out[%row, %at : index, index] "n" : i64
          piko.store %other, checked @out[%at, %row : index, index] "n" : i64
        }
      } {piko.lanes}
    } {piko.rows}
    scf.for %y = %lo to %hi step %one : i32 {
      %py = arith.muli %k, %y : i32
      scf.for %x = %lo to %hi step %one : i32 {
        %e = arith.subi %py, %x : i32
        %isIn = arith.cmpi sge, %e, %lo : i32
        %at = arith.index_cast %x : i32 to index
        %row = arith.index_cast %y : i32 to index
        piko.store %k, checked @out[%at, %row : index, index] "k" : i32
        scf.if %isIn {
          piko.store %e, checked @out[%at, %row : index, index] "k" : i32
        }
      } {piko.lanes}
    } {piko.rows}
    scf.for %y = %lo to %hi step %one : i32 {
      scf.for %x = %lo to %hi step %one : i32 {
        %isRight = arith.cmpi sge, %x, %k : i32
        %isBelow = arith.cmpi sge, %y, %k : i32
        %isIn = arith.andi %isRight, %isBelow : i1
        scf.if %isIn {
          %at = arith.index_cast %x : i32 to index
          %row = arith.index_cast %y : i32 to index
          piko.store %k, checked @out[%at, %row : index, index] "k" : i32
        }
      } {piko.lanes}
    } {piko.rows}
    scf.for %y = %lo to %hi step %one : i32 {
      %py = arith.muli %k, %y : i32
      scf.for %x = %lo to %hi step %one : i32 {
        %e = arith.subi %py, %x : i32
        %isIn = arith.cmpi sge, %e, %lo : i32
        scf.if %isIn {
          %at = arith.index_cast %x : i32 to index
          %row = arith.index_cast %y : i32 to index
          piko.store %k, checked @out[%at, %row : index, index] "k" : i32
        }
      } {piko.lanes}
    }
  }

  piko.kernel @end {
  }
}
