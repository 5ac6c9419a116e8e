// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @G {"y" : i32 at 0} size 4 align 4

// One kernel a stage, with the assign phases of what its ports feed; a stage
// that a source feeds has its primitives placed just before it runs.
// CHECK-LABEL: piko.pipeline @P
// CHECK:         piko.stage @a {{.*}} {
// CHECK-NEXT:    }
// CHECK:         piko.stage @b {{.*}} {
// CHECK-NEXT:      piko.schedule direct_map
// CHECK-NEXT:    }
// CHECK:         piko.kernel @source_0_a {
// CHECK-NEXT:      piko.assign of @a source 0 {
// CHECK:             piko.assign_all
// CHECK:         piko.kernel @kernel_a {
// CHECK-NEXT:      piko.process of @a {
// CHECK:             piko.emit 0
// CHECK:           piko.assign of @b port 0 {
// CHECK:             piko.assign_to
// CHECK:         piko.kernel @kernel_b {
// CHECK-NEXT:      piko.process of @b {
// CHECK-NOT:       piko.assign
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [4] threads 1 : @F -> [@G] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : @G -> [] {
    piko.schedule direct_map
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      %y = piko.get %g "y" : !piko.prim<@G> -> i32
      %bin = piko.bin_at %y : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
}

// A phase that only says that all primitives are in the one bin is left out,
// so that a source needs no kernel; but not what may be an error, or culls.
// CHECK-LABEL: piko.pipeline @OneBin
// CHECK-NOT:     piko.assign
// CHECK:         piko.kernel @kernel_a {
// CHECK-NEXT:      piko.process of @a {
// CHECK-NOT:       piko.assign
// CHECK:         piko.kernel @kernel_b {
// CHECK-NEXT:      piko.process of @b {
// CHECK:           piko.assign of @outside port 0 {
// CHECK:             piko.assign_to
// CHECK:         piko.kernel @kernel_outside {
// CHECK-NEXT:      piko.process of @outside {
// CHECK:           piko.assign of @culled port 0 {
// CHECK:             scf.if
// CHECK:         piko.kernel @kernel_culled {
// CHECK-NEXT:      piko.process of @culled {
// CHECK:           piko.assign of @owned port 0 {
// CHECK:             piko.owner
piko.pipeline @OneBin rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @outside
  piko.edge @outside[0] -> @culled
  piko.edge @culled[0] -> @owned
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      piko.assign_to %zero
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @outside bins [0] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : index
      piko.assign_to %one
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @culled bins [0] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : i32
      %keep = arith.cmpi ne, %x, %zero : i32
      scf.if %keep {
        piko.assign_all
      }
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @owned bins [0] threads 1 tile 4 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.owner [%x : i32]
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
