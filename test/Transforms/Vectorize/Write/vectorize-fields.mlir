// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' %s | FileCheck %s

piko.record @Id {"n" : i32 at 0} size 4 align 4
piko.record @Two {"m" : i32 at 0} size 4 align 4
piko.record @T {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8} size 12 align 4

// Three fields of an element that each lane names: gathers where lanes differ from
// the first active one, or else scalar loads. Two fields are gathers.
// CHECK-LABEL: piko.kernel @fields
// CHECK:         %[[IDS:.*]] = piko.cpu.gather consecutive @ids
// CHECK:         %[[PLACES:.*]] = arith.index_cast %{{.*}} : vector<16xi32> to vector<16xindex>
// CHECK:         %[[FIRST:.*]] = math.cttz %{{.*}} : i16
// CHECK:         %[[PLACE:.*]] = vector.extract %[[PLACES]][%{{.*}}] : index from vector<16xindex>
// CHECK:         %[[ALL:.*]] = vector.broadcast %[[PLACE]] : index to vector<16xindex>
// CHECK:         %[[DIFFER:.*]] = arith.cmpi ne, %[[PLACES]], %[[ALL]]
// CHECK:         %[[ACTIVE:.*]] = arith.select %{{.*}}, %[[DIFFER]], %{{.*}}
// CHECK:         %[[ANY:.*]] = vector.reduction <or>, %[[ACTIVE]]
// CHECK:         scf.if %[[ANY]] -> (vector<16xf32>, vector<16xf32>, vector<16xf32>) {
// CHECK-COUNT-3:   piko.cpu.gather @triangles[%[[PLACES]] : vector<16xindex>]
// CHECK:         } else {
// CHECK-COUNT-3:   piko.load checked @triangles[%[[PLACE]] : index]
// CHECK-COUNT-2: piko.cpu.gather @others[%[[PLACES]] : vector<16xindex>]

// An unsigned remainder by what all lanes share: the dividend and a half, as
// doubles, times a reciprocal.
// CHECK:         %[[A:.*]] = arith.uitofp %{{.*}} : vector<16xi32> to vector<16xf64>
// CHECK:         %[[B:.*]] = arith.uitofp %{{.*}} : i32 to f64
// CHECK:         %[[R:.*]] = arith.divf %{{.*}}, %[[B]] : f64
// CHECK:         %[[HALF:.*]] = arith.addf %[[A]], %{{.*}} : vector<16xf64>
// CHECK:         %[[RS:.*]] = vector.broadcast %[[R]] : f64 to vector<16xf64>
// CHECK:         %[[Q:.*]] = arith.mulf %[[HALF]], %[[RS]] : vector<16xf64>
// CHECK:         %[[WHOLE:.*]] = arith.fptoui %[[Q]] : vector<16xf64> to vector<16xi32>
// CHECK:         %[[PRODUCT:.*]] = arith.muli %[[WHOLE]], %{{.*}} : vector<16xi32>
// CHECK:         arith.subi %{{.*}}, %[[PRODUCT]] : vector<16xi32>
// CHECK-NOT:     arith.remui {{.*}}vector

// A signed one by what differs: the quotient is one of doubles.
// CHECK:         %[[SA:.*]] = arith.sitofp %{{.*}} : vector<16xi32> to vector<16xf64>
// CHECK:         %[[SB:.*]] = arith.sitofp %{{.*}} : vector<16xi32> to vector<16xf64>
// CHECK:         %[[SQ:.*]] = arith.divf %[[SA]], %[[SB]] : vector<16xf64>
// CHECK:         arith.fptosi %[[SQ]] : vector<16xf64> to vector<16xi32>
piko.pipeline @P rank 1 {
  piko.buffer @ids : @Id
  piko.buffer @two : @Two
  piko.buffer @triangles : @T
  piko.buffer @others : @T
  piko.buffer @out : @T
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Id -> [] {}
  piko.kernel @fields {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@Id>
    %n = piko.storage.unit_count %bins : !piko.bins<@Id>
    %size = piko.load checked @ids[%c0 : index] "n" : i32
    scf.forall (%u) in (%n) {
      scf.for %i = %c0 to %n step %c1 {
        %id = piko.load checked @ids[%i : index] "n" : i32
        %x = piko.load checked @triangles[%id : i32] "x" : f32
        %y = piko.load checked @triangles[%id : i32] "y" : f32
        %z = piko.load checked @triangles[%id : i32] "z" : f32
        %v = piko.load checked @others[%id : i32] "x" : f32
        %w = piko.load checked @others[%id : i32] "y" : f32
        %slot = arith.remui %id, %size : i32
        %other = piko.load checked @two[%i : index] "m" : i32
        %rest = arith.remsi %slot, %other : i32
        %f = arith.uitofp %rest : i32 to f32
        %0 = arith.mulf %x, %y : f32
        %1 = arith.addf %0, %z : f32
        %2 = arith.divf %1, %v : f32
        %3 = arith.divf %2, %w : f32
        %4 = math.sqrt %3 : f32
        %5 = arith.mulf %4, %f : f32
        piko.store %5, checked @out[%i : index] "x" : f32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@Id>
  }
}
