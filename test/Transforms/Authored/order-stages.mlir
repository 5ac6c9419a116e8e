// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages))' %s | FileCheck %s

piko.record @F {"z" : f32 at 0} size 4 align 4

// Producers come before consumers, whatever the order of the text.
// CHECK-LABEL: piko.pipeline @Linear
// CHECK:         piko.stage @first {{.*}} lineage 0
// CHECK:         piko.stage @second {{.*}} lineage 1
// CHECK:         piko.stage @third {{.*}} lineage 2
piko.pipeline @Linear rank 2 {
  piko.source @first
  piko.edge @first[0] -> @second
  piko.edge @second[0] -> @third
  piko.stage @third bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @second bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @first bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// The longer branch runs first, and to its end: the short one would only hold
// on to memory. Lineage numbers follow the declaration.
// CHECK-LABEL: piko.pipeline @Branches
// CHECK:         piko.stage @split {{.*}} lineage 0
// CHECK:         piko.stage @long {{.*}} lineage 2
// CHECK:         piko.stage @longer {{.*}} lineage 3
// CHECK:         piko.stage @short {{.*}} lineage 1
// CHECK:         piko.stage @join {{.*}} lineage 4
piko.pipeline @Branches rank 2 {
  piko.source @split
  piko.edge @split[0] -> @short
  piko.edge @split[1] -> @long
  piko.edge @long[0] -> @longer
  piko.edge @longer[0] -> @join
  piko.edge @short[0] -> @join
  piko.stage @split bins [0, 0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @short bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @long bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @longer bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @join bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// A stage that waits starts a branch, which comes after the one it waits for
// although it is farther from the drain.
// CHECK-LABEL: piko.pipeline @Waits
// CHECK:         piko.stage @shadow
// CHECK:         piko.stage @shade
// CHECK:         piko.stage @write
piko.pipeline @Waits rank 2 {
  piko.source @shade
  piko.source @shadow
  piko.edge @shade[0] -> @write
  piko.stage @shade bins [0, 0] threads 1 : @F -> [@F] {
    piko.schedule load_balance end_stage [@shadow]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @write bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @shadow bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// The stages of a cycle stand together, as declared; a cycle
// has its place among the branches.
// CHECK-LABEL: piko.pipeline @Cycles
// CHECK:         piko.stage @in {{.*}} lineage 0 :
// CHECK:         piko.stage @self {{.*}} lineage 1 :
// CHECK:         piko.stage @a {{.*}} lineage 2 :
// CHECK:         piko.stage @b {{.*}} lineage 3 :
// CHECK:         piko.stage @out {{.*}} lineage 4 :
piko.pipeline @Cycles rank 2 {
  piko.source @in
  piko.edge @in[0] -> @self
  piko.edge @self[0] -> @self
  piko.edge @self[1] -> @b
  piko.edge @b[0] -> @a
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @out
  piko.stage @out bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @self bins [0, 0] threads 1 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @in bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
