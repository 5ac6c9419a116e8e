// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-peel-vectors))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-peel-vectors{most-lanes=4}))' %s | FileCheck %s --check-prefix=CHEAP
// RUN: sed 's/{piko.last_lanes}/{piko.last_lanes = 8}/' %s | not piko-opt 2>&1 | FileCheck %s --check-prefix=MARK

piko.record @F {"x" : f32 at 0} size 4 align 4

// Full vectors, whose mask is constant; then the rest, if there is any.
// CHECK-LABEL: piko.kernel @row
// CHECK:         %[[N:.*]] = piko.extent @in[0]
// CHECK:         %[[ANY:.*]] = arith.cmpi slt, %[[LO:.*]], %[[N]] : index
// CHECK:         %[[DIFFERENCE:.*]] = arith.subi %[[N]], %[[LO]] : index
// CHECK:         %[[COUNT:.*]] = arith.select %[[ANY]], %[[DIFFERENCE]], %c0
// CHECK:         %[[FULL:.*]] = arith.andi %[[COUNT]], %c-8
// CHECK:         %[[END:.*]] = arith.addi %[[LO]], %[[FULL]]
// CHECK:         scf.for %[[I:.*]] = %[[LO]] to %[[END]] step %c8
// CHECK:           %[[ALL:.*]] = arith.constant dense<true> : vector<8xi1>
// CHECK:           piko.cpu.gather consecutive @in[%[[I]] : index] "x" mask %[[ALL]]
// CHECK:         %[[MORE:.*]] = arith.cmpi slt, %[[END]], %[[N]] : index
// CHECK:         scf.if %[[MORE]] {
// CHECK:           %[[LEFT:.*]] = arith.subi %[[N]], %[[END]]
// CHECK:           %[[MASK:.*]] = arith.cmpi slt, %{{.*}} : vector<8xi32>
// CHECK:           piko.cpu.gather consecutive @in[%[[END]] : index] "x" mask %[[MASK]]
// CHECK-NOT:     scf.for

// Where masks are cheap, and where there is no row, loops stay.
// CHEAP:         piko.kernel @row
// CHEAP:           scf.for
// CHEAP-NOT:       scf.if
// CHECK-LABEL: piko.kernel @apart
// CHECK-COUNT-1: scf.for
// CHECK-NOT:     scf.if

// MARK: error: 'arith.cmpi' op expected 'piko.last_lanes' to be a unit
piko.pipeline @P rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @row {
    %c0 = arith.constant 0 : index
    %c8 = arith.constant 8 : index
    %steps = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7]> : vector<8xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.extent @in[0]
    scf.for %i = %c0 to %n step %c8 {
      %left = arith.subi %n, %i : index
      %most = arith.minui %left, %c8 : index
      %word = arith.index_cast %most : index to i32
      %all = vector.broadcast %word : i32 to vector<8xi32>
      %mask = arith.cmpi slt, %steps, %all {piko.last_lanes} : vector<8xi32>
      %x = piko.cpu.gather consecutive @in[%i : index] "x" mask %mask : vector<8xi1>, vector<8xf32>
      piko.cpu.scatter %x, consecutive @out[%i : index] "x" mask %mask : vector<8xi1>, vector<8xf32>
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @apart {
    %c0 = arith.constant 0 : index
    %c8 = arith.constant 8 : index
    %steps = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7]> : vector<8xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.extent @in[0]
    scf.for %i = %c0 to %n step %c8 {
      %left = arith.subi %n, %i : index
      %most = arith.minui %left, %c8 : index
      %word = arith.index_cast %most : index to i32
      %all = vector.broadcast %word : i32 to vector<8xi32>
      %at = vector.broadcast %i : index to vector<8xindex>
      %mask = arith.cmpi slt, %steps, %all {piko.last_lanes} : vector<8xi32>
      %x = piko.cpu.gather @in[%at : vector<8xindex>] "x" mask %mask : vector<8xi1>, vector<8xf32>
      piko.cpu.scatter %x, @out[%at : vector<8xindex>] "x" mask %mask : vector<8xi1>, vector<8xf32>
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
