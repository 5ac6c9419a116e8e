// RUN: piko-opt %s --convert-gpu-to-cuda --split-input-file --verify-diagnostics

module attributes {gpu.container_module} {
  // expected-error @below {{expected a function 'Dots.setup' beside the kernels}}
  gpu.module @Dots_gpu {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @Dots.setup(%p: !llvm.ptr) {
    return
  }
  func.func @launch(%frame: !llvm.ptr, %n: index) {
    %one = arith.constant 1 : index
    // expected-error @below {{expected a grid and blocks of one dimension}}
    gpu.launch_func @Dots_gpu::@k blocks in (%n, %n, %one) threads in (%one, %one, %one)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}
