// RUN: piko-opt --piko-form-program --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "v" : f32 at 4} size 8 align 4

// The kernel of a schedule tells the runtime about each bin, and its status is
// whether the runtime agreed.
// CHECK-LABEL: func.func private @P.schedule_a
// CHECK:         %[[BINS:.*]] = llvm.call @pikoir_begin_schedule(%[[P:.*]], %c0_i32)
// CHECK:         llvm.call @pikoir_schedule_bin(%[[P]], %c0_i32, %{{.*}}, %c3_i32, %{{.*}}, %{{.*}}, %{{.*}})
// CHECK:         %[[STATUS:.*]] = llvm.call @pikoir_status(%[[P]])
// CHECK:         return %[[STATUS]]

// A call is an entry of 24 bytes: its bin, and its positions. A primitive is a
// pointer, also one that no branch gives.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         ub.poison : !llvm.ptr
// CHECK:         %[[ZEROS:.*]] = llvm.mlir.addressof @piko.zeros
// CHECK:         %[[INPUT:.*]] = llvm.select
// CHECK:         llvm.getelementptr inbounds %[[INPUT]][56]
// CHECK:         %[[CALLS:.*]] = llvm.load
// CHECK:         llvm.load %[[CALLS]] {{.*}}: !llvm.ptr -> i64
// CHECK:         llvm.getelementptr inbounds %{{.*}}[8]
// CHECK:         llvm.getelementptr inbounds %{{.*}}[16]
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[MARK:.*]] = llvm.call @pikoir_scratch_mark(%[[W]])
// CHECK:         %[[MEMORY:.*]] = llvm.call @pikoir_scratch(%[[W]], %{{.*}})
// CHECK:         llvm.icmp "ne" %[[MEMORY]]
// CHECK:         llvm.insertvalue %[[MEMORY]]
// CHECK:         builtin.unrealized_conversion_cast {{.*}} to memref<?xi8>
// CHECK:         llvm.call @pikoir_reorder_begin(%[[W]], %{{.*}})
// CHECK:         llvm.call @pikoir_reorder_iteration(%[[W]], %{{.*}})
// CHECK:         llvm.call @pikoir_reorder_end(%[[W]])
// CHECK:         llvm.call @pikoir_scratch_release(%[[W]], %[[MARK]])
// A primitive is a pointer, also where it is chosen.
// CHECK:         scf.if %{{.*}} -> (!llvm.ptr)
// CHECK:           scf.yield %[[ZEROS]] : !llvm.ptr
// CHECK:         %[[ADDRESS:.*]] = llvm.ptrtoint
// CHECK:         llvm.inttoptr
// CHECK:         %[[OLD:.*]] = llvm.atomicrmw add {{.*}} monotonic
// CHECK:         llvm.atomicrmw fadd {{.*}} monotonic
// -1: no bin; 18: an index outside.
// CHECK:         llvm.call @pikoir_fail(%{{.*}}, %c0_i32, %{{.*}}, %c-1_i64, %c18_i32, %{{.*}}, %{{.*}})
// CHECK:         llvm.call @pikoir_fail_barrier(%{{.*}}, %c0_i32, %{{.*}}, %{{.*}}, %{{.*}})

// LIST, UNORDERED and COLLECTS; then COLLECTS alone. The stage that collects
// begins a lineage, after those of two sources, and what is merged has keys.
// CHECK-LABEL: func.func @P.setup
// CHECK:         llvm.call @pikoir_declare_stage({{.*}}, %c25_i32, %{{.*}})
// CHECK:         llvm.call @pikoir_declare_schedule(%{{.*}}, %c0_i32, %c4_i64, %c1_i32)
// CHECK:         llvm.call @pikoir_declare_wait(%{{.*}}, %c2_i32, %c0_i32)

// CHECK:         llvm.call @pikoir_declare_root(%{{.*}}, %c0_i32, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_cycle(%{{.*}}, %c0_i32, %{{.*}}, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_join(%{{.*}}, %c0_i32, %c0_i32, %c0_i32, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_keys(%{{.*}}, %c1_i32, %c2_i32)
// CHECK:         llvm.call @pikoir_declare_join(%{{.*}}, %c1_i32, %c0_i32, %c0_i32, %c3_i32)

// Schedules first. In each round what does not collect runs where something has
// come for it, and then the stage whose turn it is.
// CHECK-LABEL: func.func @P.run(%{{.*}}: !llvm.ptr)
// CHECK:         call @P.schedule_a
// CHECK:         ^[[SPREAD:bb[0-9]+]]:
// CHECK:         %[[TAKES:.*]] = llvm.call @pikoir_cycle_takes(%{{.*}}, %c1_i32)
// CHECK:         %[[NONE:.*]] = arith.cmpi eq, %[[TAKES]], %c0_i32
// CHECK:         cf.cond_br %[[NONE]], ^[[TURN:bb[0-9]+]], ^[[B:bb[0-9]+]]
// CHECK:       ^[[B]]:
// CHECK:         call @P.kernel_b
// CHECK:         cf.cond_br %{{.*}}, ^{{.*}}, ^[[TURN]]
// CHECK:       ^[[TURN]]:
// CHECK:         %[[S:.*]] = llvm.call @pikoir_cycle_turn(%{{.*}}, %c0_i32)
// CHECK:         cf.cond_br %{{.*}}, ^[[AFTER:bb[0-9]+]], ^[[CHOOSE:bb[0-9]+]]
// CHECK:       ^[[CHOOSE]]:
// CHECK:         cf.switch %[[S]] : i32, [
// CHECK-NEXT:      default: ^[[AFTER]],
// CHECK-NEXT:      0: ^[[A:bb[0-9]+]]
// CHECK:       ^[[A]]:
// CHECK:         call @P.kernel_a
// CHECK:         cf.cond_br %{{.*}}, ^{{.*}}, ^[[SPREAD]]
// CHECK:       ^[[AFTER]]:
// CHECK:         llvm.call @pikoir_status
// CHECK:         call @P.kernel_c
piko.pipeline @P rank 1 {
  piko.buffer @counts : @F
  piko.source @a
  piko.source @c
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  piko.stage @a bins [8] threads 1 lineage 0 : list @F -> [@F] {
    piko.schedule load_balance batch 4 every_bin unordered
  }
  piko.stage @b bins [0] threads 1 lineage 1 : @F -> [@F] {}
  piko.stage @c bins [0] threads 1 lineage 2 : @F -> [] {
    piko.schedule load_balance end_stage [@a]
  }
  piko.kernel @schedule_a {
    %bins = piko.begin_schedule @a
    %kind = arith.constant 3 : i32
    %size = arith.constant 4 : i64
    %always = arith.constant true
    piko.schedule_bin @a[%bins] kind %kind tile_split %size batch %size every_bin %always
  }
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %u = arith.constant 0 : index
    %b = piko.storage.call_bin %bins[%u] : !piko.bins<@F>
    %lo, %hi = piko.storage.call_range %bins[%u] : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
    %mark = piko.cpu.scratch_mark %w
    %bytes, %granted = piko.cpu.scratch %w[%hi]
    %none = arith.constant 0 : i8
    memref.store %none, %bytes[%u] : memref<?xi8>
    piko.cpu.reorder_begin %w[%hi]
    piko.cpu.reorder_iteration %w[%lo]
    piko.cpu.reorder_end %w
    piko.cpu.scratch_release %w[%mark]
    %p = scf.if %granted -> !piko.prim<@F> {
      %item = piko.storage.item %bins[%b] : !piko.bins<@F> -> !piko.prim<@F>
      scf.yield %item : !piko.prim<@F>
    } else {
      %zeros = piko.storage.no_item : !piko.prim<@F>
      scf.yield %zeros : !piko.prim<@F>
    }
    %unset = ub.poison : !piko.prim<@F>
    %r = scf.index_switch %b -> !piko.prim<@F>
    case 1 {
      scf.yield %p : !piko.prim<@F>
    }
    case 2 {
      %item = piko.storage.item %bins[%u] : !piko.bins<@F> -> !piko.prim<@F>
      scf.yield %item : !piko.prim<@F>
    }
    default {
      scf.yield %unset : !piko.prim<@F>
    }
    %address = piko.storage.to_address %r : !piko.prim<@F>
    %q = piko.storage.from_address %address : !piko.prim<@F>
    %x = piko.get %q "x" : !piko.prim<@F> -> i32
    %v = piko.get %q "v" : !piko.prim<@F> -> f32
    %old = piko.atomic add checked @counts[%u : index] "x", %x : i32 -> i32
    piko.atomic xor checked @counts[%u : index] "x", %old : i32
    piko.atomic add_float checked @counts[%u : index] "v", %v : f32
    piko.fail_list @a at %lo of %hi
    piko.fail_barrier @a in %u iteration %lo
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_b {
    %bins = piko.storage.open_bins @b : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_c {
    %bins = piko.storage.open_bins @c : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
