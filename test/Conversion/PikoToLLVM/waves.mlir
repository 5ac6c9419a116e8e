// RUN: piko-opt --piko-form-program --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// One loop, which is a cycle of its own. What comes in has keys, because it comes
// along two edges; what goes around has none. What the last stage takes is
// permuted, and merged.
// CHECK-LABEL: func.func @Waves.setup
// CHECK:         llvm.call @pikoir_declare_keys(%{{.*}}, %c0_i32, %c1_i32)
// CHECK:         llvm.call @pikoir_declare_cycle(%{{.*}}, %c0_i32, %{{.*}}, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_loop(%{{.*}}, %c0_i32, %{{.*}}, %c2_i32, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_join(%{{.*}}, %c0_i32, %c0_i32, %c1_i32, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_join(%{{.*}}, %c2_i32, %c0_i32, %c0_i32, %c0_i32)
// CHECK:         llvm.call @pikoir_declare_join(%{{.*}}, %c1_i32, %c0_i32, %c0_i32, %c0_i32)
// CHECK:         llvm.call @pikoir_declare_join(%{{.*}}, %c2_i32, %c1_i32, %c0_i32, %c3_i32)

// State is cleared first. In the loop, the runtime names the kernel for which
// there is something.
// CHECK-LABEL: func.func @Waves.run
// CHECK:         llvm.call @pikoir_clear(%{{.*}}, %c0_i32)
// CHECK:         call @Waves.kernel_start
// CHECK:       ^[[STEP:bb[0-9]+]]:
// CHECK:         %[[S:.*]] = llvm.call @pikoir_loop_step(%{{.*}}, %c0_i32)
// CHECK:         cf.cond_br %{{.*}}, ^[[AFTER:bb[0-9]+]], ^{{.*}}
// CHECK:         cf.switch %[[S]] : i32, [
// CHECK-NEXT:      default: ^[[AFTER]],
// CHECK-NEXT:      1: ^[[A:bb[0-9]+]],
// CHECK-NEXT:      2: ^{{.*}}
// CHECK:       ^[[A]]:
// CHECK:         call @Waves.kernel_a
// CHECK:         cf.cond_br %{{.*}}, ^{{.*}}, ^[[STEP]]
// CHECK:       ^[[AFTER]]:
// CHECK:         llvm.call @pikoir_status
// CHECK:         call @Waves.kernel_last
piko.pipeline @Waves rank 1 {
  piko.image @seen : @F rank 1
  piko.source @start
  piko.source @b
  piko.source @last
  piko.edge @start[0] -> @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  piko.edge @b[1] -> @last
  piko.stage @start bins [8] threads 1 placed : @F -> [@F] {}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [@F, @F] {}
  piko.stage @last bins [0] threads 1 : @F -> [] {}
  piko.kernel @assign_start {
    %bins = piko.storage.open_bins @start source 0 : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_start {
    %bins = piko.storage.open_bins @start : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_b {
    %bins = piko.storage.open_bins @b : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_last {
    %bins = piko.storage.open_bins @last : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
