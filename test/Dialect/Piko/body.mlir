// RUN: piko-opt %s | piko-opt | FileCheck %s
// What phases do with primitives and bins.

piko.record @F {"x" : i32 at 0, "y" : i32 at 4, "w" : f32[4 : 4] at 8} size 24 align 4
piko.record @G {"v" : f32[2 : 4] at 0, "i" : i32 at 8} size 12 align 4
piko.record @Nothing {} size 1 align 1

// CHECK-LABEL: piko.pipeline @Bodies
piko.pipeline @Bodies rank 2 {
  piko.source @start
  piko.edge @start[0] -> @same
  piko.edge @start[1] -> @end
  // CHECK: piko.stage @start
  piko.stage @start bins [8, 8] threads 64 : @F -> [@G, @Nothing] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      // CHECK: %[[X:.*]] = piko.get %[[F:.*]] "x" : !piko.prim<@F> -> i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      // CHECK: %[[BIN:.*]] = piko.bin_at %[[X]], %[[Y:.*]] : i32, i32
      %b = piko.bin_at %x, %y : i32, i32
      // CHECK: piko.assign_to %[[BIN]]
      piko.assign_to %b
      // CHECK: piko.assign_box[%[[X]], %[[Y]] : i32, i32] to[%[[X]], %[[Y]] : i32, i32]
      piko.assign_box [%x, %y : i32, i32] to [%x, %y : i32, i32]
      // CHECK: piko.assign_line[%[[X]], %[[Y]] : i32, i32] to[%[[Y]], %[[X]] : i32, i32]
      piko.assign_line [%x, %y : i32, i32] to [%y, %x : i32, i32]
      // CHECK: piko.owner[%[[X]], %[[Y]] : i32, i32]
      piko.owner [%x, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // CHECK: %[[B:.*]] = piko.bin
      // CHECK-NEXT: %[[LO:.*]] = piko.bin_lo %[[B]][0]
      // CHECK-NEXT: %{{.*}} = piko.bin_hi %[[B]][1]
      // CHECK-NEXT: %{{.*}} = piko.domain[1]
      %b = piko.bin
      %lo = piko.bin_lo %b[0]
      %hi = piko.bin_hi %b[1]
      %h = piko.domain[1]
      // CHECK-NEXT: %[[W:.*]] = piko.get %{{.*}} "w"[%[[LO]]] : !piko.prim<@F> -> f32
      %w = piko.get %f "w"[%lo] : !piko.prim<@F> -> f32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // CHECK: piko.emit 0(%[[W]], %[[W]], %{{.*}}) : f32, f32, i32
      piko.emit 0 (%w, %w, %x) : f32, f32, i32
      // CHECK-NEXT: piko.emit 1{{$}}
      piko.emit 1
      piko.return
    }
  }
  // CHECK: piko.stage @same
  piko.stage @same bins [8, 8] threads 64 : @G -> [] {
    piko.assign {
    ^bb0(%g: !piko.prim<@G>):
      // CHECK: piko.assign_previous
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  piko.stage @end bins [0, 0] threads 64 : @Nothing -> [] {
    piko.process {
    ^bb0(%g: !piko.prim<@Nothing>):
      piko.return
    }
  }
}
