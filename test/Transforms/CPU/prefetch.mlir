// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-prefetch),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"v" : i32 at 0, "w" : i32 at 4} size 8 align 4
piko.record @V {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.buffer @vertices : @V
  piko.buffer @computed : @V
  piko.buffer @rare : @V
  piko.buffer @out : @V
  piko.source @all
  piko.edge @all[0] -> @bins

  // Primitives of a stage with one bin come as they were made.
  // CHECK:       piko.kernel @kernel_all
  // CHECK-NOT:     piko.prefetch
  piko.stage @all bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %w = piko.get %f "w" : !piko.prim<@F> -> i32
      %x = piko.load @vertices[%v : i32] "x" : f32
      piko.store %x, @out[%v : i32] "x" : f32
      piko.emit 0 (%v, %w) : i32, i32
      piko.return
    }
  }

  // Those of a bin are asked for, and what they refer to: once for each element,
  // not where an index is computed, nor on the long side of a condition.
  // CHECK:       piko.kernel @kernel_bins
  // CHECK:         %[[LO:.*]], %[[HI:.*]] = piko.storage.bucket_range
  // CHECK:         %[[LAST:.*]] = arith.subi %[[HI]], %c1
  // CHECK:         scf.for %[[I:.*]] = %[[LO]] to %[[HI]]
  // CHECK:           %[[FAR:.*]] = arith.addi %[[I]], %c16
  // CHECK:           piko.cpu.prefetch_item %[[BINS:.*]][%[[FAR]]]
  // CHECK:           %[[I8:.*]] = arith.addi %[[I]], %c8
  // CHECK:           %[[NEAR:.*]] = arith.minsi %[[I8]], %[[LAST]]
  // CHECK:           %[[ITEM:.*]] = piko.storage.item %[[BINS]][%[[NEAR]]]
  // CHECK-NEXT:      %[[V:.*]] = piko.get %[[ITEM]] "v"
  // CHECK-NEXT:      piko.prefetch @vertices[%[[V]] : i32]
  // CHECK-NEXT:      %[[W:.*]] = piko.get %[[ITEM]] "w"
  // CHECK-NEXT:      piko.prefetch @vertices[%[[W]] : i32]
  // CHECK-NOT:       piko.prefetch
  // CHECK:           piko.storage.item %[[BINS]][%[[I]]]
  // CHECK-NOT:       piko.prefetch
  piko.stage @bins bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %v : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %w = piko.get %f "w" : !piko.prim<@F> -> i32
      %x = piko.load @vertices[%v : i32] "x" : f32
      %y = piko.load @vertices[%v : i32] "y" : f32
      %sum = arith.addi %v, %w : i32
      %other = piko.load @computed[%sum : i32] "x" : f32
      %is_near = arith.cmpf olt, %x, %y : f32
      scf.if %is_near {
        %i = arith.index_cast %w : i32 to index
        %z = piko.load @vertices[%i : index] "x" : f32
        %0 = arith.addf %z, %other : f32
        %1 = arith.mulf %0, %z : f32
        %2 = arith.addf %1, %z : f32
        %3 = arith.mulf %2, %z : f32
        %4 = arith.addf %3, %z : f32
        %5 = arith.mulf %4, %z : f32
        %6 = arith.addf %5, %z : f32
        %7 = arith.mulf %6, %z : f32
        %8 = arith.addf %7, %z : f32
        %9 = arith.mulf %8, %z : f32
        %10 = arith.addf %9, %z : f32
        %11 = arith.mulf %10, %z : f32
        %12 = arith.addf %11, %z : f32
        %13 = arith.mulf %12, %z : f32
        piko.store %13, @out[%v : i32] "x" : f32
      } else {
        %r = piko.load @rare[%w : i32] "x" : f32
        %0 = arith.addf %r, %other : f32
        %1 = arith.mulf %0, %r : f32
        %2 = arith.addf %1, %r : f32
        %3 = arith.mulf %2, %r : f32
        %4 = arith.addf %3, %r : f32
        %5 = arith.mulf %4, %r : f32
        %6 = arith.addf %5, %r : f32
        %7 = arith.mulf %6, %r : f32
        %8 = arith.addf %7, %r : f32
        %9 = arith.mulf %8, %r : f32
        %10 = arith.addf %9, %r : f32
        %11 = arith.mulf %10, %r : f32
        %12 = arith.addf %11, %r : f32
        %13 = arith.mulf %12, %r : f32
        %14 = arith.addf %13, %r : f32
        %15 = arith.mulf %14, %r : f32
        %16 = arith.addf %15, %r : f32
        %17 = arith.mulf %16, %r : f32
        %18 = arith.addf %17, %r : f32
        %19 = arith.mulf %18, %r : f32
        %20 = arith.addf %19, %r : f32
        %21 = arith.mulf %20, %r : f32
        %22 = arith.addf %21, %r : f32
        %23 = arith.mulf %22, %r : f32
        %24 = arith.addf %23, %r : f32
        %25 = arith.mulf %24, %r : f32
        %26 = arith.addf %25, %r : f32
        %27 = arith.mulf %26, %r : f32
        %28 = arith.addf %27, %r : f32
        %29 = arith.mulf %28, %r : f32
        %30 = arith.addf %29, %r : f32
        %31 = arith.mulf %30, %r : f32
        %32 = arith.addf %31, %r : f32
        %33 = arith.mulf %32, %r : f32
        piko.store %33, @out[%v : i32] "y" : f32
      }
      piko.return
    }
  }
}

piko.record @Narrow {"a" : i8 at 0, "b" : i16 at 2, "c" : i64 at 8} size 16 align 8

// A field of another width is extended as for the access.
// CHECK-LABEL: piko.pipeline @Widths
// CHECK:       piko.kernel @kernel_bins
// CHECK:           piko.cpu.prefetch_item
// CHECK:           %[[ITEM:.*]] = piko.storage.item
// CHECK-NEXT:      %[[A:.*]] = piko.get %[[ITEM]] "a" : !piko.prim<@Narrow> -> i8
// CHECK-NEXT:      %[[WIDE_A:.*]] = arith.extsi %[[A]] : i8 to i32
// CHECK-NEXT:      piko.prefetch @vertices[%[[WIDE_A]] : i32]
// CHECK-NEXT:      %[[B:.*]] = piko.get %[[ITEM]] "b" : !piko.prim<@Narrow> -> i16
// CHECK-NEXT:      %[[WIDE_B:.*]] = arith.extui %[[B]] : i16 to i64
// CHECK-NEXT:      piko.prefetch @vertices[%[[WIDE_B]] : i64]
// CHECK-NEXT:      %[[C:.*]] = piko.get %[[ITEM]] "c" : !piko.prim<@Narrow> -> i64
// CHECK-NEXT:      piko.prefetch @vertices[%[[C]] : i64]
// CHECK-NOT:       piko.prefetch
piko.pipeline @Widths rank 1 {
  piko.buffer @vertices : @V
  piko.buffer @out : @V
  piko.source @all
  piko.edge @all[0] -> @bins
  piko.stage @all bins [0] threads 1 : @Narrow -> [@Narrow] {
    piko.process {
    ^bb0(%f: !piko.prim<@Narrow>):
      %a = piko.get %f "a" : !piko.prim<@Narrow> -> i8
      %b = piko.get %f "b" : !piko.prim<@Narrow> -> i16
      %c = piko.get %f "c" : !piko.prim<@Narrow> -> i64
      piko.emit 0 (%a, %b, %c) : i8, i16, i64
      piko.return
    }
  }
  piko.stage @bins bins [8] threads 1 : @Narrow -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Narrow>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Narrow>):
      %a = piko.get %f "a" : !piko.prim<@Narrow> -> i8
      %wide_a = arith.extsi %a : i8 to i32
      %b = piko.get %f "b" : !piko.prim<@Narrow> -> i16
      %wide_b = arith.extui %b : i16 to i64
      %c = piko.get %f "c" : !piko.prim<@Narrow> -> i64
      %x = piko.load @vertices[%wide_a : i32] "x" : f32
      %y = piko.load @vertices[%wide_b : i64] "x" : f32
      %z = piko.load @vertices[%c : i64] "x" : f32
      %0 = arith.addf %x, %y : f32
      %1 = arith.addf %0, %z : f32
      piko.store %1, @out[%c : i64] "x" : f32
      piko.return
    }
  }
}

piko.record @Small {"x" : i32 at 0, "y" : f64 at 8} size 16 align 8
piko.record @Large {"x" : i32 at 0, "y" : f64 at 8, "z" : f64 at 16} size 24 align 8

// Large primitives that refer to nothing are asked for as well, where they come
// from other bins.
// CHECK-LABEL: piko.pipeline @Scattered
// CHECK:       piko.kernel @kernel_large
// CHECK:         piko.storage.bucket_range
// CHECK-NEXT:    scf.for %[[I:.*]] =
// CHECK:           %[[FAR:.*]] = arith.addi %[[I]], %c16
// CHECK:           piko.cpu.prefetch_item %{{.*}}[%[[FAR]]] : !piko.bins<@Large>
// CHECK-NEXT:      piko.storage.item %{{.*}}[%[[I]]]
// Not those that stay in the bin that they were made in, nor small ones.
// CHECK:       piko.kernel @kernel_kept
// CHECK-NOT:     piko.cpu.prefetch_item
// CHECK:       piko.kernel @kernel_small
// CHECK-NOT:     piko.cpu.prefetch_item
piko.pipeline @Scattered rank 1 {
  piko.source @large
  piko.edge @large[0] -> @kept
  piko.edge @kept[0] -> @small
  piko.stage @large bins [8] threads 1 : @Large -> [@Large] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Large>):
      %x = piko.get %f "x" : !piko.prim<@Large> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Large>):
      %x = piko.get %f "x" : !piko.prim<@Large> -> i32
      %y = piko.get %f "y" : !piko.prim<@Large> -> f64
      %z = piko.get %f "z" : !piko.prim<@Large> -> f64
      piko.emit 0 (%x, %y, %z) : i32, f64, f64
      piko.return
    }
  }
  piko.stage @kept bins [8] threads 1 : @Large -> [@Small] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Large>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Large>):
      %x = piko.get %f "x" : !piko.prim<@Large> -> i32
      %y = piko.get %f "y" : !piko.prim<@Large> -> f64
      piko.emit 0 (%x, %y) : i32, f64
      piko.return
    }
  }
  piko.stage @small bins [8] threads 1 : @Small -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Small>):
      %x = piko.get %f "x" : !piko.prim<@Small> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Small>):
      piko.return
    }
  }
}
