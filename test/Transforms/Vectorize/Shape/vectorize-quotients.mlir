// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' --split-input-file %s | FileCheck %s

piko.record @V {"z" : f32 at 0} size 4 align 4

// Only where a quotient by what all iterations share is not negative something is
// done. Where the dividend has the other sign than the divisor, and the quotient
// cannot be so small that it becomes 0, lanes are known to do nothing: vectors of
// such lanes divide nothing.
// CHECK-LABEL: piko.pipeline @Inside
// CHECK:         %[[AREA:.*]] = piko.load @area "z" : f32
// CHECK-DAG:     %[[SIGN:.*]] = math.copysign %{{.*}}, %[[AREA]] : f32
// CHECK-DAG:     %[[ABS:.*]] = math.absf %[[AREA]] : f32
// CHECK:         %[[LEAST:.*]] = arith.mulf %[[ABS]], %{{.*}} : f32
// CHECK:         %[[EDGE:.*]] = arith.subf %{{.*}}, %{{.*}} : vector<16xf32>
// CHECK:         %[[SIGNED:.*]] = arith.mulf %[[EDGE]], %{{.*}} : vector<16xf32>
// CHECK:         arith.cmpf olt, %[[SIGNED]], %{{.*}} : vector<16xf32>
// CHECK:         scf.if
// CHECK:           %[[U:.*]] = arith.divf %[[EDGE]], %{{.*}} : vector<16xf32>
// CHECK:           arith.cmpf {{olt|uge}}, %[[U]], %{{.*}} : vector<16xf32>
// CHECK:           scf.if
// CHECK:             piko.cpu.scatter
piko.pipeline @Inside rank 1 {
  piko.constant @area : @V
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %one = arith.constant 1.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %area = piko.load @area "z" : f32
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %edge = arith.subf %v, %one : f32
        %q = arith.divf %edge, %area : f32
        %r = arith.subf %one, %q : f32
        %isOut = arith.cmpf olt, %q, %zero : f32
        %isBehind = arith.cmpf olt, %r, %zero : f32
        %skips = arith.ori %isOut, %isBehind : i1
        scf.if %skips {
        } else {
          %w = arith.mulf %q, %r : f32
          piko.store %w, checked @out[%x : index] "z" : f32
        }
      } {piko.lanes}
    }
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// -----

piko.record @V {"z" : f32 at 0} size 4 align 4

// A divisor that differs from lane to lane, and a bound other than 0, are divided.
// CHECK-LABEL: piko.pipeline @Other
// CHECK-NOT:     math.copysign
piko.pipeline @Other rank 1 {
  piko.constant @area : @V
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %one = arith.constant 1.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %area = piko.load @area "z" : f32
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %q = arith.divf %one, %v : f32
        %r = arith.divf %v, %area : f32
        %isOut = arith.cmpf olt, %q, %zero : f32
        %isBehind = arith.cmpf olt, %r, %one : f32
        %skips = arith.ori %isOut, %isBehind : i1
        scf.if %skips {
        } else {
          %w = arith.mulf %q, %r : f32
          piko.store %w, checked @out[%x : index] "z" : f32
        }
      } {piko.lanes}
    }
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// -----

piko.record @V {"z" : f32 at 0} size 4 align 4
piko.record @W {"u" : f32 at 0, "v" : f32 at 4} size 8 align 4

// What is left of 1 after two such quotients is negative where the dividends' sum
// is more than the divisor, by more than what is rounded; a divisor that is tiny is
// not known to be exceeded.
// CHECK-LABEL: piko.pipeline @Barycentric
// CHECK-DAG:     %[[INFINITY:.*]] = arith.constant 0x7F800000 : f32
// CHECK:         %[[ABS:.*]] = math.absf %{{.*}} : f32
// CHECK:         arith.mulf %[[ABS]], %{{.*}} : f32
// CHECK-NEXT:    %[[MORE:.*]] = arith.mulf %[[ABS]], %{{.*}} : f32
// CHECK:         %[[IS_TINY:.*]] = arith.cmpf olt, %[[MORE]], %{{.*}} : f32
// CHECK:         %[[LEAST:.*]] = arith.select %[[IS_TINY]], %[[INFINITY]], %[[MORE]] : f32
// CHECK:         %[[SUM:.*]] = arith.addf %{{.*}}, %{{.*}} : vector<16xf32>
// CHECK-NEXT:    %[[LEASTS:.*]] = vector.broadcast %[[LEAST]]
// CHECK-NEXT:    arith.cmpf ogt, %[[SUM]], %[[LEASTS]] : vector<16xf32>
// CHECK:         scf.if
// CHECK-COUNT-2:   arith.divf
piko.pipeline @Barycentric rank 1 {
  piko.constant @area : @V
  piko.buffer @in : @W
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %one = arith.constant 1.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%unit) in (%n) {
      %area = piko.load @area "z" : f32
      scf.for %x = %c0 to %n step %c1 {
        %a = piko.load checked @in[%x : index] "u" : f32
        %b = piko.load checked @in[%x : index] "v" : f32
        %c = arith.subf %a, %b : f32
        %u = arith.divf %a, %area : f32
        %v = arith.divf %c, %area : f32
        %rest = arith.subf %one, %u : f32
        %w = arith.subf %rest, %v : f32
        %uIsIn = arith.cmpf oge, %u, %zero : f32
        %vIsIn = arith.cmpf oge, %v, %zero : f32
        %wIsIn = arith.cmpf oge, %w, %zero : f32
        %areIn = arith.andi %uIsIn, %vIsIn : i1
        %isInside = arith.andi %areIn, %wIsIn : i1
        scf.if %isInside {
          piko.store %w, checked @out[%x : index] "z" : f32
        }
      } {piko.lanes}
    }
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
