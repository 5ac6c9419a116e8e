// RUN: piko-opt %s | piko-opt | FileCheck %s
// Lists, iterations, and where iterations meet.

piko.record @F {"z" : f32 at 0, "id" : i32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @Loops
piko.pipeline @Loops rank 1 {
  piko.source @s
  // CHECK: piko.stage @s bins [8] threads 64 : list @F -> []
  piko.stage @s bins [8] threads 64 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    // CHECK: piko.process {
    // CHECK-NEXT: ^bb0(%[[L:.*]]: !piko.list<@F>):
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      // CHECK-NEXT: %[[N:.*]] = piko.list_size %[[L]] : !piko.list<@F>
      %n = piko.list_size %l : !piko.list<@F>
      // CHECK-NEXT: piko.parallel_for %[[N]] {
      // CHECK-NEXT: ^bb0(%[[I:.*]]: index):
      piko.parallel_for %n {
      ^bb0(%i: index):
        // CHECK-NEXT: %[[P:.*]] = piko.list_at %[[L]][%[[I]]] : !piko.list<@F> -> !piko.prim<@F>
        %p = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
        // CHECK-NEXT: %{{.*}} = piko.list_at checked %[[L]][%[[I]]] : !piko.list<@F> -> !piko.prim<@F>
        %q = piko.list_at checked %l[%i] : !piko.list<@F> -> !piko.prim<@F>
        // CHECK-NEXT: %[[Z:.*]] = piko.get %[[P]] "z"
        // CHECK-NEXT: %[[ID:.*]] = piko.get %[[P]] "id"
        %z = piko.get %p "z" : !piko.prim<@F> -> f32
        %id = piko.get %p "id" : !piko.prim<@F> -> i32
        // CHECK-NEXT: piko.sync
        piko.sync
        // CHECK-NEXT: %[[R:.*]]:2 = piko.reduce %[[Z]], %[[ID]] : f32, i32 {
        // CHECK-NEXT: ^bb0(%[[A:.*]]: f32, %[[B:.*]]: i32, %[[C:.*]]: f32, %[[D:.*]]: i32):
        // CHECK-NEXT: piko.yield results[%[[C]], %[[B]] : f32, i32]
        %r:2 = piko.reduce %z, %id : f32, i32 {
        ^bb0(%a: f32, %b: i32, %c: f32, %d: i32):
          piko.yield results [%c, %b : f32, i32]
        }
        // CHECK: %{{.*}} = piko.scan %[[ID]] empty %[[R]]#1 : i32 {
        %s = piko.scan %id empty %r#1 : i32 {
        ^bb0(%a: i32, %b: i32):
          %c = arith.addi %a, %b : i32
          piko.yield results [%c : i32]
        }
        // CHECK: %{{.*}} = piko.sort %[[Z]] : f32
        // CHECK-NEXT: %[[AT:.*]] = piko.sort unsigned %[[ID]] : i32
        // CHECK-NEXT: arith.cmpi
        %t = piko.sort %z : f32
        %u = piko.sort unsigned %id : i32
        // CHECK-NEXT: %{{.*}} = piko.grouped where %[[IS:.*]] by %[[ID]] : i32 with %[[Z]] : f32 {
        // CHECK-NEXT: ^bb0(%{{.*}}: i32, %[[V:.*]]: f32):
        // CHECK-NEXT: piko.yield results[%[[V]] : f32]
        // CHECK-NEXT: } -> f32
        %is = arith.cmpi slt, %id, %r#1 : i32
        %g = piko.grouped where %is by %id : i32 with %z : f32 {
        ^bb0(%key: i32, %value: f32):
          piko.yield results [%value : f32]
        } -> f32
        // CHECK-NEXT: piko.grouped where %[[IS]] by %[[ID]] : i32 {
        piko.grouped where %is by %id : i32 {
        ^bb0(%key: i32):
          piko.yield
        }
        // CHECK: piko.parallel_for %[[AT]] {
        piko.parallel_for %u {
        ^bb0(%j: index):
          piko.yield
        }
        piko.yield
      }
      piko.return
    }
  }
}

// Loops stay as they are in kernels, until the CPU's passes split them.
// CHECK-LABEL: piko.pipeline @Kernels
piko.pipeline @Kernels rank 1 {
  // CHECK: piko.parallel_for
  // CHECK: piko.sync
  piko.kernel @k {
    %n = arith.constant 8 : index
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.sync
      piko.yield
    }
  }
}

// A box of pixels, whose iterations may meet, and one without cells.
piko.record @D {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Pixels rank 2 {
piko.pipeline @Pixels rank 2 {
  piko.image @depth : @D rank 2 clear [1.0 : f32]
  piko.source @s
  piko.stage @s bins [8, 8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // CHECK: %[[LO:.*]] = arith.constant 2 : i32
      // CHECK: %[[HI:.*]] = arith.constant 5 : i32
      %lo = arith.constant 2 : i32
      %hi = arith.constant 5 : i32
      // CHECK: piko.parallel_pixels(%[[LO]], %[[LO]]) to(%[[HI]], %[[LO]]) {
      // CHECK-NEXT: ^bb0(%[[X:.*]]: i32, %[[Y:.*]]: i32):
      // CHECK-NEXT: piko.load @depth[%[[X]], %[[Y]] : i32, i32] "z" : f32
      // CHECK-NEXT: piko.sync
      piko.parallel_pixels (%lo, %lo) to (%hi, %lo) {
      ^bb0(%x: i32, %y: i32):
        %z = piko.load @depth[%x, %y : i32, i32] "z" : f32
        piko.sync
        piko.yield
      }
      piko.return
    }
  }
}
