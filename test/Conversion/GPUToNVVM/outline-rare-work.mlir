// RUN: piko-opt %s --pass-pipeline='builtin.module(gpu.module(piko-outline-rare-work))' --split-input-file | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(gpu.module(piko-outline-rare-work,convert-scf-to-cf-in-reverse,convert-gpu-to-exact-nvvm))' --split-input-file | FileCheck %s --check-prefix=LLVM

// What the thread's number gives is computed again; parameters go by shared memory; an array of the loop's own moves; of another one a copy comes back.
// CHECK-LABEL: gpu.module @kernels
// CHECK:         func.func @k_rare(%[[BEGIN:.*]]: index, %[[END:.*]]: index, %[[SUM:.*]]: f32, %[[WORDS:.*]]: memref<2xi64, #gpu.address_space<workgroup>>, %[[A:.*]]: f32, %[[B:.*]]: f32) -> (f32, f32)
// CHECK-SAME:        noinline
// CHECK-DAG:       gpu.thread_id x
// CHECK-DAG:       memref.load %[[WORDS]][%c0
// CHECK-DAG:       llvm.inttoptr
// CHECK-DAG:       memref.alloca() : memref<32xf32>
// CHECK-DAG:       memref.alloca() : memref<2xf32>
// CHECK:           scf.for %{{.*}} = %[[BEGIN]] to %[[END]]
// CHECK-NOT:       piko.rare
// CHECK:           return %{{.*}}, %{{.*}} : f32, f32
// CHECK:         gpu.func @k
// CHECK-SAME:      workgroup(%[[MEMORY:.*]] : memref<2xi64, #gpu.address_space<workgroup>>)
// CHECK-NOT:       memref<32xf32>
// CHECK:           %[[KEPT:.*]] = memref.alloca() : memref<2xf32>
// CHECK:           llvm.ptrtoint
// CHECK:           memref.store %{{.*}}, %[[MEMORY]]
// CHECK:           %[[R:.*]]:2 = {{.*}}call @k_rare(
// CHECK:           memref.store %[[R]]#0, %[[KEPT]]
// CHECK:           memref.store %[[R]]#1, %[[KEPT]]
// CHECK-NOT:       scf.for
// CHECK:           gpu.return

// LLVM:         llvm.func internal @k_rare(
// LLVM-SAME:      noinline
// LLVM:         llvm.func @k(
// LLVM-SAME:      nvvm.kernel, nvvm.maxnreg = 64
// LLVM:           llvm.call @k_rare(
gpu.module @kernels {
  gpu.func @k(%out: !llvm.ptr, %count: i64, %begin: index, %end: index, %v: f32) kernel {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %t = gpu.thread_id x
    %own = memref.alloca() : memref<32xf32>
    %kept = memref.alloca() : memref<2xf32>
    memref.store %v, %kept[%c0] : memref<2xf32>
    %sum = arith.addf %v, %v : f32
    scf.for %i = %begin to %end step %c1 {
      memref.store %sum, %own[%t] : memref<32xf32>
      %x = memref.load %own[%i] : memref<32xf32>
      memref.store %x, %kept[%c1] : memref<2xf32>
      llvm.store %count, %out : i64, !llvm.ptr
    } {piko.rare}
    %a = memref.load %kept[%c1] : memref<2xf32>
    llvm.store %a, %out : f32, !llvm.ptr
    gpu.return
  }
}

// -----

// A loop that is not marked stays, and so does the kernel's bound.
// CHECK-LABEL: gpu.module @kernels
// CHECK-NOT:     func.func
// CHECK:         gpu.func @k
// CHECK-NOT:       maxnreg
// CHECK:           scf.for
// LLVM-NOT:      noinline
gpu.module @kernels {
  gpu.func @k(%out: !llvm.ptr, %begin: index, %end: index, %v: f32) kernel {
    %c1 = arith.constant 1 : index
    scf.for %i = %begin to %end step %c1 {
      llvm.store %v, %out : f32, !llvm.ptr
    }
    gpu.return
  }
}

// -----

// A region gives what it yields.
// CHECK-LABEL: gpu.module @kernels
// CHECK:         func.func @k_rare(%[[V:.*]]: f32{{.*}}) -> f32
// CHECK:           memref.alloca() : memref<4xf32>
// CHECK:           %[[X:.*]] = scf.execute_region
// CHECK:           return %[[X]] : f32
// CHECK:         gpu.func @k
// CHECK-NOT:       memref.alloca
// CHECK:           scf.if
// CHECK-NEXT:        %[[R:.*]] = {{.*}}call @k_rare(
// CHECK-NEXT:        scf.yield %[[R]] : f32

// LLVM:         llvm.func internal @k_rare({{.*}}) -> f32
gpu.module @kernels {
  gpu.func @k(%out: !llvm.ptr, %is: i1, %v: f32, %at: index) kernel {
    %own = memref.alloca() : memref<4xf32>
    %r = scf.if %is -> f32 {
      %x = scf.execute_region -> f32 no_inline {
        memref.store %v, %own[%at] : memref<4xf32>
        %y = memref.load %own[%at] : memref<4xf32>
        scf.yield %y : f32
      } {piko.rare}
      scf.yield %x : f32
    } else {
      scf.yield %v : f32
    }
    llvm.store %r, %out : f32, !llvm.ptr
    gpu.return
  }
}
