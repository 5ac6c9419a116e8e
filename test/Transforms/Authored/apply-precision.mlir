// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-apply-precision))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @F {"a" : f32 at 0, "b" : f32 at 4, "c" : f32 at 8, "d" : f32 at 12, "w" : f64 at 16} size 24 align 8

// A phase that says nothing, or that it is strict, stays as it is.
// CHECK-LABEL: piko.pipeline @Strict
// CHECK-COUNT-2: piko.process {
// CHECK:         arith.mulf
// CHECK-NEXT:    arith.addf
// CHECK-NOT:   math.fma
piko.pipeline @Strict rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %w = piko.get %f "w" : !piko.prim<@F> -> f64
      piko.emit 0 (%a, %a, %a, %a, %w) : f32, f32, f32, f32, f64
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process precision strict {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %p = arith.mulf %a, %a : f32
      %s = arith.addf %p, %a : f32
      piko.store %s, @out[%i : index] "a" : f32
      piko.return
    }
  }
}

// Additions of products, with all signs; of two products the left one. The
// assign phase says where things go, and is strict.
// CHECK-LABEL: piko.pipeline @Contracted
piko.pipeline @Contracted rank 1 {
  piko.buffer @out : @F
  piko.source @s
  // CHECK:      piko.assign {
  // CHECK:        arith.mulf
  // CHECK-NEXT:   arith.addf
  // CHECK:      piko.process {
  // CHECK-DAG:    %[[A:.*]] = piko.get %{{.*}} "a"
  // CHECK-DAG:    %[[B:.*]] = piko.get %{{.*}} "b"
  // CHECK-DAG:    %[[C:.*]] = piko.get %{{.*}} "c"
  // CHECK-DAG:    %[[D:.*]] = piko.get %{{.*}} "d"
  // CHECK-DAG:    %[[W:.*]] = piko.get %{{.*}} "w"
  // CHECK-NOT:    arith.addf
  // CHECK-NOT:    arith.subf
  // CHECK:        %[[SUM:.*]] = math.fma %[[A]], %[[B]], %[[C]] : f32
  // CHECK:        %[[OTHER:.*]] = math.fma %[[A]], %[[B]], %[[C]] : f32
  // CHECK:        %[[MINUS_C:.*]] = arith.negf %[[C]]
  // CHECK:        %[[DIFFERENCE:.*]] = math.fma %[[A]], %[[B]], %[[MINUS_C]]
  // CHECK:        %[[MINUS_A:.*]] = arith.negf %[[A]]
  // CHECK:        %[[FROM:.*]] = math.fma %[[MINUS_A]], %[[B]], %[[C]]
  // CHECK:        %[[MINUS:.*]] = arith.negf %[[A]]
  // CHECK:        %[[NEGATIVE:.*]] = math.fma %[[MINUS]], %[[B]], %[[C]]
  // CHECK:        %[[BACK:.*]] = math.fma %[[A]], %[[B]], %[[C]]
  // CHECK:        %[[CD:.*]] = arith.mulf %[[C]], %[[D]]
  // CHECK:        %[[DOT:.*]] = math.fma %[[A]], %[[B]], %[[CD]]
  // CHECK:        %[[WIDE:.*]] = math.fma %[[W]], %[[W]], %[[W]] : f64
  // CHECK:        piko.store %[[SUM]], @out
  // CHECK-NEXT:   piko.store %[[OTHER]], @out
  // CHECK-NEXT:   piko.store %[[DIFFERENCE]], @out
  // CHECK-NEXT:   piko.store %[[FROM]], @out
  // CHECK-NEXT:   piko.store %[[NEGATIVE]], @out
  // CHECK-NEXT:   piko.store %[[BACK]], @out
  // CHECK-NEXT:   piko.store %[[DOT]], @out
  // CHECK-NEXT:   piko.store %[[WIDE]], @out
  // CHECK-NEXT:   piko.store %[[CD]], @out
  piko.stage @s bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %p = arith.mulf %a, %a : f32
      %s = arith.addf %p, %a : f32
      %x = arith.fptosi %s : f32 to i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    // expected-remark @below {{stage 's' is contracted: 8 additions are contracted, 0 divisions and 0 square roots approximated}}
    piko.process precision contracted {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %b = piko.get %f "b" : !piko.prim<@F> -> f32
      %c = piko.get %f "c" : !piko.prim<@F> -> f32
      %d = piko.get %f "d" : !piko.prim<@F> -> f32
      %w = piko.get %f "w" : !piko.prim<@F> -> f64
      %ab = arith.mulf %a, %b : f32
      %sum = arith.addf %ab, %c : f32
      %other = arith.addf %c, %ab : f32
      %difference = arith.subf %ab, %c : f32
      %from = arith.subf %c, %ab : f32
      %minus = arith.negf %ab : f32
      %negative = arith.addf %minus, %c : f32
      %back = arith.subf %c, %minus : f32
      %cd = arith.mulf %c, %d : f32
      %dot = arith.addf %ab, %cd : f32
      %ww = arith.mulf %w, %w : f64
      %wide = arith.addf %ww, %w : f64
      piko.store %sum, @out[%i : index] "a" : f32
      piko.store %other, @out[%i : index] "a" : f32
      piko.store %difference, @out[%i : index] "a" : f32
      piko.store %from, @out[%i : index] "a" : f32
      piko.store %negative, @out[%i : index] "a" : f32
      piko.store %back, @out[%i : index] "a" : f32
      piko.store %dot, @out[%i : index] "a" : f32
      piko.store %wide, @out[%i : index] "w" : f64
      piko.store %cd, @out[%i : index] "a" : f32
      piko.return
    }
  }
}

// A division contracts nothing by itself.
// CHECK-LABEL: piko.pipeline @Divided
// CHECK:         %[[Q:.*]] = arith.divf
// CHECK-NEXT:    math.sqrt %[[Q]]
// CHECK-NEXT:    arith.addf
piko.pipeline @Divided rank 1 {
  piko.buffer @out : @F
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    // expected-remark @below {{stage 's' is contracted: 0 additions}}
    piko.process precision contracted {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %b = piko.get %f "b" : !piko.prim<@F> -> f32
      %q = arith.divf %a, %b : f32
      %r = math.sqrt %q : f32
      %s = arith.addf %q, %r : f32
      piko.store %s, @out[%i : index] "a" : f32
      piko.return
    }
  }
}

// A quotient is a product, which is contracted with what follows. Of a constant
// the reciprocal is the nearest float, unless that has fewer bits.
// CHECK-LABEL: piko.pipeline @Quotient
// CHECK-DAG:     %[[A:.*]] = piko.get %{{.*}} "a"
// CHECK-DAG:     %[[B:.*]] = piko.get %{{.*}} "b"
// CHECK:         %[[INVERSE:.*]] = piko.approximate_reciprocal %[[B]] : f32
// CHECK:         %[[SUM:.*]] = math.fma %[[A]], %[[INVERSE]], %[[A]]
// CHECK:         %[[THIRD:.*]] = arith.constant 0.333333343
// CHECK:         %[[BY_THREE:.*]] = arith.mulf %[[A]], %[[THIRD]]
// CHECK:         %[[BY_TINY:.*]] = arith.divf %[[A]], %{{.*}} : f32
// CHECK:         %[[WIDE:.*]] = arith.divf %{{.*}} : f64
// CHECK:         piko.store %[[SUM]], @out
// CHECK-NEXT:    piko.store %[[BY_THREE]], @out
// CHECK-NEXT:    piko.store %[[BY_TINY]], @out
// CHECK-NEXT:    piko.store %[[WIDE]], @out
piko.pipeline @Quotient rank 1 {
  piko.buffer @out : @F
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    // expected-remark @below {{stage 's' is relaxed: 1 additions are contracted, 2 divisions and 0 square roots approximated}}
    piko.process precision relaxed {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %three = arith.constant 3.0 : f32
      %tiny = arith.constant 1.0e-40 : f32
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %b = piko.get %f "b" : !piko.prim<@F> -> f32
      %w = piko.get %f "w" : !piko.prim<@F> -> f64
      %q = arith.divf %a, %b : f32
      %sum = arith.addf %q, %a : f32
      %byThree = arith.divf %a, %three : f32
      %byTiny = arith.divf %a, %tiny : f32
      %wide = arith.divf %w, %w : f64
      piko.store %sum, @out[%i : index] "a" : f32
      piko.store %byThree, @out[%i : index] "a" : f32
      piko.store %byTiny, @out[%i : index] "a" : f32
      piko.store %wide, @out[%i : index] "w" : f64
      piko.return
    }
  }
}

// All ways of writing an inverse square root are one approximation: 1 / sqrt(x),
// where sqrt(x) is used, too; and a / sqrt(x).
// CHECK-LABEL: piko.pipeline @Roots
// CHECK-DAG:     %[[X:.*]] = piko.get %{{.*}} "a"
// CHECK-DAG:     %[[Y:.*]] = piko.get %{{.*}} "b"
// CHECK-NOT:     arith.divf
// CHECK-NOT:     math.sqrt
// CHECK:         %[[ROOT:.*]] = piko.approximate_sqrt %[[X]] : f32
// CHECK:         %[[INVERSE:.*]] = piko.approximate_rsqrt %[[X]] : f32
// CHECK:         %[[FACTOR:.*]] = piko.approximate_rsqrt %[[X]] : f32
// CHECK:         %[[SCALED:.*]] = arith.mulf %[[Y]], %[[FACTOR]]
// CHECK:         piko.store %[[ROOT]], @out
// CHECK-NEXT:    piko.store %[[INVERSE]], @out
// CHECK-NEXT:    piko.store %[[SCALED]], @out
piko.pipeline @Roots rank 1 {
  piko.buffer @out : @F
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    // expected-remark @below {{stage 's' is relaxed: 0 additions are contracted, 2 divisions and 1 square roots approximated}}
    piko.process precision relaxed {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %one = arith.constant 1.0 : f32
      %x = piko.get %f "a" : !piko.prim<@F> -> f32
      %y = piko.get %f "b" : !piko.prim<@F> -> f32
      %root = math.sqrt %x : f32
      %inverse = arith.divf %one, %root : f32
      %scaled = arith.divf %y, %root : f32
      piko.store %root, @out[%i : index] "a" : f32
      piko.store %inverse, @out[%i : index] "a" : f32
      piko.store %scaled, @out[%i : index] "a" : f32
      piko.return
    }
  }
}

// A product that both sides of a condition yield is contracted with what is added
// after it; one that only one side yields is none.
// CHECK-LABEL: piko.pipeline @Sides
// CHECK:         %[[SIDES:.*]]:4 = scf.if
// CHECK:           scf.yield %{{.*}}, %{{.*}}, %[[A:.*]], %[[B:.*]] : f32, f32, f32, f32
// CHECK:         } else {
// CHECK:           scf.yield %{{.*}}, %{{.*}}, %[[B]], %[[A]] : f32, f32, f32, f32
// CHECK:         math.fma %[[SIDES]]#2, %[[SIDES]]#3, %[[A]]
// CHECK:         arith.addf %[[SIDES]]#1, %[[B]]
piko.pipeline @Sides rank 1 {
  piko.buffer @out : @F
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    // expected-remark @below {{stage 's' is contracted: 1 additions are contracted, 0 divisions and 0 square roots approximated}}
    piko.process precision contracted {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %b = piko.get %f "b" : !piko.prim<@F> -> f32
      %less = arith.cmpf olt, %a, %b : f32
      %sides:2 = scf.if %less -> (f32, f32) {
        %product = arith.mulf %a, %b : f32
        scf.yield %product, %product : f32, f32
      } else {
        %product = arith.mulf %b, %a : f32
        scf.yield %product, %a : f32, f32
      }
      %sum = arith.addf %sides#0, %a : f32
      %other = arith.addf %sides#1, %b : f32
      piko.store %sum, @out[%i : index] "a" : f32
      piko.store %other, @out[%i : index] "a" : f32
      piko.return
    }
  }
}

// Functions are chosen by what a phase allows: nothing, so much as it says, or 4 where
// it is relaxed. A branch that is not taken is gone.
// CHECK-LABEL: piko.pipeline @Functions
piko.pipeline @Functions rank 1 {
  piko.buffer @out : @F
  piko.source @exact
  piko.source @one
  piko.source @loose
  piko.source @tight
  // CHECK:      piko.stage @exact
  // CHECK:        piko.process {
  // CHECK-NOT:    scf.if
  // CHECK:        arith.addf
  // CHECK-NOT:    arith.mulf
  piko.stage @exact bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %near = piko.allows_ulps 1
      %r = scf.if %near -> f32 {
        %m = arith.mulf %a, %a : f32
        scf.yield %m : f32
      } else {
        %m = arith.addf %a, %a : f32
        scf.yield %m : f32
      }
      piko.store %r, @out[%i : index] "a" : f32
      piko.return
    }
  }
  // CHECK:      piko.stage @one
  // CHECK:        piko.process {
  // CHECK:        arith.divf
  piko.stage @one bins [0] threads 1 : @F -> [] {
    piko.process ulps 1 {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %cheap = piko.allows_ulps 4
      %near = piko.allows_ulps 1
      %d = arith.divf %a, %a : f32
      %n = arith.select %near, %d, %a : f32
      %r = arith.select %cheap, %a, %n : f32
      piko.store %r, @out[%i : index] "a" : f32
      piko.return
    }
  }
  // CHECK:      piko.stage @loose
  // CHECK:        piko.store %{{.*}}, @out
  // CHECK-NOT:    arith.constant true
  piko.stage @loose bins [0] threads 1 : @F -> [] {
    // expected-remark @below {{stage 'loose' is relaxed: 0 additions are contracted, 0 divisions}}
    piko.process precision relaxed {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %cheap = piko.allows_ulps 4
      scf.if %cheap {
        piko.store %a, @out[%i : index] "a" : f32
      } else {
        %d = arith.divf %a, %a : f32
        piko.store %d, @out[%i : index] "a" : f32
      }
      piko.return
    }
  }
  // CHECK:      piko.stage @tight
  // CHECK-NOT:    piko.store
  piko.stage @tight bins [0] threads 1 : @F -> [] {
    // expected-remark @below {{stage 'tight' is relaxed}}
    piko.process precision relaxed ulps 1 {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %cheap = piko.allows_ulps 4
      scf.if %cheap {
        piko.store %a, @out[%i : index] "a" : f32
      }
      piko.return
    }
  }
}
