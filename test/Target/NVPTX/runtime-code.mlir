// RUN: split-file %s %t
// RUN: pikoc %t/known.mlir --emit=ptx -o - | FileCheck %s
// RUN: not pikoc %t/unknown.mlir --emit=ptx -o - 2>&1 | FileCheck %s --check-prefix=UNKNOWN
// RUN: not pikoc %t/other.mlir --emit=ptx -o - 2>&1 | FileCheck %s --check-prefix=OTHER
// Kernels have C++ of the runtime inline: nothing is called. A call of what there is not
// is an error.

// CHECK-LABEL: .entry kernel(
// CHECK-NOT:     call
// The position from which on a second launch goes on, 16 bytes into what is said of unit 3.
// CHECK:         ld.global.b64 %[[UNITS:rd[0-9]+]], [%{{rd[0-9]+}}+24]
// CHECK:         ld.global.b64 %[[REST:rd[0-9]+]], [%[[UNITS]]+88]
// CHECK:         st.global.b64 [%{{rd[0-9]+}}], %[[REST]]

//--- known.mlir
piko.pipeline @P rank 1 {}

gpu.module @kernels {
  gpu.func @kernel(%log: !llvm.ptr, %out: !llvm.ptr) kernel {
    %unit = arith.constant 3 : i64
    %rest = piko.gpu.call "pikoir_grid_rest"(%log, %unit) : (!llvm.ptr, i64) -> i64
    llvm.store %rest, %out : i64, !llvm.ptr
    gpu.return
  }
}

// UNKNOWN: unknown.mlir:3:1: error: kernels have no function 'pikoir_grid_none' inline

//--- unknown.mlir
piko.pipeline @P rank 1 {}

gpu.module @kernels {
  gpu.func @kernel(%log: !llvm.ptr) kernel {
    piko.gpu.call "pikoir_grid_none"(%log) : (!llvm.ptr) -> ()
    gpu.return
  }
}

// OTHER: other.mlir:3:1: error: expected the arguments and the result of 'pikoir_grid_rest' as the runtime's header has them

//--- other.mlir
piko.pipeline @P rank 1 {}

gpu.module @kernels {
  gpu.func @kernel(%log: !llvm.ptr) kernel {
    piko.gpu.call "pikoir_grid_rest"(%log) : (!llvm.ptr) -> ()
    gpu.return
  }
}
