// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-fuse-stages))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "w" : f32[3 : 4] at 4} size 16 align 4
piko.record @G {"v" : f32 at 0} size 4 align 4

// Three stages become one: the condition of an assign phase stays around what
// its stage does, fields become the numbers that were emitted, ports follow each
// other, and who waited for a part waits for the whole.
// CHECK-LABEL: piko.pipeline @Chain
// CHECK:       piko.edge @a[0] -> @end
// CHECK-NEXT:  piko.edge @a[1] -> @end
// CHECK-NOT:   piko.edge
piko.pipeline @Chain rank 1 {
  piko.image @count : @G rank 1
  piko.source @a
  piko.source @last
  piko.edge @a[0] -> @b
  piko.edge @a[1] -> @end
  piko.edge @b[0] -> @c
  piko.edge @c[0] -> @end
  // CHECK:      piko.stage @a bins [8] threads 64 lineage {{[0-9]+}} fused ["b", "c"] : @F -> [@G, @G] {
  // CHECK:        piko.schedule direct_map
  // CHECK:        ^bb0(%[[P:.*]]: !piko.prim<@F>):
  // CHECK:          %[[X:.*]] = piko.get %[[P]] "x"
  // CHECK:          %[[W:.*]] = piko.get %[[P]] "w"
  // CHECK:          piko.emit 0(%[[W]])
  // CHECK:          %[[SOME:.*]] = arith.cmpi sgt, %[[X]]
  // CHECK:          scf.if %[[SOME]] {
  // CHECK:            %[[I:.*]] = arith.index_cast %[[X]]
  // CHECK:            memref.load %{{.*}}[%[[I]]] : memref<3xf32>
  // CHECK:            piko.update of "b" @count[%[[X]] : i32]
  // CHECK:            piko.emit 1(%[[W]])
  // CHECK:          }
  // CHECK-NEXT:     }
  // CHECK-NOT:  piko.stage @b
  // CHECK-NOT:  piko.stage @c
  piko.stage @a bins [8] threads 64 : @F -> [@F, @G] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.schedule direct_map
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %w = piko.get %f "w"[%zero] : !piko.prim<@F> -> f32
      piko.emit 1 (%w) : f32
      piko.emit 0 (%x, %w, %w, %w) : i32, f32, f32, f32
      piko.return
    }
  }
  // expected-remark @below {{stage 'b' runs inside stage 'a'}}
  piko.stage @b bins [8] threads 64 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : i32
      %some = arith.cmpi sgt, %x, %zero : i32
      scf.if %some {
        piko.assign_previous
      }
      piko.return
    }
    piko.schedule direct_map
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %i = arith.index_cast %x : i32 to index
      %w = piko.get %f "w"[%i] : !piko.prim<@F> -> f32
      piko.update @count[%x : i32] {
      ^bb0(%old: f32):
        %new = arith.addf %old, %w : f32
        piko.yield [%new : f32]
      }
      %one = arith.constant 1 : index
      %v = piko.get %f "w"[%one] : !piko.prim<@F> -> f32
      piko.emit 0 (%x, %v, %v, %v) : i32, f32, f32, f32
      piko.return
    }
  }
  // It has no schedule, and runs wherever its primitives are.
  // expected-remark @below {{stage 'c' runs inside stage 'a'}}
  piko.stage @c bins [8] threads 64 : @F -> [@G] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %v = piko.get %f "w"[%zero] : !piko.prim<@F> -> f32
      piko.emit 0 (%v) : f32
      piko.return
    }
  }
  // expected-remark @below {{stage 'end' is not fused with stage 'a'}}
  // expected-note @below {{it is fed from several places}}
  piko.stage @end bins [0] threads 1 : @G -> [] {
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // CHECK: piko.stage @last
  // CHECK: end_stage [@a]
  piko.stage @last bins [0] threads 1 : @G -> [] {
    piko.schedule load_balance end_stage [@b]
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
}

// Reasons to stay apart.
// CHECK-LABEL: piko.pipeline @Apart
piko.pipeline @Apart rank 1 {
  piko.source @a
  piko.edge @a[0] -> @balanced
  piko.edge @a[1] -> @larger
  piko.edge @a[2] -> @unknown
  piko.edge @a[3] -> @waiting
  piko.edge @a[4] -> @looping
  piko.edge @a[5] -> @meeting
  piko.edge @a[6] -> @loose
  piko.edge @a[7] -> @serial
  piko.edge @looping[0] -> @looping
  piko.stage @a bins [8] threads 64 : @G -> [@G, @G, @G, @G, @G, @G, @G, @G] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'balanced' is not fused with stage 'a'}}
  piko.stage @balanced bins [8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_previous
      piko.return
    }
    // expected-note @below {{load_balance lets any core take the bin}}
    piko.schedule load_balance
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'larger' is not fused with stage 'a'}}
  // expected-note @below {{its bins are of another size}}
  piko.stage @larger bins [16] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'unknown' is not fused with stage 'a'}}
  piko.stage @unknown bins [8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      // expected-note @below {{the bin is not known to be the same}}
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'waiting' is not fused with stage 'a'}}
  // expected-note @below {{it waits until no primitive can reach it}}
  piko.stage @waiting bins [8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_previous
      piko.return
    }
    piko.schedule load_balance end_bin
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'looping' is not fused with stage 'a'}}
  // expected-note @below {{stage 'looping' is on a cycle}}
  // expected-remark @below {{stage 'looping' is not fused with stage 'looping'}}
  piko.stage @looping bins [8] threads 64 : @G -> [@G] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'meeting' is not fused with stage 'a'}}
  piko.stage @meeting bins [8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      %n = arith.constant 8 : index
      // expected-note @below {{its iterations meet}}
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.sync
        piko.yield
      }
      piko.return
    }
  }
  // expected-remark @below {{stage 'loose' is not fused with stage 'a'}}
  piko.stage @loose bins [8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_previous
      piko.return
    }
    // expected-note @below {{only one of the stages is unordered}}
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  // expected-remark @below {{stage 'serial' is not fused with stage 'a'}}
  piko.stage @serial bins [8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      piko.assign_previous
      piko.return
    }
    // expected-note @below {{serialize may choose another core than load_balance of stage 'a'}}
    piko.schedule serialize
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
}
