// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-vectorize),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"v" : i32 at 0, "w" : i32 at 4} size 8 align 4
piko.record @V {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.buffer @vertices : @V
  piko.buffer @lights : @V
  piko.buffer @out : @V
  piko.source @reads
  piko.source @sums
  piko.source @chooses
  piko.source @enters
  piko.source @little
  piko.source @written

  // Reads go one by one, with a test of the index; the rest in vectors.
  // CHECK:       piko.kernel @kernel_reads
  // CHECK:         %[[GAVE_UP:.*]] = memref.alloca() {alignment = 64 : i64} : memref<64xi8>
  // CHECK:         scf.for %[[B:.*]] = %{{.*}} to %{{.*}} step %c64
  // CHECK:           scf.for %[[I:.*]] = %[[B]] to %[[E:.*]] step %c1
  // CHECK:             %[[AT:.*]] = arith.subi %[[I]], %[[B]]
  // CHECK:             %[[T:.*]] = piko.storage.item %{{.*}}[%[[I]]]
  // CHECK:             %[[V:.*]] = piko.get %[[T]] "v"
  // CHECK:             %[[INSIDE:.*]] = arith.cmpi ult
  // CHECK:             %[[XY:.*]]:2 = scf.if %[[INSIDE]]
  // CHECK-DAG:           piko.load checked @vertices[%[[V]] : i32] "x"
  // CHECK-DAG:           piko.load checked @vertices[%[[V]] : i32] "y"
  // CHECK:             memref.store %[[XY]]#{{.}}, %[[XS:.*]][%[[AT]]]
  // CHECK:             memref.store %[[XY]]#{{.}}, %[[YS:.*]][%[[AT]]]
  // CHECK:             memref.store %{{.*}}, %[[GAVE_UP]][%[[AT]]]
  // CHECK:           } {piko.reads}
  // CHECK:           scf.for %[[G:.*]] = %c0 to %{{.*}} step %c16
  // CHECK-DAG:         vector.load %[[XS]][%[[G]]] : memref<64xf32>, vector<16xf32>
  // CHECK-DAG:         vector.load %[[YS]][%[[G]]] : memref<64xf32>, vector<16xf32>
  // CHECK:             arith.addf %{{.*}} : vector<16xf32>
  // CHECK:             arith.mulf %{{.*}} : vector<16xf32>
  // CHECK:             vector.store %{{.*}}, %[[SUMS:.*]][%[[G]]]
  // CHECK:           scf.for %[[I:.*]] = %[[B]] to %[[E]] step %c1
  // CHECK:             %[[LEFT:.*]] = memref.load %[[GAVE_UP]]
  // CHECK:             %[[AGAIN:.*]] = arith.cmpi ne, %[[LEFT]]
  // CHECK:             scf.if %[[AGAIN]]
  // CHECK:               piko.load @vertices
  // CHECK:               arith.mulf %{{.*}} : f32
  // CHECK:             } else {
  // CHECK-NOT:           arith.mulf
  // CHECK:               %[[SUM:.*]] = memref.load %[[SUMS]]
  // CHECK:               piko.store %[[SUM]], @out
  piko.stage @reads bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %x = piko.load @vertices[%v : i32] "x" : f32
      %y = piko.load @vertices[%v : i32] "y" : f32
      %0 = arith.addf %x, %y : f32
      %1 = arith.mulf %0, %y : f32
      %2 = arith.addf %1, %y : f32
      %3 = arith.mulf %2, %y : f32
      %4 = arith.addf %3, %y : f32
      %5 = arith.mulf %4, %y : f32
      %6 = arith.addf %5, %y : f32
      %7 = arith.mulf %6, %y : f32
      %8 = arith.addf %7, %y : f32
      %9 = arith.mulf %8, %y : f32
      %10 = arith.addf %9, %y : f32
      %11 = arith.mulf %10, %y : f32
      %12 = arith.addf %11, %y : f32
      %13 = arith.mulf %12, %y : f32
      %14 = arith.addf %13, %y : f32
      %15 = arith.mulf %14, %y : f32
      %16 = arith.addf %15, %y : f32
      %17 = arith.mulf %16, %y : f32
      %18 = arith.addf %17, %y : f32
      %19 = arith.mulf %18, %y : f32
      %20 = arith.addf %19, %y : f32
      %21 = arith.mulf %20, %y : f32
      %22 = arith.addf %21, %y : f32
      %23 = arith.mulf %22, %y : f32
      %24 = arith.addf %23, %y : f32
      %25 = arith.mulf %24, %y : f32
      %26 = arith.addf %25, %y : f32
      %27 = arith.mulf %26, %y : f32
      %28 = arith.addf %27, %y : f32
      %29 = arith.mulf %28, %y : f32
      %30 = arith.addf %29, %y : f32
      %31 = arith.mulf %30, %y : f32
      piko.store %31, @out[%v : i32] "x" : f32
      piko.return
    }
  }

  // A loop of as many iterations for all is a loop of vectors; what it reads is
  // read once for all.
  // CHECK:       piko.kernel @kernel_sums
  // CHECK:         step %c16
  // CHECK:           scf.while (%{{.*}} = %{{.*}}, %[[K:.*]] = %c0_i32, %{{.*}} = %{{.*}}) : (vector<16xf32>, i32, vector<16xi1>)
  // CHECK:           do
  // CHECK:             %[[LIGHT:.*]] = scf.if %{{.*}} -> (f32)
  // CHECK:               piko.load checked @lights
  // CHECK:             %[[ALL:.*]] = vector.broadcast %[[LIGHT]] : f32 to vector<16xf32>
  // CHECK:             arith.mulf %{{.*}}, %[[ALL]] : vector<16xf32>
  // CHECK:             math.sqrt %{{.*}} : vector<16xf32>
  piko.stage @sums bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %w = piko.get %f "w" : !piko.prim<@F> -> i32
      %x = arith.sitofp %w : i32 to f32
      %c0 = arith.constant 0 : i32
      %c1 = arith.constant 1 : i32
      %count = piko.extent @lights[0]
      %n = arith.index_cast %count : index to i32
      %sum:2 = scf.while (%s = %x, %k = %c0) : (f32, i32) -> (f32, i32) {
        %more = arith.cmpi slt, %k, %n : i32
        scf.condition(%more) %s, %k : f32, i32
      } do {
      ^bb0(%s: f32, %k: i32):
        %light = piko.load @lights[%k : i32] "x" : f32
        %0 = arith.mulf %x, %light : f32
        %1 = arith.mulf %0, %0 : f32
        %2 = math.sqrt %1 : f32
        %3 = arith.addf %s, %2 : f32
        %4 = arith.addi %k, %c1 : i32
        scf.yield %3, %4 : f32, i32
      }
      piko.store %sum#0, @out[%v : i32] "x" : f32
      piko.return
    }
  }

  // Both sides of a condition are computed. One that cannot be sends its lanes
  // to the original body; behind a statement, the shorter side goes on.
  // CHECK:       piko.kernel @kernel_chooses
  // CHECK:         } {piko.reads}
  // CHECK:         step %c16
  // CHECK-NOT:       scf.if
  // CHECK:           arith.select %{{.*}} : vector<16xi1>, vector<16xf32>
  // CHECK:         scf.for
  // CHECK:           scf.if
  // CHECK:             memref.store %{{.*}} : memref<4xf32>
  // CHECK:           } else {
  // CHECK-NOT:         memref<4xf32>
  // CHECK:             %[[LESS:.*]] = arith.cmpi ne
  // CHECK-NEXT:        scf.if %[[LESS]]
  // CHECK-NEXT:          memref.load
  // CHECK-NEXT:          piko.store
  piko.stage @chooses bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %array = memref.alloca() : memref<4xf32>
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %w = piko.get %f "w" : !piko.prim<@F> -> i32
      %c0 = arith.constant 0 : i32
      %c3 = arith.constant 3 : i32
      %i0 = arith.constant 0 : index
      %x = arith.sitofp %w : i32 to f32
      %is_positive = arith.cmpi sgt, %w, %c0 : i32
      %is_few = arith.cmpi slt, %w, %c3 : i32
      %a = scf.if %is_positive -> f32 {
        %0 = arith.addf %x, %x : f32
        %1 = arith.mulf %0, %x : f32
        scf.yield %1 : f32
      } else {
        %0 = arith.subf %x, %x : f32
        scf.yield %0 : f32
      }
      %b = scf.if %is_few -> f32 {
        memref.store %a, %array[%i0] : memref<4xf32>
        %0 = memref.load %array[%i0] : memref<4xf32>
        scf.yield %0 : f32
      } else {
        %0 = arith.mulf %a, %x : f32
        %1 = arith.addf %0, %x : f32
        %2 = arith.mulf %1, %x : f32
        %3 = arith.addf %2, %x : f32
        %4 = arith.mulf %3, %x : f32
        %5 = arith.addf %4, %x : f32
        %6 = arith.mulf %5, %x : f32
        %7 = arith.addf %6, %x : f32
        %8 = arith.mulf %7, %x : f32
        %9 = arith.addf %8, %x : f32
        %10 = arith.mulf %9, %x : f32
        %11 = arith.addf %10, %x : f32
        %12 = arith.mulf %11, %x : f32
        %13 = arith.addf %12, %x : f32
        %14 = arith.mulf %13, %x : f32
        %15 = arith.addf %14, %x : f32
        %16 = arith.mulf %15, %x : f32
        %17 = arith.addf %16, %x : f32
        %18 = arith.mulf %17, %x : f32
        %19 = arith.addf %18, %x : f32
        scf.yield %19 : f32
      }
      %is_less = arith.cmpf olt, %b, %x : f32
      scf.if %is_less {
        %0 = arith.mulf %b, %x : f32
        %1 = arith.addf %0, %x : f32
        %2 = arith.mulf %1, %x : f32
        %3 = arith.addf %2, %x : f32
        %4 = arith.mulf %3, %x : f32
        %5 = arith.addf %4, %x : f32
        %6 = arith.mulf %5, %x : f32
        %7 = arith.addf %6, %x : f32
        %8 = arith.mulf %7, %x : f32
        %9 = arith.addf %8, %x : f32
        piko.store %9, @out[%v : i32] "x" : f32
      }
      piko.return
    }
  }

  // A loop behind a condition is entered for a lane that would enter it, and has
  // a primitive.
  // CHECK:       piko.kernel @kernel_enters
  // CHECK:         scf.for %[[G:.*]] = %c0 to %[[COUNT:.*]] step %c16
  // CHECK-DAG:       %[[LANES:.*]] = vector.step
  // CHECK-DAG:       %[[LEFT:.*]] = arith.subi %[[COUNT]], %[[G]]
  // CHECK-DAG:       %[[ALL:.*]] = vector.broadcast %[[LEFT]]
  // CHECK:           arith.cmpi slt, %[[LANES]], %[[ALL]]
  // CHECK:           %[[ANY:.*]] = vector.reduction <or>
  // CHECK:           scf.if %[[ANY]] -> (vector<16xf32>)
  // CHECK:             scf.while
  piko.stage @enters bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %w = piko.get %f "w" : !piko.prim<@F> -> i32
      %c0 = arith.constant 0 : i32
      %c1 = arith.constant 1 : i32
      %n = arith.constant 9 : i32
      %x = arith.sitofp %w : i32 to f32
      %is_positive = arith.cmpi sgt, %w, %c0 : i32
      scf.if %is_positive {
        %sum:2 = scf.while (%s = %x, %k = %c0) : (f32, i32) -> (f32, i32) {
          %more = arith.cmpi slt, %k, %n : i32
          scf.condition(%more) %s, %k : f32, i32
        } do {
        ^bb0(%s: f32, %k: i32):
          %0 = arith.mulf %s, %x : f32
          %1 = arith.addf %0, %x : f32
          %2 = arith.mulf %1, %x : f32
          %3 = arith.addf %2, %x : f32
          %4 = arith.mulf %3, %x : f32
          %5 = arith.addi %k, %c1 : i32
          scf.yield %4, %5 : f32, i32
        }
        piko.store %sum#0, @out[%v : i32] "x" : f32
      }
      piko.return
    }
  }

  // Too little to compute.
  // CHECK:       piko.kernel @kernel_little
  // CHECK-NOT:     vector
  piko.stage @little bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %x = piko.load @vertices[%v : i32] "x" : f32
      %0 = arith.addf %x, %x : f32
      piko.store %0, @out[%v : i32] "x" : f32
      piko.return
    }
  }

  // What is read may have been written for the primitive before.
  // CHECK:       piko.kernel @kernel_written
  // CHECK-NOT:     vector
  piko.stage @written bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %v = piko.get %f "v" : !piko.prim<@F> -> i32
      %c0 = arith.constant 0 : i32
      %c1 = arith.constant 1 : i32
      %n = arith.constant 9 : i32
      %x = piko.load @out[%v : i32] "x" : f32
      %sum:2 = scf.while (%s = %x, %k = %c0) : (f32, i32) -> (f32, i32) {
        %more = arith.cmpi slt, %k, %n : i32
        scf.condition(%more) %s, %k : f32, i32
      } do {
      ^bb0(%s: f32, %k: i32):
        %0 = arith.mulf %s, %s : f32
        %1 = arith.addf %0, %s : f32
        %2 = arith.mulf %1, %s : f32
        %3 = arith.addf %2, %s : f32
        %4 = arith.mulf %3, %s : f32
        %5 = arith.addi %k, %c1 : i32
        scf.yield %4, %5 : f32, i32
      }
      piko.store %sum#0, @out[%v : i32] "x" : f32
      piko.return
    }
  }
}
