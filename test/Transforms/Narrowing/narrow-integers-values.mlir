// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-narrow-integers),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

piko.record @V {"n" : i64 at 0, "f" : f32 at 8} size 16 align 8

piko.pipeline @P rank 2 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @V -> [] {}

  // The number is the function whose sign is taken, without a bias: shifted back,
  // and what had been shifted out.
  // CHECK-LABEL: piko.kernel @weights
  // CHECK:         scf.if %{{.*}} {
  // CHECK-NEXT:      scf.if %{{.*}} {
  // CHECK-NEXT:        scf.for
  // CHECK:               %[[EDGE:.*]] = arith.addi %{{.*}} : i32
  // CHECK:               arith.cmpi sge, %[[EDGE]], %c0_i32 : i32
  // CHECK:               %[[UP:.*]] = arith.shli %[[EDGE]], %c8_i32 : i32
  // CHECK:               %[[ALL:.*]] = arith.addi %[[UP]], %{{.*}} : i32
  // CHECK:               arith.sitofp %[[ALL]] : i32 to f32
  // CHECK:           } else {
  // CHECK:             scf.for
  // CHECK:               arith.cmpi sge, %{{.*}}, %c0_i32 : i32
  // CHECK:               arith.sitofp %{{.*}} : i64 to f32
  // CHECK:         } else {
  // CHECK:           scf.for
  // CHECK:             arith.cmpi sge, %{{.*}}, %c0_i64 : i64
  // CHECK:             arith.sitofp %{{.*}} : i64 to f32
  piko.kernel @weights {
    %zero = arith.constant 0 : index
    %none = arith.constant 0 : i64
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %c256 = arith.constant 256 : i64
    %n = piko.load @in[%zero : index] "n" : i64
    %bias = piko.load @in[%zero : index] "n" : i64
    %step = arith.muli %n, %c256 : i64
    // expected-remark @below {{where they fit, 1 comparisons and 1 conversions of these iterations take 32 bits instead of 64}}
    scf.for %x = %lo to %hi step %one : i32 {
      %x64 = arith.extsi %x : i32 to i64
      %px = arith.muli %step, %x64 : i64
      %e = arith.addi %n, %px : i64
      %biased = arith.addi %e, %bias : i64
      %isInside = arith.cmpi sge, %biased, %none : i64
      scf.if %isInside {
        %weight = arith.sitofp %e : i64 to f32
        piko.store %weight, @out[%x : i32] "f" : f32
      }
    } {piko.lanes}
  }

  // Without a sign there are two versions.
  // CHECK-LABEL: piko.kernel @alone
  // CHECK:         scf.if %{{.*}} {
  // CHECK-NEXT:      scf.for
  // CHECK:             arith.sitofp %{{.*}} : i32 to f32
  // CHECK:         } else {
  // CHECK-NEXT:      scf.for
  // CHECK:             arith.sitofp %{{.*}} : i64 to f32
  piko.kernel @alone {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %n = piko.load @in[%zero : index] "n" : i64
    // expected-remark @below {{0 comparisons and 1 conversions}}
    scf.for %x = %lo to %hi step %one : i32 {
      %x64 = arith.extsi %x : i32 to i64
      %e = arith.muli %n, %x64 : i64
      %f = arith.sitofp %e : i64 to f32
      piko.store %f, @out[%x : i32] "f" : f32
    } {piko.lanes}
  }

  // Neither is what is not affine, nor what is unsigned, nor the same for all
  // pixels of a row.
  // CHECK-LABEL: piko.kernel @kept
  // CHECK-NOT:     scf.if
  // CHECK-COUNT-2: arith.sitofp %{{.*}} : i64 to f32
  // CHECK:         arith.uitofp %{{.*}} : i64 to f32
  piko.kernel @kept {
    %zero = arith.constant 0 : index
    %lo = arith.constant 0 : i32
    %hi = arith.constant 64 : i32
    %one = arith.constant 1 : i32
    %n = piko.load @in[%zero : index] "n" : i64
    scf.for %y = %lo to %hi step %one : i32 {
      %y64 = arith.extsi %y : i32 to i64
      %e = arith.muli %n, %y64 : i64
      scf.for %x = %lo to %hi step %one : i32 {
        %x64 = arith.extsi %x : i32 to i64
        %square = arith.muli %x64, %x64 : i64
        %px = arith.muli %n, %x64 : i64
        %a = arith.sitofp %e : i64 to f32
        %b = arith.sitofp %square : i64 to f32
        %c = arith.uitofp %px : i64 to f32
        %ab = arith.addf %a, %b : f32
        %abc = arith.addf %ab, %c : f32
        piko.store %abc, @out[%x : i32] "f" : f32
      } {piko.lanes}
    }
  }
}
