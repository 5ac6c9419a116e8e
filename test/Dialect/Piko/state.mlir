// RUN: piko-opt %s | piko-opt | FileCheck %s
// Every way to read and write state.

piko.record @Sum {"v" : f64 at 0, "n" : i32 at 8} size 16 align 8
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @Light {"color.x" : f32 at 0, "w" : f32[4 : 4] at 4} size 20 align 4
piko.record @Pixel {"z" : f32 at 0, "n" : i32 at 4, "big" : i64 at 8} size 16 align 8

// CHECK-LABEL: piko.pipeline @State
piko.pipeline @State rank 2 {
  piko.constant @sun : @Light
  piko.buffer @lights : @Light
  piko.image @color : @Pixel rank 2
  piko.source @shade
  piko.stage @shade bins [0, 0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // CHECK: %[[N:.*]] = piko.extent @lights[0]
      // CHECK-NEXT: %{{.*}} = piko.extent @color[1]
      %n = piko.extent @lights[0]
      %h = piko.extent @color[1]
      // CHECK-NEXT: %{{.*}} = piko.load @sun "color.x" : f32
      // CHECK-NEXT: %{{.*}} = piko.load @sun "w"[%[[N]]] : f32
      // CHECK-NEXT: %[[RED:.*]] = piko.load @lights[%[[N]] : index] "color.x" : f32
      // CHECK-NEXT: %{{.*}} = piko.load @lights[%[[N]] : index] "w"[%[[N]]] : f32
      // CHECK-NEXT: %[[COUNT:.*]] = piko.load @color[%[[X:.*]], %[[X]] : i32, i32] "n" : i32
      // CHECK-NEXT: piko.prefetch @lights[%[[N]] : index]
      // CHECK-NEXT: piko.prefetch @color[%[[X]], %[[X]] : i32, i32]
      %s = piko.load @sun "color.x" : f32
      %t = piko.load @sun "w"[%n] : f32
      %r = piko.load @lights[%n : index] "color.x" : f32
      %w = piko.load @lights[%n : index] "w"[%n] : f32
      %c = piko.load @color[%x, %x : i32, i32] "n" : i32
      piko.prefetch @lights[%n : index]
      piko.prefetch @color[%x, %x : i32, i32]
      // CHECK-NEXT: piko.store %[[RED]], @lights[%[[X]] : i32] "color.x" : f32
      // CHECK-NEXT: piko.store %[[RED]], checked @lights[%[[N]] : index] "w"[%[[N]]] : f32
      piko.store %r, @lights[%x : i32] "color.x" : f32
      piko.store %r, checked @lights[%n : index] "w"[%n] : f32
      // CHECK-NEXT: piko.atomic add @color[%[[X]], %[[X]] : i32, i32] "n", %[[COUNT]] : i32
      // CHECK-NEXT: piko.atomic min_signed checked @color
      // CHECK-NEXT: piko.atomic max_signed @color
      // CHECK-NEXT: piko.atomic min_unsigned @color
      // CHECK-NEXT: piko.atomic max_unsigned @color
      // CHECK-NEXT: piko.atomic and @color
      // CHECK-NEXT: piko.atomic or @color
      // CHECK-NEXT: piko.atomic xor @color
      piko.atomic add @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic min_signed checked @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic max_signed @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic min_unsigned @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic max_unsigned @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic and @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic or @color[%x, %x : i32, i32] "n", %c : i32
      piko.atomic xor @color[%x, %x : i32, i32] "n", %c : i32
      // CHECK-NEXT: %{{.*}} = piko.update @color[%[[X]], %[[X]] : i32, i32] {
      // CHECK-NEXT: ^bb0(%[[Z:.*]]: f32, %[[OLD:.*]]: i32, %[[BIG:.*]]: i64):
      // CHECK-NEXT: piko.yield[%[[Z]], %[[OLD]], %[[BIG]] : f32, i32, i64] results[%[[OLD]] : i32]
      // CHECK-NEXT: } -> i32
      %before = piko.update @color[%x, %x : i32, i32] {
      ^bb0(%z: f32, %old: i32, %big: i64):
        piko.yield [%z, %old, %big : f32, i32, i64] results [%old : i32]
      } -> i32
      // CHECK-NEXT: piko.update @color[%[[X]], %[[X]] : i32, i32] in %[[N]] {
      piko.update @color[%x, %x : i32, i32] in %n {
      ^bb0(%z: f32, %old: i32, %big: i64):
        piko.yield [%z, %old, %big : f32, i32, i64]
      }
      // CHECK: piko.fail @shade outside @lights(%[[N]])
      piko.fail @shade outside @lights(%n)
      // CHECK-NEXT: piko.fail @shade in %[[N]] outside bin of @color(%[[N]], %[[N]])
      piko.fail @shade in %n outside bin of @color(%n, %n)
      piko.return
    }
  }
}

// Atomics that show their order.
// CHECK-LABEL: piko.pipeline @Unordered
piko.pipeline @Unordered rank 2 {
  piko.buffer @sums : @Sum
  piko.source @s
  piko.stage @s bins [0, 0] threads 1 : @Sum -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@Sum>):
      %zero = arith.constant 0 : index
      %v = piko.get %f "v" : !piko.prim<@Sum> -> f64
      %n = piko.get %f "n" : !piko.prim<@Sum> -> i32
      // CHECK: piko.atomic add_float @sums[%{{.*}} : index] "v", %{{.*}} : f64
      piko.atomic add_float @sums[%zero : index] "v", %v : f64
      // CHECK-NEXT: %{{.*}} = piko.atomic xor @sums[%{{.*}} : index] "n", %{{.*}} : i32 -> i32
      %old = piko.atomic xor @sums[%zero : index] "n", %n : i32 -> i32
      piko.return
    }
  }
}
