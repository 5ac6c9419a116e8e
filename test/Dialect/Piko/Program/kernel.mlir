// RUN: piko-opt %s | piko-opt | FileCheck %s
// Kernels with phases in them, and kernels that work on the storage of bins.

piko.record @F {"x" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @Kernels
piko.pipeline @Kernels rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8, 8] threads 64 : @F -> [@F] {}
  piko.stage @b bins [8, 8] threads 64 : @F -> [] {}
  // CHECK: piko.kernel @assign_source {
  // CHECK-NEXT: piko.assign of @a source 0 {
  piko.kernel @assign_source {
    piko.assign of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
  }
  // CHECK: piko.kernel @kernel_a {
  // CHECK-NEXT: piko.process of @a {
  // CHECK: piko.assign of @b port 0 {
  piko.kernel @kernel_a {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    piko.assign of @b port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
  }
}

// CHECK-LABEL: piko.pipeline @Resolved
piko.pipeline @Resolved rank 2 {
  piko.buffer @counts : @F
  piko.image @shown : @F rank 2
  // CHECK: piko.image @shown.unit : @F rank 2 internal
  piko.image @shown.unit : @F rank 2 internal
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8, 8] threads 64 : @F -> [@F] {}
  piko.stage @b bins [8, 8] threads 64 tile 4 : @F -> [] {}
  // CHECK: piko.kernel @place_source {
  piko.kernel @place_source {
    // CHECK-NEXT: %[[SOURCE:.*]] = piko.storage.open_bins @a source 0 : !piko.bins<@F>
    // CHECK-NEXT: %[[UNITS:.*]] = piko.storage.unit_count %[[SOURCE]] : !piko.bins<@F>
    // CHECK-NEXT: %[[W:.*]] = piko.cpu.open_writer %[[SOURCE]][%[[UNITS]]] : !piko.bins<@F>
    // CHECK-NEXT: piko.storage.append_bin %[[W]] of @a in %[[UNITS]]
    // CHECK-NEXT: piko.storage.next %[[W]]
    // CHECK-NEXT: piko.cpu.close_writer %[[W]]
    // CHECK-NEXT: piko.storage.close_bins %[[SOURCE]] : !piko.bins<@F>
    %bins = piko.storage.open_bins @a source 0 : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%n] : !piko.bins<@F>
    piko.storage.append_bin %w of @a in %n
    piko.storage.next %w
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  // CHECK: piko.kernel @kernel_a {
  piko.kernel @kernel_a {
    // CHECK-NEXT: %[[BINS:.*]] = piko.storage.open_bins @a : !piko.bins<@F>
    // CHECK-NEXT: %[[UNIT:.*]] = piko.storage.unit_count
    // CHECK-NEXT: %[[FIRST:.*]], %{{.*}} = piko.storage.unit_buckets %[[BINS]][%[[UNIT]]] : !piko.bins<@F>
    // CHECK-NEXT: %[[AT:.*]], %{{.*}} = piko.storage.bucket_range %[[BINS]][%[[UNIT]], %[[FIRST]]] : !piko.bins<@F>
    // CHECK-NEXT: %[[BIN:.*]] = piko.storage.bucket_bin %[[BINS]][%[[FIRST]]] : !piko.bins<@F>
    // CHECK-NEXT: %[[PRIM:.*]] = piko.storage.item %[[BINS]][%[[AT]]] : !piko.bins<@F> -> !piko.prim<@F>
    // CHECK-NEXT: piko.cpu.prefetch_item %[[BINS]][%[[AT]]] : !piko.bins<@F>
    // CHECK-NEXT: %[[X:.*]] = piko.get %[[PRIM]] "x"
    // CHECK-NEXT: %[[W:.*]] = piko.cpu.open_writer
    // CHECK-NEXT: %{{.*}} = piko.storage.append %[[W]][0] (%[[X]]) : i32 -> !piko.prim<@F>
    // CHECK-NEXT: %{{.*}} = piko.cpu.threads
    // CHECK-NEXT: %{{.*}} = piko.grid @b[1]
    // CHECK-NEXT: %[[TILES:.*]] = piko.grid @b[0] tiles
    // CHECK-NEXT: piko.storage.append_bin %[[W]][0] of @b in %[[BIN]]{{$}}
    // CHECK-NEXT: piko.storage.append_bin %[[W]][0] of @b in %[[BIN]] tile %[[TILES]]
    // CHECK-NEXT: %[[COPY:.*]] = piko.cpu.private_copy add @counts "x" of %[[W]]{{$}}
    // CHECK-NEXT: piko.cpu.private_copy and @counts "x" of %[[W]] often
    // CHECK-NEXT: piko.atomic add checked @counts[%[[AT]] : index] "x", %[[X]] in %[[COPY]] : i32
    // CHECK-NEXT: piko.cpu.private_images @shown by [0] ["slt"] last carries [] keeps [array<i64: 0>] unit @shown.unit of %[[W]] often
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    %c0, %c1 = piko.storage.unit_buckets %bins[%u] : !piko.bins<@F>
    %i0, %i1 = piko.storage.bucket_range %bins[%u, %c0] : !piko.bins<@F>
    %b = piko.storage.bucket_bin %bins[%c0] : !piko.bins<@F>
    %p = piko.storage.item %bins[%i0] : !piko.bins<@F> -> !piko.prim<@F>
    piko.cpu.prefetch_item %bins[%i0] : !piko.bins<@F>
    %x = piko.get %p "x" : !piko.prim<@F> -> i32
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    %q = piko.storage.append %w[0] (%x) : i32 -> !piko.prim<@F>
    %threads = piko.cpu.threads
    %rows = piko.grid @b[1]
    %t = piko.grid @b[0] tiles
    piko.storage.append_bin %w[0] of @b in %b
    piko.storage.append_bin %w[0] of @b in %b tile %t
    %c = piko.cpu.private_copy add @counts "x" of %w
    %d = piko.cpu.private_copy and @counts "x" of %w often
    piko.atomic add checked @counts[%i0 : index] "x", %x in %c : i32
    %shared = piko.cpu.private_images @shown by [0] ["slt"] last carries [] keeps [array<i64: 0>] unit @shown.unit of %w often
  }
}

// A stage after a local barrier, and how it works on the storage of one bin.
// CHECK-LABEL: piko.pipeline @Local
piko.pipeline @Local rank 1 {
  piko.source @a
  // CHECK: piko.edge @a[0] -> @b local
  piko.edge @a[0] -> @b local
  piko.stage @a bins [8] threads 64 : @F -> [@F] {}
  piko.stage @b bins [8] threads 64 : list @F -> [] {}
  // CHECK: piko.kernel @phases {
  piko.kernel @phases {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    // CHECK: piko.local_barrier @a[0] -> @b
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.list<@F>):
      piko.return
    }
  }
  // CHECK: piko.kernel @loops {
  piko.kernel @loops {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    // CHECK: %[[V:.*]] = piko.cpu.open_writer %{{.*}}[%{{.*}}] of @b : !piko.bins<@F>
    %v = piko.cpu.open_writer %bins[%u] of @b : !piko.bins<@F>
    // CHECK-NEXT: piko.storage.local_bin @b from %{{.*}}[0] writer %[[V]] {
    // CHECK-NEXT: ^bb0(%[[LOCAL:.*]]: !piko.bins<@F>):
    // CHECK-NEXT: piko.storage.unit_buckets %[[LOCAL]]
    // CHECK-NEXT: piko.storage.next %[[V]]
    piko.storage.local_bin @b from %w[0] writer %v {
    ^bb0(%local: !piko.bins<@F>):
      %c0, %c1 = piko.storage.unit_buckets %local[%u] : !piko.bins<@F>
      piko.storage.next %v
    }
  }
}

// Calls of a list process, scratch memory, emissions that wait, and the kernel
// of a dynamic schedule.
// CHECK-LABEL: piko.pipeline @Lists
piko.pipeline @Lists rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 : list @F -> [] {}
  // CHECK: piko.kernel @schedule_a
  piko.kernel @schedule_a {
    // CHECK-NEXT: %[[N:.*]] = piko.begin_schedule @a
    %n = piko.begin_schedule @a
    %kind = arith.constant 3 : i32
    %size = arith.constant 4 : i64
    %always = arith.constant true
    // CHECK: piko.schedule_bin @a[%[[N]]] kind %{{.*}} tile_split %[[SIZE:.*]] batch %[[SIZE]] every_bin %{{.*}}
    piko.schedule_bin @a[%n] kind %kind tile_split %size batch %size every_bin %always
  }
  // CHECK: piko.kernel @kernel_a
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = piko.storage.unit_count %bins : !piko.bins<@F>
    // CHECK: %[[LO:.*]], %[[HI:.*]] = piko.storage.call_range %[[BINS:.*]][%[[U:.*]]] : !piko.bins<@F>
    // CHECK-NEXT: %{{.*}} = piko.storage.call_bin %[[BINS]][%[[U]]] : !piko.bins<@F>
    // CHECK-NEXT: %{{.*}} = piko.storage.list %[[BINS]][%[[LO]] to %[[HI]]] : !piko.bins<@F> -> !piko.list<@F>
    %lo, %hi = piko.storage.call_range %bins[%u] : !piko.bins<@F>
    %b = piko.storage.call_bin %bins[%u] : !piko.bins<@F>
    %l = piko.storage.list %bins[%lo to %hi] : !piko.bins<@F> -> !piko.list<@F>
    // CHECK-NEXT: %[[P:.*]] = piko.storage.no_item : !piko.prim<@F>
    // CHECK-NEXT: %[[A:.*]] = piko.storage.to_address %[[P]] : !piko.prim<@F>
    // CHECK-NEXT: %{{.*}} = piko.storage.from_address %[[A]] : !piko.prim<@F>
    %p = piko.storage.no_item : !piko.prim<@F>
    %address = piko.storage.to_address %p : !piko.prim<@F>
    %q = piko.storage.from_address %address : !piko.prim<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    // CHECK: %[[MARK:.*]] = piko.cpu.scratch_mark %[[W:.*]]
    // CHECK-NEXT: %{{.*}}, %{{.*}} = piko.cpu.scratch %[[W]][%[[U]]]
    // CHECK-NEXT: piko.cpu.reorder_begin %[[W]][%[[U]]]
    // CHECK-NEXT: piko.cpu.reorder_iteration %[[W]][%[[U]]]
    // CHECK-NEXT: piko.cpu.reorder_end %[[W]]
    // CHECK-NEXT: piko.cpu.scratch_release %[[W]][%[[MARK]]]
    %mark = piko.cpu.scratch_mark %w
    %bytes, %granted = piko.cpu.scratch %w[%u]
    piko.cpu.reorder_begin %w[%u]
    piko.cpu.reorder_iteration %w[%u]
    piko.cpu.reorder_end %w
    piko.cpu.scratch_release %w[%mark]
    // CHECK-NEXT: piko.fail_list @a at %[[LO]] of %[[HI]]
    // CHECK-NEXT: piko.fail_barrier @a iteration %[[U]]
    // CHECK-NEXT: piko.fail_list @a in %[[U]] at %[[LO]] of %[[HI]]
    // CHECK-NEXT: piko.fail_barrier @a in %[[U]] iteration %[[U]]
    piko.fail_list @a at %lo of %hi
    piko.fail_barrier @a iteration %u
    piko.fail_list @a in %u at %lo of %hi
    piko.fail_barrier @a in %u iteration %u
  }
}
