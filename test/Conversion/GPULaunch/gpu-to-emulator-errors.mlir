// RUN: piko-opt %s --convert-gpu-to-emulator --split-input-file --verify-diagnostics

module attributes {gpu.container_module} {
  func.func @launch(%frame: !llvm.ptr, %n: index) {
    %one = arith.constant 1 : index
    // expected-error @below {{expected a grid and blocks of one dimension}}
    gpu.launch_func @m::@k blocks in (%n, %n, %one) threads in (%one, %one, %one)
    return
  }
  gpu.module @m {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @launch(%frame: !llvm.ptr, %n: index, %a: memref<4xf32>) {
    %one = arith.constant 1 : index
    // expected-error @below {{expected arguments that are numbers or pointers, but got type 'memref<4xf32>'}}
    gpu.launch_func @m::@k blocks in (%n, %one, %one) threads in (%one, %one, %one)
        args(%a : memref<4xf32>)
    return
  }
  gpu.module @m {
    gpu.func @k(%a: memref<4xf32>) kernel {
      gpu.return
    }
  }
}
