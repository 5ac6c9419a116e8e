// RUN: piko-opt %s --pass-pipeline='builtin.module(gpu.module(piko-reload-inputs))' | FileCheck %s

// A member is loaded for each unit where the loop over units has another one in it;
// one that only the innermost loop needs, before that; and one that is not
// marked stays.
// CHECK-LABEL: gpu.func @k
// CHECK-SAME:    (%[[INPUT:.*]]: !llvm.ptr, %[[OUT:.*]]: !llvm.ptr
// CHECK-NEXT:    arith.constant
// CHECK-NEXT:    %[[LOG:.*]] = llvm.load %[[OUT]]
// CHECK-NEXT:    %[[AT:.*]] = llvm.getelementptr inbounds %[[INPUT]][40]
// CHECK-NEXT:    %[[COUNT:.*]] = llvm.load %[[AT]] : !llvm.ptr -> i64
// CHECK-NEXT:    llvm.getelementptr
// CHECK-NEXT:    %[[UNITS:.*]] = arith.index_cast %[[COUNT]]
// CHECK-NEXT:    scf.for %[[UNIT:.*]] = %{{.*}} to %[[UNITS]]
// CHECK-NEXT:      %[[SAME:.*]] = llvm.intr.launder.invariant.group %[[INPUT]]
// CHECK-NEXT:      %[[FIRST:.*]] = llvm.load %[[SAME]] : !llvm.ptr -> i64
// CHECK-NEXT:      llvm.store %[[FIRST]], %[[LOG]]
// CHECK-NEXT:      %[[AGAIN:.*]] = llvm.intr.launder.invariant.group %[[INPUT]]
// CHECK-NEXT:      %[[STEP:.*]] = llvm.getelementptr inbounds %[[AGAIN]][16]
// CHECK-NEXT:      %[[ITEM:.*]] = llvm.load %[[STEP]]
// CHECK-NEXT:      scf.for
// CHECK-NEXT:        llvm.store %[[ITEM]], %[[LOG]]
// CHECK:           scf.for
// CHECK-NEXT:        llvm.store %{{.*}}, %[[LOG]]
gpu.module @kernels {
  gpu.func @k(%input: !llvm.ptr, %out: !llvm.ptr, %begin: index, %end: index, %v: i64) kernel {
    %c1 = arith.constant 1 : index
    %log = llvm.load %out : !llvm.ptr -> !llvm.ptr
    %first = llvm.load %input {piko.input} : !llvm.ptr -> i64
    %to_count = llvm.getelementptr inbounds %input[40] : (!llvm.ptr) -> !llvm.ptr, i8
    %count = llvm.load %to_count {piko.input} : !llvm.ptr -> i64
    %units = arith.index_cast %count : i64 to index
    %to_items = llvm.getelementptr inbounds %input[16] : (!llvm.ptr) -> !llvm.ptr, i8
    %items = llvm.load %to_items {piko.input} : !llvm.ptr -> i64
    scf.for %unit = %begin to %units step %c1 {
      llvm.store %first, %log : i64, !llvm.ptr
      scf.for %i = %begin to %end step %c1 {
        llvm.store %items, %log : i64, !llvm.ptr
      }
      scf.for %i = %begin to %end step %c1 {
        llvm.store %v, %log : i64, !llvm.ptr
      }
    }
    gpu.return
  }
}

// A thread that chooses the address itself loads once.
// CHECK-LABEL: gpu.func @own
// CHECK-NEXT:    llvm.getelementptr
// CHECK-NEXT:    %[[ONCE:.*]] = llvm.load
// CHECK-NOT:     piko.input
// CHECK-NOT:     launder
// CHECK:         scf.for
// CHECK-NEXT:      llvm.store %[[ONCE]]
gpu.module @others {
  gpu.func @own(%input: !llvm.ptr, %begin: index, %end: index, %step: index, %i: i64) kernel {
    %at = llvm.getelementptr inbounds %input[%i] : (!llvm.ptr, i64) -> !llvm.ptr, i8
    %loaded = llvm.load %at {piko.input} : !llvm.ptr -> i64
    scf.for %unit = %begin to %end step %step {
      llvm.store %loaded, %input : i64, !llvm.ptr
      scf.for %j = %begin to %end step %step {
        llvm.store %i, %input : i64, !llvm.ptr
      }
    }
    gpu.return
  }
}

// Only a run that fails needs it: there it is loaded, and cast. What fails is told
// by a store that is marked.
// CHECK-LABEL: gpu.func @fails
// CHECK:         scf.for
// CHECK-NEXT:      scf.for
// CHECK-NEXT:        scf.if
// CHECK-NEXT:          %[[INDEX:.*]] = llvm.intr.launder.invariant.group
// CHECK-NEXT:          %[[TILES:.*]] = llvm.load %[[INDEX]]
// CHECK-NEXT:          %[[CAST:.*]] = arith.index_cast %[[TILES]]
// CHECK-NEXT:          arith.divui %{{.*}}, %[[CAST]]
gpu.module @failing {
  gpu.func @fails(%input: !llvm.ptr, %begin: index, %end: index, %bad: i1) kernel {
    %c1 = arith.constant 1 : index
    %tiles = llvm.load %input {piko.input} : !llvm.ptr -> i64
    %index = arith.index_cast %tiles : i64 to index
    scf.for %cell = %begin to %end step %c1 {
      scf.for %i = %begin to %end step %c1 {
        scf.if %bad {
          %bin = arith.divui %cell, %index : index
          %number = arith.index_cast %bin : index to i64
          llvm.store %number, %input {piko.fails} : i64, !llvm.ptr
        }
      }
      scf.for %i = %begin to %end step %c1 {
        scf.if %bad {
          %number = arith.index_cast %i : index to i64
          llvm.store %number, %input : i64, !llvm.ptr
        }
      }
    }
    gpu.return
  }
}
