// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// Units of work, their cells, the primitives of a cell; emissions are stored,
// placed by the consumer's assign phase, and come before the lineage boundary.
// CHECK-LABEL: piko.pipeline @P
// CHECK:         piko.stage @a {{.*}} split :
// CHECK:         piko.stage @b {{.*}} placed writes :
// CHECK:         piko.kernel @kernel_a
// CHECK:           %[[BINS:.*]] = piko.storage.open_bins @a : !piko.bins<@F>
// CHECK:           %[[UNITS:.*]] = piko.storage.unit_count %[[BINS]]
// CHECK:           scf.forall (%[[UNIT:.*]]) in (%[[UNITS]])
// CHECK:             %[[W:.*]] = piko.cpu.open_writer %[[BINS]][%[[UNIT]]]
// CHECK:             %[[C0:.*]], %[[C1:.*]] = piko.storage.unit_buckets %[[BINS]][%[[UNIT]]]
// CHECK:             scf.for %[[CELL:.*]] = %[[C0]] to %[[C1]]
// CHECK:               %[[LO:.*]], %[[HI:.*]] = piko.storage.bucket_range %[[BINS]][%[[UNIT]], %[[CELL]]]
// CHECK:               scf.for %[[I:.*]] = %[[LO]] to %[[HI]]
// CHECK:                 %[[P:.*]] = piko.storage.item %[[BINS]][%[[I]]]
// CHECK:                 %[[X:.*]] = piko.get %[[P]] "x"
// CHECK:                 %[[Y:.*]] = piko.get %[[P]] "y"
// CHECK:                 piko.storage.append %[[W]][0] (%[[Y]], %[[X]])
// The bin of cell (y, x): the consumer's assign phase sees what was emitted.
// CHECK:                 %[[YI:.*]] = arith.index_cast %[[Y]]
// CHECK:                 arith.cmpi ult, %[[YI]]
// CHECK:                 arith.divui %[[YI]], %c8
// CHECK:                 piko.storage.append_bin %[[W]][0] of @b in
// CHECK:                 piko.storage.next %[[W]]
// CHECK:               } {piko.lanes}
// CHECK:             piko.cpu.close_writer %[[W]]
// CHECK:           {piko.units = #piko<units shared>}
// CHECK:           piko.storage.close_bins %[[BINS]]
// CHECK:         piko.kernel @kernel_b
// CHECK:           %[[BIN:.*]] = piko.storage.bucket_bin
// CHECK:           piko.update @image{{.*}} in %[[BIN]]
piko.pipeline @P rank 2 {
  piko.image @image : @F rank 2
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @b bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %x, %y : i32, i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      piko.return
    }
  }
}

// A box becomes loops over the grid, x innermost, so that bins come ascending.
// CHECK-LABEL: piko.pipeline @Box
// CHECK:         piko.kernel @source_0_a
// CHECK:           piko.storage.item
// CHECK:           scf.for %[[BY:.*]] =
// CHECK:             scf.for %[[BX:.*]] =
// CHECK:               arith.addi {{.*}}%[[BX]]
// CHECK:               piko.storage.append_bin %{{.*}} of @a in
piko.pipeline @Box rank 2 {
  piko.source @a
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.assign_box [%x, %x : i32, i32] to [%y, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// A process phase that takes a list runs once for each call of a unit. What is
// said about a bin last counts: a kernel before all others says it.
// CHECK-LABEL: piko.pipeline @Lists
// CHECK:         piko.stage @a {{.*}} split placed : list
// CHECK-NEXT:      piko.schedule load_balance batch 4{{$}}
// CHECK:         piko.stage @b {{.*}} ordered placed writes : list
// CHECK:         piko.kernel @schedule_a
// CHECK-DAG:       %[[FOUR:.*]] = arith.constant 4 : i64
// CHECK-DAG:       %[[NINE:.*]] = arith.constant 9 : i64
// CHECK-DAG:       %[[YES:.*]] = arith.constant true
// CHECK-DAG:       %[[NO:.*]] = arith.constant false
// CHECK:           %[[BINS:.*]] = piko.begin_schedule @a
// CHECK:           scf.for %[[BIN:.*]] = %c0 to %[[BINS]]
// CHECK:             memref.store %[[FOUR]], %[[BATCH:.*]][] : memref<i64>
// CHECK:             memref.store %[[NO]], %[[EVERY:.*]][] : memref<i1>
// CHECK:             %[[LO:.*]] = arith.muli %{{.*}}, %c8
// CHECK:             scf.if
// CHECK-NEXT:          memref.store %[[NINE]], %[[BATCH]][]
// CHECK-NEXT:          memref.store %[[YES]], %[[EVERY]][]
// CHECK:             %[[N:.*]] = memref.load %[[BATCH]][]
// CHECK:             %[[ALWAYS:.*]] = memref.load %[[EVERY]][]
// CHECK:             piko.schedule_bin @a[%[[BIN]]] kind %{{.*}} tile_split %{{.*}} batch %[[N]] every_bin %[[ALWAYS]]
// CHECK:         piko.kernel @source_0_a
// CHECK:         piko.kernel @kernel_a
// CHECK:           %[[B:.*]] = piko.storage.open_bins @a
// CHECK:           scf.forall (%[[UNIT:.*]]) in
// CHECK:             %[[C0:.*]], %[[C1:.*]] = piko.storage.unit_buckets %[[B]][%[[UNIT]]]
// CHECK:             scf.for %[[CALL:.*]] = %[[C0]] to %[[C1]]
// CHECK:               %[[I0:.*]], %[[I1:.*]] = piko.storage.call_range %[[B]][%[[CALL]]]
// CHECK:               %[[L:.*]] = piko.storage.list %[[B]][%[[I0]] to %[[I1]]]
// CHECK:               piko.list_size %[[L]]
// CHECK:               piko.parallel_for
// CHECK:                 piko.storage.append
// CHECK:               piko.storage.next
// CHECK:             piko.cpu.close_writer
piko.pipeline @Lists rank 2 {
  piko.image @image : @F rank 2
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8, 8] threads 1 : list @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule load_balance batch 4 dynamic {
    ^bb0(%bin: index):
      %zero = arith.constant 0 : index
      %nine = arith.constant 9 : i64
      %lo = piko.bin_lo %bin[0]
      %left = arith.cmpi eq, %lo, %zero : index
      scf.if %left {
        piko.set_batch %nine
        piko.set_every_bin
      }
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %n = piko.list_size %l : !piko.list<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %i32 = arith.index_cast %i : index to i32
        piko.emit 0 (%i32, %i32) : i32, i32
        piko.yield
      }
      piko.return
    }
  }
  piko.stage @b bins [8, 8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      piko.update @image[%zero, %zero : index, index] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      piko.return
    }
  }
}

// A bin of @a is followed by @b, on what port 0 has kept of it, and by @c on
// what @b has emitted; each has a writer of its own. A bin of @a ends with the
// last of its calls. One thread runs a bin.
// CHECK-LABEL: piko.pipeline @Local
// CHECK:         piko.edge @a[0] -> @b local
// CHECK:         piko.edge @b[0] -> @c local
// CHECK-NOT:     split
// CHECK:         piko.kernel @kernel_a
// CHECK:           %[[BINS:.*]] = piko.storage.open_bins @a : !piko.bins<@F>
// CHECK:           scf.forall (%[[UNIT:.*]]) in
// CHECK:             %[[W:.*]] = piko.cpu.open_writer %[[BINS]][%[[UNIT]]] : !piko.bins<@F>
// CHECK-DAG:         %[[V:.*]] = piko.cpu.open_writer %[[BINS]][%[[UNIT]]] of @b
// CHECK-DAG:         %[[U:.*]] = piko.cpu.open_writer %[[BINS]][%[[UNIT]]] of @c
// CHECK:             %[[C0:.*]], %[[C1:.*]] = piko.storage.unit_buckets %[[BINS]]
// CHECK:             scf.for %[[CALL:.*]] = %[[C0]] to %[[C1]]
// CHECK:               %[[BIN:.*]] = piko.storage.call_bin %[[BINS]][%[[CALL]]]
// CHECK:               piko.storage.append %[[W]][0]
// CHECK:               piko.storage.append_bin %[[W]][0] of @b in %[[BIN]]
// CHECK:               piko.storage.next %[[W]]
// CHECK:               %[[NEXT:.*]] = piko.storage.call_bin
// CHECK:               %[[OTHER:.*]] = arith.cmpi ne, %[[NEXT]], %[[BIN]]
// CHECK:               %[[ENDS:.*]] = arith.ori %{{.*}}, %[[OTHER]]
// CHECK:               scf.if %[[ENDS]] {
// CHECK:                 piko.storage.local_bin @b from %[[W]][0] writer %[[V]] {
// CHECK-NEXT:            ^bb0(%[[LIST:.*]]: !piko.bins<@F>):
// CHECK:                   piko.storage.unit_buckets %[[LIST]][%c0]
// CHECK:                   piko.storage.call_range %[[LIST]]
// CHECK:                   piko.storage.append %[[V]][0]
// CHECK:                   piko.storage.append_bin %[[V]][0] of @c in %[[BIN]]
// CHECK:                   piko.storage.next %[[V]]
// CHECK:                 piko.storage.local_bin @c from %[[V]][0] writer %[[U]] {
// CHECK-NEXT:            ^bb0(%[[ITEMS:.*]]: !piko.bins<@F>):
// CHECK:                   piko.storage.bucket_range %[[ITEMS]][%c0, %c0]
// CHECK:                   piko.storage.item %[[ITEMS]]
// CHECK:                   piko.update @image{{.*}} in %[[BIN]]
// CHECK:                   piko.storage.next %[[U]]
// CHECK-DAG:         piko.cpu.close_writer %[[U]]
// CHECK-DAG:         piko.cpu.close_writer %[[V]]
// CHECK-DAG:         piko.cpu.close_writer %[[W]]
piko.pipeline @Local rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.stage @a bins [8] threads 1 : list @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [@F] {}
  piko.stage @c bins [8] threads 1 : @F -> [] {
    piko.schedule load_balance end_bin
  }
  piko.kernel @kernel_a {
    piko.process of @a {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : i32
      piko.emit 0 (%zero, %zero) : i32, i32
      piko.return
    }
    piko.assign of @b port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %f = piko.list_at %l[%zero] : !piko.list<@F> -> !piko.prim<@F>
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x, %x) : i32, i32
      piko.return
    }
    piko.assign of @c port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.local_barrier @b[0] -> @c
    piko.process of @c {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%x, %x : i32, i32]
      }
      piko.return
    }
  }
}
