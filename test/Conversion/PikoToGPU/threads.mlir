// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads,piko-to-grids))' --split-input-file | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=32},piko-to-grids))' --split-input-file | FileCheck %s --check-prefix=ASKED

// A bin of 64 x 64 pixels has a thread for every 16, and not the stage's 64.
// CHECK-LABEL: piko.pipeline @Large
// CHECK:         threads({{.*}}) in (%{{[a-z0-9_]*}} = %c256,
// ASKED-LABEL: piko.pipeline @Large
// ASKED:         threads({{.*}}) in (%{{[a-z0-9_]*}} = %c32,
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @Large rank 2 {
  piko.image @image : @F rank 2
  piko.source @draw
  piko.stage @draw bins [64, 64] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

// Neither a smaller bin nor the whole domain has more than the stage has.
// CHECK-LABEL: piko.pipeline @Small
// CHECK:         threads({{.*}}) in (%{{[a-z0-9_]*}} = %c64,
// CHECK:         threads({{.*}}) in (%{{[a-z0-9_]*}} = %c128,
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @Small rank 2 {
  piko.source @draw
  piko.edge @draw[0] -> @whole
  piko.stage @draw bins [32, 16] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @whole bins [0, 0] threads 128 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
