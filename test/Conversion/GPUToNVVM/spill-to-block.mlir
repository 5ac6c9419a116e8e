// RUN: piko-opt %s --pass-pipeline='builtin.module(gpu.module(piko-spill-to-block{max-registers=4}))' --split-input-file | FileCheck %s

// What only covered pixels need, and what only rows step by, waits in shared memory; what each pixel needs, and constants, do not. A cast is made again from
// what was spilled.
// CHECK-LABEL: gpu.func @rows
// CHECK-SAME:    %[[EDGES:[a-z0-9]+]] : memref<64xi64, {{[^)]*}}%[[AREAS:[a-z0-9]+]] : memref<64xf32, {{[^)]*}}%[[STEPS:[a-z0-9]+]] : memref<64xi64, {{[^)]*}}%[[NUMBERS:[a-z0-9]+]] : memref<64xi32,
// CHECK:         %[[AREA:.*]] = llvm.load
// CHECK:         memref.store %[[AREA]], %[[AREAS]][%{{.*}}]
// CHECK:         memref.store %{{.*}}, %[[STEPS]]
// CHECK:         memref.store %{{.*}}, %[[NUMBERS]]
// CHECK-NOT:     arith.index_cast
// CHECK:         scf.while (%[[ROW:.*]] = %{{.*}}) : (i64)
// CHECK:           memref.store %{{.*}}, %[[EDGES]]
// CHECK:           scf.for
// CHECK-NEXT:        arith.cmpi
// CHECK-NEXT:        scf.if
// CHECK-DAG:           memref.load %[[AREAS]][%{{.*}}] {nontemporal = true}
// CHECK-DAG:           %[[N:.*]] = memref.load %[[NUMBERS]][%{{.*}}] {nontemporal = true}
// CHECK-DAG:           arith.index_cast %[[N]]
// CHECK:           %[[EDGE:.*]] = memref.load %[[EDGES]][%{{.*}}] {nontemporal = true}
// CHECK:           %[[STEP:.*]] = memref.load %[[STEPS]][%{{.*}}] {nontemporal = true}
// CHECK:           arith.addi %[[EDGE]], %[[STEP]]
gpu.module @kernels {
  gpu.func @rows(%in: !llvm.ptr, %out: !llvm.ptr, %lo: index, %hi: index)
      workgroup(%cell: memref<1xindex, #gpu.address_space<workgroup>>)
      kernel attributes {known_block_size = array<i32: 64, 1, 1>} {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0 : i64
    %begin = memref.load %cell[%c0] {nontemporal = true} : memref<1xindex, #gpu.address_space<workgroup>>
    %area = llvm.load %in : !llvm.ptr -> f32
    %step = llvm.load %in : !llvm.ptr -> i64
    %limit = llvm.load %in : !llvm.ptr -> i64
    %number = llvm.load %in : !llvm.ptr -> i32
    %index = arith.index_cast %number : i32 to index
    %last = scf.while (%row = %limit) : (i64) -> i64 {
      %more = arith.cmpi sgt, %row, %zero : i64
      scf.condition(%more) %row : i64
    } do {
    ^bb0(%edge: i64):
      scf.for %x = %lo to %hi step %c1 {
        %covered = arith.cmpi slt, %limit, %zero : i64
        scf.if %covered {
          llvm.store %area, %out : f32, !llvm.ptr
          %place = arith.index_cast %index : index to i64
          llvm.store %place, %out : i64, !llvm.ptr
        }
      }
      %next = arith.addi %edge, %step : i64
      scf.yield %next : i64
    }
    gpu.return
  }
}

// -----

// ptxas may give as many registers as it likes: nothing is spilled.
// CHECK-LABEL: gpu.func @unbounded
// CHECK-NOT:     memref.store
gpu.module @kernels {
  gpu.func @unbounded(%in: !llvm.ptr, %out: !llvm.ptr, %lo: index, %hi: index)
      kernel attributes {known_block_size = array<i32: 64, 1, 1>} {
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0 : index
    %a = llvm.load %in : !llvm.ptr -> i64
    %b = llvm.load %in : !llvm.ptr -> i64
    %c = llvm.load %in : !llvm.ptr -> i64
    scf.for %x = %lo to %hi step %c1 {
      %covered = arith.cmpi slt, %x, %zero : index
      scf.if %covered {
        llvm.store %a, %out : i64, !llvm.ptr
        llvm.store %b, %out : i64, !llvm.ptr
        llvm.store %c, %out : i64, !llvm.ptr
      }
    }
    gpu.return
  }
}
