// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-merge-gathers))' %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8, "d" : f64 at 16, "n" : i32 at 24} size 32 align 8

// Words of the same elements are written at once, where the last one is.
// CHECK-LABEL: piko.kernel @merged
// CHECK-NOT:     piko.cpu.scatter
// CHECK:         %[[SUM:.*]] = arith.addf
// CHECK-NEXT:    %[[AS:.*]] = piko.cpu.elements @out[%[[IS:.*]] : vector<16xindex>] : vector<16xindex>
// CHECK-NEXT:    piko.cpu.set_fields(%[[X:.*]], %[[SUM]], %[[X]]) to %[[AS]] ["x", "z", "y"] of @out mask %[[M:.*]] : vector<16xindex>, vector<16xi1>, vector<16xf32>, vector<16xf32>, vector<16xf32>
// CHECK-NEXT:    %[[RS:.*]] = piko.cpu.elements consecutive @out[%c0 : index] : vector<16xindex>
// CHECK-NEXT:    piko.cpu.set_fields(%[[X]], %[[X]], %[[X]]) to %[[RS]] ["x", "y", "z"] of @out
piko.pipeline @P rank 1 {
  piko.buffer @mesh : @V
  piko.buffer @out : @V
  piko.kernel @merged {
    %c0 = arith.constant 0 : index
    %is = vector.step : vector<16xindex>
    %m = arith.constant dense<true> : vector<16xi1>
    %x = piko.cpu.gather @mesh[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, @out[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    %sum = arith.addf %x, %x : vector<16xf32>
    piko.cpu.scatter %sum, @out[%is : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, @out[%is : vector<16xindex>] "y" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, consecutive @out[%c0 : index] "x" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, consecutive @out[%c0 : index] "y" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, consecutive @out[%c0 : index] "z" mask %m : vector<16xi1>, vector<16xf32>
  }

  // Two fields alone, a field of 64 bits, one that is read in between, the same
  // one again, and those of other lanes are not.
  // CHECK-LABEL: piko.kernel @left
  // CHECK-NOT:     piko.cpu.set_fields
  piko.kernel @left {
    %is = vector.step : vector<16xindex>
    %js = arith.addi %is, %is : vector<16xindex>
    %m = arith.constant dense<true> : vector<16xi1>
    %few = arith.cmpi ult, %is, %js : vector<16xindex>
    %x = piko.cpu.gather @mesh[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    %d = piko.cpu.gather @mesh[%is : vector<16xindex>] "d" mask %m : vector<16xi1>, vector<16xf64>
    piko.cpu.scatter %x, @out[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, @out[%is : vector<16xindex>] "y" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %d, @out[%is : vector<16xindex>] "d" mask %m : vector<16xi1>, vector<16xf64>
    piko.cpu.scatter %x, @out[%is : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
    %y = piko.cpu.gather @out[%js : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %y, @out[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %y, @out[%is : vector<16xindex>] "y" mask %few : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %y, @out[%is : vector<16xindex>] "z" mask %few : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %y, @out[%is : vector<16xindex>] "z" mask %few : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, @out[%js : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
  }
}
