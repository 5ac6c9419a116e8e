// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-program))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// What stays in its bins all the way comes there in order as it was emitted, and
// so does what goes on to a list, which begins a lineage.
// CHECK-LABEL: piko.pipeline @Stays
// CHECK:         piko.join @a(concatenate
// CHECK:         piko.join @b(concatenate
// CHECK:         piko.join @c(concatenate
// CHECK:         piko.join @d(concatenate
piko.pipeline @Stays rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.edge @c[0] -> @d
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
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
  piko.stage @b bins [8] threads 1 : @F -> [@F] {
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
  piko.stage @c bins [8] threads 1 : list @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %one = arith.constant 1 : i32
      piko.emit 0 (%one) : i32
      piko.return
    }
  }
  piko.stage @d bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// After @b the order of different bins shows: what comes to it needs that of
// lineage, too. What @d gets may be of another bin.
// CHECK-LABEL: piko.pipeline @Leaves
// CHECK:         piko.join @a(concatenate
// CHECK:         piko.join @b(permute
// CHECK:         piko.join @c(permute
// CHECK:         piko.join @d(permute
piko.pipeline @Leaves rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.edge @a[1] -> @d
  piko.stage @a bins [8] threads 1 : @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.emit 1 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : @F -> [@F] {
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
  piko.stage @c bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
  piko.stage @d bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}

// A loop puts what leaves it to one stage in order, by however many edges.
// CHECK-LABEL: piko.pipeline @Exits
// CHECK:         %[[IN:.*]] = piko.launch @source_0_a
// CHECK:         %[[LEFT:.*]]:2 = piko.waves(%[[IN]]) {
// CHECK:           piko.join @a(concatenate %{{.*}}, concatenate
// CHECK:         }
// CHECK:         piko.join @c(concatenate %[[LEFT]]#0, concatenate %[[LEFT]]#1)
piko.pipeline @Exits rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @c
  piko.edge @b[0] -> @a
  piko.edge @b[1] -> @c
  piko.stage @a bins [8] threads 1 : @F -> [@F, @F] {
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
  piko.stage @b bins [8] threads 1 : @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @c bins [8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
}
