// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-merge-gathers))' %s | FileCheck %s

piko.record @V {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8, "d" : f64 at 16, "n" : i32 at 24} size 32 align 8

// Words of the same elements are read at once, also of elements one after the
// other, and two alone if they are side by side; a field of 64 bits, and one for
// other lanes, are not. Of state that the kernel changes, so are words that nothing
// in between has written.
// CHECK-LABEL: piko.kernel @state
// CHECK:         %[[AS:.*]] = piko.cpu.elements @mesh[%[[IS:.*]] : vector<16xindex>] : vector<16xindex>
// CHECK-NEXT:    %[[X:.*]]:3 = piko.cpu.get_fields %[[AS]] ["x", "z", "n"] of @V mask %[[M:.*]] : vector<16xindex>, vector<16xi1> -> vector<16xf32>, vector<16xf32>, vector<16xi32>
// CHECK-NEXT:    piko.cpu.gather @mesh[%[[IS]] : vector<16xindex>] "d"
// CHECK-NEXT:    piko.cpu.gather @mesh[%[[IS]] : vector<16xindex>] "y" mask %{{.*}}
// CHECK:         piko.cpu.get_fields %{{.*}} ["x", "y"] of @V
// CHECK-COUNT-2: piko.cpu.gather @mesh[%{{.*}} : vector<16xindex>]
// CHECK:         %[[RS:.*]] = piko.cpu.elements consecutive @mesh[%c0 : index] : vector<16xindex>
// CHECK-NEXT:    piko.cpu.get_fields %[[RS]] ["x", "y", "z"] of @V
// CHECK:         piko.cpu.get_fields %{{.*}} ["x", "y", "n"] of @V
// CHECK-NEXT:    piko.cpu.scatter %{{.*}}, @out[%[[IS]] : vector<16xindex>] "z"
// CHECK-NEXT:    piko.cpu.gather @out[%[[IS]] : vector<16xindex>] "z"
piko.pipeline @P rank 1 {
  piko.buffer @mesh : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @state {
    %c0 = arith.constant 0 : index
    %is = vector.step : vector<16xindex>
    %js = arith.addi %is, %is : vector<16xindex>
    %ks = arith.addi %js, %is : vector<16xindex>
    %m = arith.constant dense<true> : vector<16xi1>
    %few = arith.cmpi ult, %is, %js : vector<16xindex>
    %x = piko.cpu.gather @mesh[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    %d = piko.cpu.gather @mesh[%is : vector<16xindex>] "d" mask %m : vector<16xi1>, vector<16xf64>
    %y = piko.cpu.gather @mesh[%is : vector<16xindex>] "y" mask %few : vector<16xi1>, vector<16xf32>
    %z = piko.cpu.gather @mesh[%is : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
    %n = piko.cpu.gather @mesh[%is : vector<16xindex>] "n" mask %m : vector<16xi1>, vector<16xi32>
    %x1 = piko.cpu.gather @mesh[%js : vector<16xindex>] "x" mask %few : vector<16xi1>, vector<16xf32>
    %y1 = piko.cpu.gather @mesh[%js : vector<16xindex>] "y" mask %few : vector<16xi1>, vector<16xf32>
    %x4 = piko.cpu.gather @mesh[%ks : vector<16xindex>] "x" mask %few : vector<16xi1>, vector<16xf32>
    %z4 = piko.cpu.gather @mesh[%ks : vector<16xindex>] "z" mask %few : vector<16xi1>, vector<16xf32>
    %x2 = piko.cpu.gather consecutive @mesh[%c0 : index] "x" mask %m : vector<16xi1>, vector<16xf32>
    %y2 = piko.cpu.gather consecutive @mesh[%c0 : index] "y" mask %m : vector<16xi1>, vector<16xf32>
    %z2 = piko.cpu.gather consecutive @mesh[%c0 : index] "z" mask %m : vector<16xi1>, vector<16xf32>
    %x3 = piko.cpu.gather @out[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    %y3 = piko.cpu.gather @out[%is : vector<16xindex>] "y" mask %m : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, @out[%is : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
    %z3 = piko.cpu.gather @out[%is : vector<16xindex>] "z" mask %m : vector<16xi1>, vector<16xf32>
    %n3 = piko.cpu.gather @out[%is : vector<16xindex>] "n" mask %m : vector<16xi1>, vector<16xi32>
  }

  // A field that fewer lanes read, under a condition, is read along; one that
  // other lanes read is not.
  // CHECK-LABEL: piko.kernel @primitives
  // CHECK:         %[[P:.*]] = piko.cpu.items
  // CHECK-NEXT:    piko.cpu.get_fields %[[P]] ["x", "y", "z"] of @V
  // CHECK-NOT:     piko.cpu.get_fields
  // CHECK-COUNT-2: scf.if
  // CHECK-NEXT:      piko.cpu.get %[[P]] "n"
  piko.kernel @primitives {
    %c0 = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %is = vector.step : vector<16xindex>
    %m = arith.constant dense<true> : vector<16xi1>
    %none = arith.constant dense<false> : vector<16xi1>
    %p = piko.cpu.items %bins[%c0 : index] mask %m : !piko.bins<@V>, vector<16xi1>, vector<16xindex>
    %x = piko.cpu.get %p "x" of @V mask %m : vector<16xindex>, vector<16xi1>, vector<16xf32>
    %y = piko.cpu.get %p "y" of @V mask %m : vector<16xindex>, vector<16xi1>, vector<16xf32>
    %some = arith.cmpf ogt, %x, %y : vector<16xf32>
    %few = arith.select %m, %some, %none : vector<16xi1>, vector<16xi1>
    %any = vector.reduction <or>, %few : vector<16xi1> into i1
    scf.if %any {
      %z = piko.cpu.get %p "z" of @V mask %few : vector<16xindex>, vector<16xi1>, vector<16xf32>
      piko.cpu.scatter %z, @out[%is : vector<16xindex>] "z" mask %few : vector<16xi1>, vector<16xf32>
    }
    scf.if %any {
      %n = piko.cpu.get %p "n" of @V mask %some : vector<16xindex>, vector<16xi1>, vector<16xi32>
      piko.cpu.scatter %n, @out[%is : vector<16xindex>] "n" mask %some : vector<16xi1>, vector<16xi32>
    }
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
  // Of primitives at consecutive positions one field alone is read so as well,
  // because it may become a row.
  // CHECK-LABEL: piko.kernel @alone
  // CHECK:         %[[P:.*]] = piko.cpu.items
  // CHECK-NEXT:    piko.cpu.get_fields %[[P]] ["n"] of @V
  // CHECK-NOT:     piko.cpu.get %
  piko.kernel @alone {
    %c0 = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %is = vector.step : vector<16xindex>
    %m = arith.constant dense<true> : vector<16xi1>
    %p = piko.cpu.items %bins[%c0 : index] mask %m : !piko.bins<@V>, vector<16xi1>, vector<16xindex>
    %n = piko.cpu.get %p "n" of @V mask %m : vector<16xindex>, vector<16xi1>, vector<16xi32>
    piko.cpu.scatter %n, @out[%is : vector<16xindex>] "n" mask %m : vector<16xi1>, vector<16xi32>
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
  // So is a field of an element under a condition, whose record is as short as a line.
  // CHECK-LABEL: piko.kernel @conditions
  // CHECK:         piko.cpu.get_fields %{{.*}} ["x", "y", "z"] of @V
  // CHECK-NOT:     piko.cpu.gather
  piko.kernel @conditions {
    %is = vector.step : vector<16xindex>
    %m = arith.constant dense<true> : vector<16xi1>
    %none = arith.constant dense<false> : vector<16xi1>
    %x = piko.cpu.gather @mesh[%is : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xf32>
    %some = arith.cmpf ogt, %x, %x : vector<16xf32>
    %few = arith.select %m, %some, %none : vector<16xi1>, vector<16xi1>
    %any = vector.reduction <or>, %few : vector<16xi1> into i1
    scf.if %any {
      %y = piko.cpu.gather @mesh[%is : vector<16xindex>] "y" mask %few : vector<16xi1>, vector<16xf32>
      %z = piko.cpu.gather @mesh[%is : vector<16xindex>] "z" mask %few : vector<16xi1>, vector<16xf32>
      %sum = arith.addf %y, %z : vector<16xf32>
      piko.cpu.scatter %sum, @out[%is : vector<16xindex>] "z" mask %few : vector<16xi1>, vector<16xf32>
    }
  }
}
