// RUN: piko-opt %s | piko-opt | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// What lanes are given stands after what work takes.
// CHECK-LABEL: piko.pipeline @Lanes
piko.pipeline @Lanes rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.stage @a bins [8] threads 1 placed : @F -> [@F] {
    // CHECK: piko.schedule load_balance unordered lanes iterations
    piko.schedule load_balance unordered lanes iterations
  }
  piko.stage @b bins [8] threads 1 placed : @F -> [@F] {
    piko.schedule load_balance end_bin
  }
  piko.stage @c bins [8] threads 1 placed : list @F -> [] {}
  piko.kernel @source_0_a {
    // CHECK: piko.items of @a source 0 lanes items {
    piko.items of @a source 0 lanes items {
    ^bb0(%f: !piko.prim<@F>):
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      // CHECK: piko.items of @a lanes iterations {
      piko.items of @a lanes iterations {
      ^bb0(%f: !piko.prim<@F>):
      }
      // CHECK: piko.items of @b from @a[0] lanes collapsed {
      piko.items of @b from @a[0] lanes collapsed {
      ^bb0(%f: !piko.prim<@F>):
      }
      // CHECK: piko.lists of @c from @b[0] lanes one {
      piko.lists of @c from @b[0] lanes one {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// CHECK-LABEL: piko.pipeline @Before
piko.pipeline @Before rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 64 : @F -> [] {}
  // CHECK: piko.kernel @first precedes @kernel_a {
  piko.kernel @first precedes @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        // CHECK: piko.position %{{.*}} : !piko.prim<@F>
        %p = piko.position %f : !piko.prim<@F>
      }
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}
