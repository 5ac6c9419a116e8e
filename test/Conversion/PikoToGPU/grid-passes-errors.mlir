// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-share-pixels))' --split-input-file --verify-diagnostics
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-share-loops))' --split-input-file --verify-diagnostics
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-compact-work))' --split-input-file --verify-diagnostics
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-split-rare))' --split-input-file --verify-diagnostics
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-blocks))' --split-input-file --verify-diagnostics
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-take-units))' --split-input-file 2>&1 | FileCheck %s
// CHECK-COUNT-2: error: 'gpu.launch' op expected work that is mapped to threads, as piko-map-blocks makes it
// Each pass on a launch that the one before it has not made.

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoBuffers rank 1 {
  piko.source @draw
  piko.stage @draw bins [8] threads 64 : @F -> [] {}
  piko.kernel @kernel_draw {
    %one = arith.constant 1 : index
    %bins = piko.storage.open_bins @draw : !piko.bins<@F>
    // expected-error@+1 {{expected a constant size of blocks and piko.gpu.append_buffers, as piko-form-grids makes them}}
    gpu.launch blocks(%b, %b1, %b2) in (%g = %one, %g1 = %one, %g2 = %one)
        threads(%t, %t1, %t2) in (%s = %one, %s1 = %one, %s2 = %one) {
      gpu.terminator
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @AnySize rank 1 {
  piko.source @draw
  piko.stage @draw bins [8] threads 64 : @F -> [] {}
  piko.kernel @kernel_draw {
    %one = arith.constant 1 : index
    %some = piko.domain[0]
    %bins = piko.storage.open_bins @draw : !piko.bins<@F>
    %log = piko.gpu.open_log %bins : !piko.bins<@F>
    // expected-error@+1 {{expected a constant size of blocks and piko.gpu.append_buffers, as piko-form-grids makes them}}
    gpu.launch blocks(%b, %b1, %b2) in (%g = %one, %g1 = %one, %g2 = %one)
        threads(%t, %t1, %t2) in (%s = %some, %s1 = %one, %s2 = %one)
        workgroup(%words : memref<33xi64, 3>) {
      %buffers = memref.alloca() : memref<7xi64>
      piko.gpu.append_buffers %log in %buffers : memref<7xi64> using %words
        : memref<33xi64, 3>
      gpu.terminator
    }
    piko.gpu.close_log %log
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
