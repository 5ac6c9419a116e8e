// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu %s | FileCheck %s
// A cast from float to integer that saturates is one comparison where the number
// fits; what is no such cast stays as it is.

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.record @I {"i" : i32 at 0} size 4 align 4

// CHECK-LABEL: func.func private @P.kernel_saturates
// CHECK:         %[[SIZE:.*]] = math.absf %[[X:.*]] : f32
// CHECK:         %[[FITS:.*]] = arith.cmpf olt, %[[SIZE]], %{{.*}}
// CHECK:         %[[EXPECTED:.*]] = llvm.intr.expect %[[FITS]], %true
// CHECK:         scf.if %[[EXPECTED]] -> (i32) {
// CHECK-NEXT:      arith.fptosi %[[X]]
// CHECK:         } else {
// CHECK:           %[[HIGH:.*]] = arith.cmpf ogt, %[[X]]
// CHECK:           %[[NAN:.*]] = arith.cmpf uno, %[[X]], %[[X]]
// CHECK:           %[[END:.*]] = arith.select %[[HIGH]], %c2147483647_i32, %c-2147483648_i32
// CHECK:           arith.select %[[NAN]], %c0_i32, %[[END]]

// CHECK-LABEL: func.func private @P.kernel_differs
// CHECK-NOT:     llvm.intr.expect
// CHECK-LABEL: func.func @P.setup
piko.pipeline @P rank 1 {
  piko.buffer @out : @I
  piko.source @saturates
  piko.source @differs
  piko.stage @saturates bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance lanes one
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %first = arith.constant 0 : index
      %least = arith.constant -2147483648 : i32
      %most = arith.constant 2147483647 : i32
      %below = arith.constant -2147483648.0 : f32
      %above = arith.constant 2147483648.0 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %cast = arith.fptosi %x : f32 to i32
      %high = arith.cmpf oge, %x, %above : f32
      %low = arith.cmpf olt, %x, %below : f32
      %nan = arith.cmpf uno, %x, %x : f32
      %a = arith.select %high, %most, %cast : i32
      %b = arith.select %low, %least, %a : i32
      %c = arith.select %nan, %zero, %b : i32
      piko.store %c, @out[%first : index] "i" : i32
      piko.return
    }
  }
  // NaN is 1.
  piko.stage @differs bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance lanes one
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : i32
      %first = arith.constant 0 : index
      %least = arith.constant -2147483648 : i32
      %most = arith.constant 2147483647 : i32
      %below = arith.constant -2147483648.0 : f32
      %above = arith.constant 2147483648.0 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %cast = arith.fptosi %x : f32 to i32
      %high = arith.cmpf oge, %x, %above : f32
      %low = arith.cmpf olt, %x, %below : f32
      %nan = arith.cmpf uno, %x, %x : f32
      %a = arith.select %high, %most, %cast : i32
      %b = arith.select %low, %least, %a : i32
      %c = arith.select %nan, %one, %b : i32
      piko.store %c, @out[%first : index] "i" : i32
      piko.return
    }
  }
}
