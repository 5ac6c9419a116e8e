// RUN: piko-opt --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// The stages 0 and 1, which may write state, take source 0, 256 primitives at a
// time.
// CHECK-LABEL: func.func @P.setup
// CHECK:         llvm.call @pikoir_declare_stage(%{{.*}}, %c0_i32, {{.*}}, %c0_i32, %c0_i64) :
// CHECK:         llvm.call @pikoir_declare_stage(%{{.*}}, %c1_i32, {{.*}}, %c64_i32, %c0_i64) :
// CHECK:         llvm.call @pikoir_declare_strips(%{{.*}}, %c0_i32, %c0_i32, %c256_i64, %{{.*}}, %c2_i32)

// The kernels run for each strip, and once more where the runtime takes a strip
// back; a status ends the run only after the loop.
// CHECK-LABEL: func.func @P.run(%{{.*}}: !llvm.ptr)
// CHECK:         %[[BEFORE:.*]] = call @P.kernel_before
// CHECK:         cf.cond_br %{{.*}}, ^[[EXIT:bb[0-9]+]](%[[BEFORE]] : i32), ^[[NEXT:bb[0-9]+]]
// CHECK:       ^[[NEXT]]:
// CHECK:         %[[MORE:.*]] = llvm.call @pikoir_strips_next(%{{.*}}, %c0_i32)
// CHECK:         %[[ENDED:.*]] = arith.cmpi eq, %[[MORE]], %c0_i32
// CHECK:         cf.cond_br %[[ENDED]], ^[[AFTER:bb[0-9]+]], ^[[STRIP:bb[0-9]+]]
// CHECK:       ^[[STRIP]]:
// CHECK:         call @P.kernel_a
// CHECK:         cf.cond_br %{{.*}}, ^[[NEXT]], ^[[B:bb[0-9]+]]
// CHECK:       ^[[B]]:
// CHECK:         call @P.kernel_b
// CHECK:         cf.br ^[[NEXT]]
// CHECK:       ^[[AFTER]]:
// CHECK:         %[[STATUS:.*]] = llvm.call @pikoir_status
// CHECK:         cf.cond_br %{{.*}}, ^[[EXIT]](%[[STATUS]] : i32)
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.source @before
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 writes : @F -> [] {}
  piko.stage @before bins [0] threads 1 : @F -> [] {}
  piko.kernel @kernel_before {
    %bins = piko.storage.open_bins @before : !piko.bins<@F>
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
  piko.program {
    %1 = piko.feed 1 : !piko.edge<@F>
    %before = piko.join @before(concatenate %1) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_before(%before) : (!piko.bins<@F>) -> ()
    %0 = piko.feed 0 : !piko.edge<@F>
    piko.strips(%0) chunk 256 {
    ^bb0(%strip: !piko.edge<@F>):
      %a = piko.join @a(concatenate %strip) : (!piko.edge<@F>) -> !piko.bins<@F>
      %out = piko.launch @kernel_a(%a) : (!piko.bins<@F>) -> !piko.edge<@F>
      %b = piko.join @b(concatenate %out) : (!piko.edge<@F>) -> !piko.bins<@F>
      piko.launch @kernel_b(%b) : (!piko.bins<@F>) -> ()
    } : (!piko.edge<@F>) -> ()
  }
}
