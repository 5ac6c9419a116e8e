// RUN: piko-opt %s --pass-pipeline='builtin.module(gpu.module(convert-gpu-to-exact-nvvm))' --split-input-file --verify-diagnostics | FileCheck %s

// Functions become LLVM's, which PTX has exactly, and none of libdevice's.
// CHECK-LABEL: llvm.func @k(
// CHECK-SAME:      nvvm.kernel
// CHECK:         nvvm.read.ptx.sreg.tid.x
// CHECK:         llvm.intr.sqrt({{.*}}) : (f32) -> f32
// CHECK:         llvm.intr.floor({{.*}}) : (f32) -> f32
// CHECK:         llvm.intr.fma({{.*}}) : (f64, f64, f64) -> f64
// CHECK:         nvvm.barrier
// CHECK-NOT:   __nv_
gpu.module @kernels {
  gpu.func @k(%memory: memref<?xf32>, %wide: memref<?xf64>) kernel {
    %t = gpu.thread_id x
    %v = memref.load %memory[%t] : memref<?xf32>
    %s = math.sqrt %v : f32
    %f = math.floor %s : f32
    %w = memref.load %wide[%t] : memref<?xf64>
    %m = math.fma %w, %w, %w : f64
    gpu.barrier
    memref.store %f, %memory[%t] : memref<?xf32>
    memref.store %m, %wide[%t] : memref<?xf64>
    gpu.return
  }
}

// -----

// What a pointer in memory points to is global.
// CHECK-LABEL: llvm.func @pointers(
// CHECK:         %[[GLOBAL:.*]] = llvm.load %{{.*}} : !llvm.ptr -> !llvm.ptr<1>
// CHECK:         %[[POINTER:.*]] = llvm.addrspacecast %[[GLOBAL]] : !llvm.ptr<1> to !llvm.ptr
// CHECK:         llvm.load %[[POINTER]] : !llvm.ptr -> f32
gpu.module @kernels {
  gpu.func @pointers(%input: !llvm.ptr, %memory: memref<?xf32>) kernel {
    %t = gpu.thread_id x
    %p = llvm.load %input : !llvm.ptr -> !llvm.ptr
    %v = llvm.load %p : !llvm.ptr -> f32
    memref.store %v, %memory[%t] : memref<?xf32>
    gpu.return
  }
}

// -----

gpu.module @kernels {
  gpu.func @k(%memory: memref<?xf32>) kernel {
    %t = gpu.thread_id x
    %v = memref.load %memory[%t] : memref<?xf32>
    // expected-error @below {{expected a function that PTX has exactly}}
    %s = math.sin %v : f32
    memref.store %s, %memory[%t] : memref<?xf32>
    gpu.return
  }
}

// -----

// What is not to be kept over a loop is loaded where it stands, and bounds the
// kernel's registers.
// CHECK-LABEL: gpu.module @short
// CHECK:         llvm.func @k(
// CHECK-SAME:      nvvm.maxnreg = 64
// CHECK:           llvm.load volatile %{{.*}} : !llvm.ptr<3> -> i64
// CHECK:           llvm.load %{{.*}} : !llvm.ptr<3> -> i64
gpu.module @short {
  gpu.func @k(%out: !llvm.ptr, %i: index) workgroup(%memory: memref<64xi64, #gpu.address_space<workgroup>>) kernel {
    %a = memref.load %memory[%i] {nontemporal = true} : memref<64xi64, #gpu.address_space<workgroup>>
    %b = memref.load %memory[%i] : memref<64xi64, #gpu.address_space<workgroup>>
    %c = arith.addi %a, %b : i64
    llvm.store %c, %out : i64, !llvm.ptr
    gpu.return
  }
}
