// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(convert-piko-to-scf))' %s | FileCheck %s
// Conditions that were short-circuited are chosen again; lanes keep them joined.

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  // CHECK: piko.kernel @k
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %ten = arith.constant 10 : index
    %array = memref.alloca() : memref<4xi1>
    %lanes = memref.alloca() : memref<4xvector<4xi1>>
    // CHECK: %[[A:.*]] = arith.cmpi sgt
    // CHECK: %[[B:.*]] = arith.cmpi slt
    %a = arith.cmpi sgt, %n, %zero : index
    %b = arith.cmpi slt, %n, %ten : index
    // CHECK: %[[AND:.*]] = arith.select %[[A]], %[[B]], %false : i1
    // CHECK: memref.store %[[AND]]
    %and = arith.andi %a, %b {piko.short_circuit} : i1
    memref.store %and, %array[%n] : memref<4xi1>
    // CHECK: %[[OR:.*]] = arith.select %[[A]], %true, %[[B]] : i1
    // CHECK: memref.store %[[OR]]
    %or = arith.ori %a, %b {piko.short_circuit} : i1
    memref.store %or, %array[%n] : memref<4xi1>
    // CHECK: arith.andi %[[A]], %[[B]] : i1
    %both = arith.andi %a, %b : i1
    memref.store %both, %array[%n] : memref<4xi1>
    %va = vector.broadcast %a : i1 to vector<4xi1>
    %vb = vector.broadcast %b : i1 to vector<4xi1>
    // CHECK: arith.andi %{{.*}}, %{{.*}} {piko.short_circuit} : vector<4xi1>
    %vand = arith.andi %va, %vb {piko.short_circuit} : vector<4xi1>
    memref.store %vand, %lanes[%n] : memref<4xvector<4xi1>>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
