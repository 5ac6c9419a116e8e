// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Calls, emissions, accesses and iterations are told, and what is unwritten is
// followed to where it shows.
// RUN: piko-opt %s --piko-add-checks=numbers=F.z,F.w | FileCheck %s

// CHECK: piko.record @F {"z" : f32 at 0, "w" : f32[2 : 4] at 4} size 12 align 4
// CHECK: piko.record @F.checked {"z" : f32 at 0, "w" : f32[2 : 4] at 4, "piko.lineage" : i64 at 16} size 24 align 8
piko.record @F {"z" : f32 at 0, "w" : f32[2 : 4] at 4} size 12 align 4
piko.record @float {"value" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
// CHECK: piko.check_record @F.checked of @F numbers ["z", "w"]
piko.pipeline @P rank 1 {
  piko.buffer @data : @float
  piko.image @depth : @float rank 1
  piko.source @start
  piko.edge @start[0] -> @end

  // CHECK: piko.stage @start {{.*}} : @F.checked -> [@F.checked]
  piko.stage @start bins [0] threads 64 : @F -> [@F] {
    // CHECK: piko.process
    // CHECK-NEXT: ^bb0(%[[PRIM:.*]]: !piko.prim<@F.checked>):
    // CHECK-NEXT: %[[BIN:.*]] = piko.bin
    // CHECK-NEXT: %[[OF:.*]] = piko.get %[[PRIM]] "piko.lineage" : !piko.prim<@F.checked> -> i64
    // CHECK-NEXT: piko.check_call @start in %[[BIN]] of %[[OF]]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // Two numbers of one element are one access.
      // CHECK: piko.check_access read @data[%[[ZERO:.*]] : index]
      // CHECK-NEXT: piko.load @data
      // CHECK-NEXT: piko.load @data
      %a = piko.load @data[%zero : index] "value" : f32
      %b = piko.load @data[%zero : index] "value" : f32
      // CHECK: piko.check_access store @data
      // CHECK-NEXT: piko.store
      piko.store %a, @data[%zero : index] "value" : f32
      // CHECK: piko.check_access read updates @depth
      %old = piko.load @depth[%zero : index] "value" : f32
      // CHECK: piko.check_access update updates @depth
      // CHECK-NEXT: piko.update
      piko.update @depth[%zero : index] {
      ^bb0(%pixel: f32):
        piko.yield [%z : f32]
      }
      // CHECK: arith.cmpf uno, %[[Z:.*]], %[[Z]] : f32
      // CHECK: piko.check_value nan %{{.*}} "z" of @F
      // CHECK: arith.ori
      // CHECK: piko.check_value nan %{{.*}} "w" of @F
      // CHECK: piko.check_place
      // CHECK-NEXT: %[[ID:.*]] = piko.check_emit
      // CHECK-NEXT: piko.emit 0({{.*}}, %[[ID]]) : f32, f32, f32, i64
      piko.emit 0 (%z, %a, %b) : f32, f32, f32
      piko.return
    }
  }

  piko.stage @end bins [4] threads 64 : @F -> [] {
    // CHECK: piko.assign
    // CHECK: piko.check_assign @end of %
    // CHECK: piko.check_place
    // CHECK-NEXT: piko.assign_to
    // CHECK-NEXT: piko.check_assign @end{{$}}
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      piko.assign_to %zero
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %n = arith.constant 8 : index
      // The loop inside meets too: what follows a barrier says whose it is.
      // CHECK: piko.check_loop begin
      // CHECK-NEXT: piko.parallel_for
      // CHECK-NEXT: ^bb0(%[[I:.*]]: index):
      // CHECK-NEXT: piko.check_loop iteration %[[I]]
      // CHECK: scf.for
      // CHECK-NEXT: piko.check_loop iteration %[[I]]
      // CHECK-NEXT: piko.sync
      // CHECK-NEXT: piko.check_loop barrier %[[I]]
      // CHECK: piko.check_loop iteration %[[I]]
      // CHECK: piko.check_loop end
      piko.parallel_for %n {
      ^bb0(%i: index):
        %zero = arith.constant 0 : index
        %one = arith.constant 1 : index
        scf.for %k = %zero to %n step %one {
          piko.sync
        }
        piko.yield
      }
      piko.return
    }
  }
}

// CHECK-LABEL: piko.pipeline @Unwritten
// CHECK-NOT: piko.undefined
piko.pipeline @Unwritten rank 1 {
  piko.buffer @data : @float
  piko.source @start
  piko.stage @start bins [0] threads 64 : @float -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@float>):
      %zero = arith.constant 0 : index
      %v = piko.get %f "value" : !piko.prim<@float> -> f32
      %c = arith.cmpf olt, %v, %v : f32
      %u = piko.undefined : f32
      // CHECK: %[[CELL:.*]] = memref.alloca() : memref<1xi1>
      // CHECK: %[[T:.*]] = arith.constant true
      // CHECK: scf.if
      // CHECK: %[[F:.*]] = arith.constant false
      // CHECK: memref.store %[[F]], %[[CELL]]
      // CHECK: else
      // CHECK: memref.store %[[T]], %[[CELL]]
      // CHECK: %[[FLAG:.*]] = memref.load %[[CELL]]
      %r = scf.if %c -> f32 {
        %d = arith.addf %v, %v : f32
        scf.yield %d : f32
      } else {
        scf.yield %u : f32
      }
      // CHECK: arith.addf
      %s = arith.addf %r, %v : f32
      // CHECK: piko.check_value unwritten %[[FLAG]] "value" of @float
      // CHECK: piko.store
      piko.store %s, @data[%zero : index] "value" : f32
      // What is written needs no flag.
      // CHECK-NOT: piko.check_value
      // CHECK: piko.store
      piko.store %v, @data[%zero : index] "value" : f32
      piko.return
    }
  }
}

// An assign phase has nothing that shows such a number: it is 0.
// CHECK-LABEL: piko.pipeline @UnwrittenAssign
// CHECK:         piko.assign
// CHECK-NOT:       piko.undefined
// CHECK:           %[[ZERO:.*]] = arith.constant 0 : i32
// CHECK:           %[[BIN:.*]] = arith.index_cast %[[ZERO]]
// CHECK:           piko.assign_to %[[BIN]]
piko.pipeline @UnwrittenAssign rank 1 {
  piko.source @start
  piko.stage @start bins [8] threads 64 : @float -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@float>):
      %number = piko.undefined : i32
      %bin = arith.index_cast %number : i32 to index
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@float>):
      piko.return
    }
  }
}

// Indices of arrays are tested unless they are known to be inside, and what
// loops go round is counted.
// CHECK-LABEL: piko.pipeline @Bounds
piko.pipeline @Bounds rank 1 {
  piko.buffer @data : @F
  piko.source @start
  piko.stage @start bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %four = arith.constant 4 : index
      // CHECK: %[[I:.*]] = piko.extent @data[0]
      %i = piko.extent @data[0]
      // CHECK: memref.alloca
      %array = memref.alloca() : memref<4xf32>
      // CHECK: %[[IN:.*]] = piko.check_index %[[I]] of 2
      // CHECK: %[[W:.*]] = piko.get %{{.*}} "w"[%[[IN]]]
      %w = piko.get %f "w"[%i] : !piko.prim<@F> -> f32
      // CHECK-NOT: piko.check_index
      // CHECK: memref.store %[[W]], %{{.*}}[%{{.*}}]
      memref.store %w, %array[%one] : memref<4xf32>
      // CHECK: %[[OUT:.*]] = piko.check_index %{{.*}} of 4
      // CHECK-NEXT: memref.load %{{.*}}[%[[OUT]]]
      %v = memref.load %array[%four] : memref<4xf32>
      // CHECK: scf.while
      // CHECK: %[[GOES:.*]] = arith.cmpf
      // CHECK: %[[MAY:.*]] = piko.check_trip
      // CHECK-NEXT: %[[BOTH:.*]] = arith.andi %[[GOES]], %[[MAY]]
      // CHECK-NEXT: scf.condition(%[[BOTH]])
      %r = scf.while (%a = %v) : (f32) -> f32 {
        %goes = arith.cmpf olt, %a, %w : f32
        scf.condition(%goes) %a : f32
      } do {
      ^bb0(%a: f32):
        %b = arith.addf %a, %w : f32
        scf.yield %b : f32
      }
      // CHECK: %[[E:.*]] = piko.check_index %[[I]] of 2
      // CHECK: piko.store %{{.*}}, @data[%{{.*}} : index] "w"[%[[E]]]
      piko.store %r, @data[%zero : index] "w"[%i] : f32
      // A division may fail here.
      // CHECK: piko.check_place
      // CHECK-NEXT: piko.divide
      %c = arith.fptosi %r : f32 to i32
      %q = piko.divide quotient_signed %c, %c : i32
      %qf = arith.sitofp %q : i32 to f32
      piko.store %qf, @data[%zero : index] "z" : f32
      piko.return
    }
  }
}
