// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu=lanes=4 %s | FileCheck %s

piko.record @F {"x" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @G {"x" : f32 at 0, "a" : i8 at 4, "b" : i16 at 6, "d" : f64 at 8, "y" : f32 at 16} size 24 align 8

// Room for all lanes' records, and for what the last piece of 16 bytes has beyond
// them; bytes become words, and words pieces, of which lane after lane stores its
// own where the last one's end.
// CHECK-LABEL: func.func private @P.kernel_a
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[BITS:.*]] = arith.extui %{{.*}} : i4 to i64
// CHECK:         scf.if
// CHECK:           arith.extui %{{.*}} : vector<4xi8> to vector<4xi32>
// CHECK:           arith.shli %{{.*}} : vector<4xi32>
// CHECK:           arith.ori %{{.*}} : vector<4xi32>
// CHECK:           vector.shuffle %{{.*}}, %{{.*}} [0, 4, 1, 5]
// CHECK:           %[[ROOM:.*]] = llvm.call @pikoir_reserve_inline(%[[W]], %c0_i32, %c5_i64)
// CHECK:           llvm.store %{{.*}}, %[[ROOM]] {alignment = 4 : i64{{.*}}} : vector<4xi32>, !llvm.ptr
// CHECK:           %[[BEHIND:.*]] = llvm.getelementptr inbounds %[[ROOM]][16]
// CHECK:           llvm.store %{{.*}}, %[[BEHIND]] {alignment = 4 : i64{{.*}}} : vector<4xi32>, !llvm.ptr
// CHECK:           %[[BIT:.*]] = arith.andi %[[BITS]], %c1_i64
// CHECK:           %[[BYTES:.*]] = arith.muli %[[BIT]], %c24_i64
// CHECK:           %[[NEXT:.*]] = llvm.getelementptr inbounds %[[ROOM]][%[[BYTES]]]
// CHECK:           llvm.store %{{.*}}, %[[NEXT]] {alignment = 4 : i64{{.*}}} : vector<4xi32>, !llvm.ptr
//
// A cell outside of the grid, or no room for all, is the runtime's business.
// CHECK:           llvm.call @pikoir_buckets_inline(%[[W]], %c0_i32)
// CHECK:           arith.cmpi uge, %{{.*}} : vector<4xi64>
// CHECK:           llvm.call @pikoir_places_apart_inline(%[[W]], %c0_i32, %c4_i64)
// CHECK:           scf.if
// CHECK:             scf.for
// CHECK:               llvm.call @pikoir_place_apart_inline(%[[W]], %c0_i32
// CHECK:           } else {
// CHECK:             %[[COUNT:.*]] = math.ctpop %[[BITS]]
// CHECK:             %[[PLACE:.*]] = llvm.call @pikoir_place_lanes_inline(%[[W]], %c0_i32, %[[COUNT]])
// CHECK:             arith.ori %{{.*}} : vector<4xi32>
// CHECK:             llvm.store %{{.*}}, %[[PLACE]] {{.*}} : i32, !llvm.ptr
// CHECK-COUNT-3:     llvm.store %{{.*}} : i32, !llvm.ptr
// CHECK:             llvm.call @pikoir_end_buckets_inline(%[[W]], %c0_i32,
piko.pipeline @P rank 1 {
  piko.buffer @out : @G
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@G] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %k = piko.get %f "k" : !piko.prim<@F> -> i32
      %a = arith.trunci %k : i32 to i8
      %b = arith.trunci %k : i32 to i16
      %d = arith.extf %x : f32 to f64
      piko.emit 0 (%x, %a, %b, %d, %x) : f32, i8, i16, f64, f32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : list @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      %a = piko.get %g "a" : !piko.prim<@G> -> i8
      %at = arith.extsi %a : i8 to i32
      %bin = piko.bin_at %at : i32
      piko.assign_to %bin
      piko.return
    }
    piko.schedule load_balance
    piko.process {
    ^bb0(%list: !piko.list<@G>):
      %c0 = arith.constant 0 : index
      %g = piko.list_at %list[%c0] : !piko.list<@G> -> !piko.prim<@G>
      %x = piko.get %g "x" : !piko.prim<@G> -> f32
      %b = piko.get %g "b" : !piko.prim<@G> -> i16
      %d = piko.get %g "d" : !piko.prim<@G> -> f64
      %y = piko.get %g "y" : !piko.prim<@G> -> f32
      piko.store %x, @out[%c0 : index] "x" : f32
      piko.store %b, @out[%c0 : index] "b" : i16
      piko.store %d, @out[%c0 : index] "d" : f64
      piko.store %y, @out[%c0 : index] "y" : f32
      piko.return
    }
  }
}
