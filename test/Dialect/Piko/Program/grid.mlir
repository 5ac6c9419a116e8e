// RUN: piko-opt %s | piko-opt | FileCheck %s
// What grids have besides blocks and threads: the log, append buffers, and queues.

piko.record @F {"x" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.source @draw
  piko.stage @draw bins [8] threads 64 : @F -> [] {}
  piko.kernel @kernel_draw {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    %one_i32 = arith.constant 1 : i32
    %bins = piko.storage.open_bins @draw : !piko.bins<@F>
    // CHECK: %[[BLOCKS:.*]] = piko.gpu.block_count %[[BINS:.*]] of %[[ONE:.*]] : !piko.bins<@F>
    %blocks = piko.gpu.block_count %bins of %one : !piko.bins<@F>
    // CHECK: %[[LOG:.*]] = piko.gpu.open_log %[[BINS]] : !piko.bins<@F>
    %log = piko.gpu.open_log %bins : !piko.bins<@F>
    // CHECK: %[[OTHER:.*]] = piko.gpu.log_of %[[LOG]] of @draw
    %other = piko.gpu.log_of %log of @draw
    gpu.launch blocks(%b, %b1, %b2) in (%g = %blocks, %g1 = %one, %g2 = %one)
        threads(%t, %t1, %t2) in (%s = %one, %s1 = %one, %s2 = %one)
        workgroup(%words : memref<33xi64, 3>, %count : memref<1xi32, 3>,
                  %lengths : memref<32xi32, 3>, %starts : memref<32xi32, 3>,
                  %classes : memref<96xi32, 3>, %order : memref<96xi16, 3>,
                  %kept : memref<4xi64, 3>) {
      %own = memref.alloca() : memref<7xi64>
      %more = memref.alloca() : memref<14xi64>
      // CHECK: piko.gpu.append_buffers %[[LOG]] in %{{.*}} : memref<7xi64> using %[[WORDS:.*]] : memref<33xi64, 3>
      piko.gpu.append_buffers %log in %own : memref<7xi64> using %words : memref<33xi64, 3>
      // CHECK: piko.gpu.append_buffers %[[LOG]] for errors in %{{.*}} : memref<7xi64> using %[[WORDS]] : memref<33xi64, 3>
      piko.gpu.append_buffers %log for errors in %own : memref<7xi64> using %words : memref<33xi64, 3>
      // CHECK: piko.gpu.append_buffers %[[LOG]] in %{{.*}} : memref<14xi64> using %[[WORDS]] : memref<33xi64, 3> local [@draw] [0] in %{{.*}} : memref<4xi64, 3>
      piko.gpu.append_buffers %log in %more : memref<14xi64> using %words : memref<33xi64, 3> local [@draw] [0] in %kept : memref<4xi64, 3>
      // CHECK: %[[FIRST:.*]] = piko.gpu.take_units %[[LOG]][%[[ONE]]] for rest
      %first = piko.gpu.take_units %log[%one] for rest
      // CHECK: %[[REST:.*]] = piko.gpu.rest %[[LOG]][%[[FIRST]]]
      %rest = piko.gpu.rest %log[%first]
      scf.for %i = %zero to %rest step %one {
        %entry = memref.atomic_rmw addi %one_i32, %count[%zero] : (i32, memref<1xi32, 3>) -> i32
        // CHECK: piko.gpu.leave_round
        piko.gpu.leave_round
      } {piko.shared}
      // CHECK: piko.gpu.drain %{{.*}}, %{{.*}}, %{{.*}}, %{{.*}}, %{{.*}} : memref<1xi32, 3>, memref<32xi32, 3>, memref<32xi32, 3>, memref<96xi32, 3>, memref<96xi16, 3> {
      // CHECK-NEXT: ^bb0(%{{.*}}: index):
      piko.gpu.drain %count, %lengths, %starts, %classes, %order : memref<1xi32, 3>, memref<32xi32, 3>, memref<32xi32, 3>, memref<96xi32, 3>, memref<96xi16, 3> {
      ^bb0(%entry: index):
        %class = memref.load %classes[%entry] : memref<96xi32, 3>
      }
      // CHECK: piko.gpu.flush %[[LOG]][%[[FIRST]]] using %[[WORDS]] : memref<33xi64, 3>
      piko.gpu.flush %log[%first] using %words : memref<33xi64, 3>
      // CHECK: piko.gpu.leave_rest %[[LOG]][%[[FIRST]]] from %[[REST]]
      piko.gpu.leave_rest %log[%first] from %rest
      gpu.terminator
    }
    // CHECK: piko.gpu.close_log %[[LOG]]
    piko.gpu.close_log %log
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
