// RUN: piko-opt --piko-form-program --piko-unswitch-versions --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// The versions of a loop over primitives are functions, where the scalar one is one
// of two. What one takes from before the choice it gets as arguments, but for
// constants and arrays of its own.
// CHECK:       func.func private @P.k.version0(%[[INNER:[a-z0-9]+]]: i1, %{{[a-z0-9]+}}: !llvm.ptr, %{{[a-z0-9]+}}: index) attributes {passthrough = ["noinline"]} {
// CHECK-NOT:     memref.alloca
// CHECK:         scf.for
// CHECK:           %[[EITHER:.*]] = arith.select %[[INNER]], %c2_i32, %c3_i32
// CHECK:           llvm.store %[[EITHER]]
// CHECK:       func.func private @P.k.version1(%{{[a-z0-9]+}}: !llvm.ptr, %{{[a-z0-9]+}}: index) attributes {passthrough = ["noinline"]} {
// CHECK-NOT:     arith.select
// CHECK:         scf.for
// CHECK:           llvm.store %c3_i32
// CHECK:       func.func private @P.k.version2(%{{[a-z0-9]+}}: !llvm.ptr, %{{[a-z0-9]+}}: index) attributes {passthrough = ["noinline"]} {
// CHECK:         %[[ARRAY:.*]] = memref.alloca() : memref<4xi32>
// CHECK:         scf.for
// CHECK:           %[[READ:.*]] = memref.load %[[ARRAY]]
// CHECK:           llvm.store %[[READ]]
// CHECK-LABEL: func.func private @P.k(
// CHECK-NOT:     memref.alloca
// CHECK:         scf.if %{{.*}} {
// CHECK-NEXT:      func.call @P.k.version2(
// CHECK-NEXT:    } else {
// CHECK-NEXT:      scf.if %{{.*}} {
// CHECK-NEXT:        func.call @P.k.version0(
// CHECK-NEXT:      } else {
// CHECK-NEXT:        func.call @P.k.version1(

// Two bodies share the kernel's function.
// CHECK-LABEL: func.func private @Q.two(
// CHECK-NOT:     func.call
// CHECK:         scf.if %{{.*}} {
// CHECK:           llvm.store
// CHECK:         } else {
// CHECK:           llvm.store
// CHECK:       }{{$}}
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c4 = arith.constant 4 : index
    %i1 = arith.constant 1 : i32
    %i2 = arith.constant 2 : i32
    %i3 = arith.constant 3 : i32
    %array = memref.alloca() : memref<4xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %count = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %outer = piko.cpu.takes_vectors %w {expected, loop = "outside", number = 0, scalar = 10, vectors = 20}
    %inner = piko.cpu.takes_vectors %w {loop = "inside", number = 1, scalar = 30, vectors = 40, within = 0}
    scf.if %outer {
      memref.store %i1, %array[%c0] : memref<4xi32>
      scf.for %i = %c0 to %count step %c1 {
        %at = arith.remui %i, %c4 : index
        %x = memref.load %array[%at] : memref<4xi32>
        piko.store %x, @out[%i : index] "x" : i32
      }
    } else {
      scf.for %i = %c0 to %count step %c1 {
        %x = scf.if %inner -> i32 {
          scf.yield %i2 : i32
        } else {
          scf.yield %i3 : i32
        }
        piko.store %x, @out[%i : index] "x" : i32
      }
    } {piko.versions}
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

piko.pipeline @Q rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @two {
    %c0 = arith.constant 0 : index
    %i1 = arith.constant 1 : i32
    %i2 = arith.constant 2 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %outer = piko.cpu.takes_vectors %w {expected, loop = "outside", number = 0, scalar = 10, vectors = 20}
    scf.if %outer {
      piko.store %i1, @out[%c0 : index] "x" : i32
    } else {
      piko.store %i2, @out[%c0 : index] "x" : i32
    } {piko.versions}
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
