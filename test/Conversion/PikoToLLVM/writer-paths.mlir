// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-map-lanes,piko-form-units),piko-to-cpu)' %s | FileCheck %s
// What emissions nearly always do needs no call: members of pikoir_writer and
// pikoir_port are read and written in place (pikort/abi.h).

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open

// Room for a record: cursor, limit, flags; then emitted, and for a port without
// places the cursor after the record.
// CHECK:         %[[PORTS:.*]] = llvm.getelementptr inbounds %[[W]][24]
// CHECK:         %[[PORT:.*]] = llvm.load %[[PORTS]]
// CHECK:         %[[CURSOR:.*]] = llvm.load %[[PORT]] {{.*}}: !llvm.ptr -> !llvm.ptr
// CHECK:         %[[LIMIT_AT:.*]] = llvm.getelementptr inbounds %[[PORT]][8]
// CHECK:         %[[LIMIT:.*]] = llvm.load %[[LIMIT_AT]]
// CHECK:         %[[FULL:.*]] = llvm.icmp "ugt" %[[CURSOR]], %[[LIMIT]]
// CHECK:         llvm.getelementptr inbounds %[[PORT]][116]
// CHECK:         %[[ROOM:.*]] = scf.if
// CHECK:           %[[SLOW:.*]] = llvm.call @pikoir_append(%[[W]], %c0_i32)
// CHECK:           scf.yield %[[SLOW]]
// CHECK:         } else {
// CHECK:           llvm.getelementptr inbounds %[[PORT]][24]
// CHECK:           llvm.getelementptr inbounds %[[PORT]][64]
// CHECK:           scf.if
// CHECK:             %[[LAST:.*]] = llvm.getelementptr inbounds %[[PORT]][56]
// CHECK:             llvm.store %c-1_i64, %[[LAST]]
// CHECK:           } else {
// CHECK:             llvm.getelementptr inbounds %[[PORT]][16]
// CHECK:             llvm.store %{{.*}}, %[[PORT]] {{.*}}: !llvm.ptr
// CHECK:           scf.yield %[[CURSOR]]
// CHECK:         llvm.store %{{.*}}, %[[ROOM]] {{.*}}: i32

// A place: the first one keeps the record and is marked.
// CHECK:         %[[CELLS_AT:.*]] = llvm.getelementptr inbounds %{{.*}}[40]
// CHECK:         %[[ENTRY:.*]] = llvm.load %[[CELLS_AT]]
// CHECK:         scf.if
// CHECK:           llvm.call @pikoir_place(%[[W]], %c0_i32, %[[CELL:[0-9]+]])
// CHECK:         } else {
// CHECK:           %[[FIRST:.*]] = arith.cmpi slt, %{{.*}}, %c0_i64
// CHECK:           scf.if %[[FIRST]] {
// CHECK:             llvm.store %[[ENTRY]], %{{.*}}
// CHECK:           %[[MARK:.*]] = arith.select %[[FIRST]], %c-2147483648_i32, %c0_i32
// CHECK:           %[[LOW:.*]] = arith.trunci %[[CELL]]
// CHECK:           %[[WORD:.*]] = arith.ori %[[LOW]], %[[MARK]]
// CHECK:           llvm.store %[[WORD]], %[[ENTRY]] {{.*}}: i32

// The end of a position: a call where flags ask for it.
// CHECK:         %[[FLAGS_AT:.*]] = llvm.getelementptr inbounds %[[W]][12]
// CHECK:         %[[FLAGS:.*]] = llvm.load %[[FLAGS_AT]] {{.*}}: !llvm.ptr -> i32
// CHECK:         %[[ANY:.*]] = arith.cmpi ne, %[[FLAGS]], %c0_i32
// CHECK:         scf.if %[[ANY]] {
// CHECK-NEXT:      llvm.call @pikoir_next(%[[W]])
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.schedule load_balance lanes one
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// A source's primitive that has a cell needs no call either.
// CHECK-LABEL: func.func private @Q.source_0_b
// CHECK:         %[[S:.*]] = llvm.call @pikoir_open_source
// CHECK:           scf.if
// CHECK:             llvm.call @pikoir_place(%[[S]], %c0_i32,
// CHECK:           } else {
// CHECK:             llvm.store %{{.*}}: i32
// CHECK:           %[[LAST_AT:.*]] = llvm.getelementptr inbounds %{{.*}}[56]
// CHECK-NEXT:      %[[LAST:.*]] = llvm.load %[[LAST_AT]]
// CHECK-NEXT:      %[[NOWHERE:.*]] = arith.cmpi slt, %[[LAST]], %c0_i64
// CHECK-NEXT:      scf.if %[[NOWHERE]] {
// CHECK-NEXT:        llvm.call @pikoir_next(%[[S]])
// CHECK-NEXT:      } else {
// CHECK-NEXT:        llvm.store %c-1_i64, %[[LAST_AT]]
piko.pipeline @Q rank 1 {
  piko.source @b
  piko.stage @b bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// After a local edge nothing is noted: a record that comes to any one cell of
// the consumer needs no call.
// CHECK-LABEL: func.func private @R.kernel_a
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open(
// CHECK:           llvm.store %c-1_i64,
// CHECK:           scf.yield
// CHECK:         %[[LAST_AT:.*]] = llvm.getelementptr inbounds %[[PORT:.*]][56]
// CHECK-NEXT:    %[[LAST:.*]] = llvm.load %[[LAST_AT]]
// CHECK-NEXT:    %[[CELLS_AT:.*]] = llvm.getelementptr inbounds %[[PORT]][64]
// CHECK-NEXT:    %[[CELLS:.*]] = llvm.load %[[CELLS_AT]]
// CHECK-NEXT:    %[[OUTSIDE:.*]] = arith.cmpi uge, %[[CELL:.*]], %[[CELLS]] : i64
// CHECK-NEXT:    %[[AGAIN:.*]] = arith.cmpi ne, %[[LAST]], %c-1_i64
// CHECK-NEXT:    %[[BAD:.*]] = arith.ori %[[OUTSIDE]], %[[AGAIN]]
// CHECK:         %[[SLOW:.*]] = arith.ori %[[BAD]], %{{.*}} : i1
// CHECK-NEXT:    scf.if %[[SLOW]] {
// CHECK-NEXT:      llvm.call @pikoir_place(%[[W]], %c0_i32, %[[CELL]])
// CHECK-NEXT:    } else {
// CHECK-NOT:       llvm.call
// CHECK:           llvm.store %[[CELL]], %[[LAST_AT]]
piko.pipeline @R rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
    piko.schedule direct_map lanes one
  }
  piko.stage @b bins [8] threads 1 : @F -> [] {
    piko.schedule direct_map end_bin
  }
  piko.kernel @kernel_a {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
    piko.assign of @b port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
