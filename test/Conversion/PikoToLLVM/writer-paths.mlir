// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-map-lanes,piko-form-units),piko-to-cpu)' %s -o %t.mlir
// RUN: FileCheck %s --input-file=%t.mlir
// RUN: piko-opt --piko-cpu-to-llvm %t.mlir | piko-translate --mlir-to-llvmir | FileCheck %s --check-prefix=IR
// What emissions nearly always do is C++ (pikort/emission.h), which is linked as
// bitcode and inlined where LLVM IR is made: members of pikoir_writer and pikoir_port
// are read and written in place, with tags of the writer's, and what is rare is called.

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[ROOM:.*]] = llvm.call @pikoir_append_inline(%[[W]], %c0_i32)
// CHECK:         llvm.store %{{.*}}, %[[ROOM]] {{.*}}: i32
// CHECK:         llvm.call @pikoir_place_inline(%[[W]], %c0_i32, %{{[0-9]+}})
// CHECK:         llvm.call @pikoir_next_inline(%[[W]])

// Nothing of it is left to call.
// IR-NOT:     _inline
// Room for a record: cursor and limit of the port, then its flags.
// IR-LABEL:   define {{.*}}@P.kernel_a
// IR:           %[[PORTS_AT:.*]] = getelementptr {{.*}}, i64 24
// IR:           %[[PORTS:.*]] = load ptr, ptr %[[PORTS_AT]], align 8, !tbaa ![[WRITER:[0-9]+]]
// IR:           %[[CURSOR:.*]] = load ptr, {{.*}}!tbaa ![[WRITER]]
// IR:           %[[LIMIT:.*]] = load ptr, {{.*}}!tbaa ![[WRITER]]
// IR:           %[[FULL:.*]] = icmp ugt ptr %[[CURSOR]], %[[LIMIT]]
// IR:           getelementptr {{.*}}, i64 116
// IR:           call ptr @pikoir_append({{.*}}, !tbaa ![[RUNTIME:[0-9]+]]
// IR:           getelementptr {{.*}}, i64 24
// IR:           store i64 -1, {{.*}}!tbaa ![[WRITER]]
// The first place keeps the record, and is marked.
// IR:           call void @pikoir_place({{.*}}, !tbaa ![[RUNTIME]]
// IR:           or i32 %{{.*}}, -2147483648
// The end of a position: a call where flags ask for it.
// IR:           %[[FLAGS:.*]] = load i32, {{.*}}!tbaa ![[WRITER]]
// IR:           icmp eq i32 %[[FLAGS]], 0
// IR:           call void @pikoir_next({{.*}}, !tbaa ![[RUNTIME]]
// IR:         declare ptr @pikoir_append({{.*}}) {{.*}}#[[COLD:[0-9]+]]
// IR:         attributes #[[COLD]] = { cold
// IR-NOT:     target-cpu
// IR-DAG:     ![[WRITER]] = !{![[WRITER_TYPE:[0-9]+]], ![[WRITER_TYPE]], i64 0}
// IR-DAG:     ![[WRITER_TYPE]] = !{!"writer", ![[RUNTIME_TYPE:[0-9]+]], i64 0}
// IR-DAG:     ![[RUNTIME_TYPE]] = !{!"runtime",
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

// CHECK-LABEL: func.func private @Q.source_0_b
// CHECK:         %[[S:.*]] = llvm.call @pikoir_open_source
// CHECK:         llvm.call @pikoir_place_inline(%[[S]], %c0_i32,
// CHECK:         llvm.call @pikoir_next_source_inline(%[[S]])
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
// CHECK:         llvm.call @pikoir_place_local_inline(%[[W]], %c0_i32, %{{[0-9]+}})
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
