// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32}))' --split-input-file | FileCheck %s --check-prefix=MAPPED
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32},piko-to-grids),canonicalize,cse)' --split-input-file | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32 by-count=false}))' --split-input-file | FileCheck %s --check-prefix=PLAIN
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32},piko-form-grids,piko-share-loops))' --split-input-file | FileCheck %s --check-prefix=LOOPS
// PLAIN-NOT: by_count
// PLAIN:     piko.items of @a lanes iterations attributes {piko.threads = #piko<threads one>} {
// PLAIN-NOT: by_count
// Where a bin has many primitives, threads have some each; where it has few, threads
// share the iterations of one after the other.

piko.record @F {"x" : i32 at 0} size 4 align 4
// MAPPED-LABEL: piko.pipeline @Emits
// MAPPED:         piko.items of @a lanes iterations attributes {piko.fewest = 5 : i64, piko.threads = #piko<threads by_count>} {
// MAPPED:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads shared>} {
// LOOPS-LABEL: piko.pipeline @Emits
// LOOPS:         scf.if
// LOOPS:           scf.for
// LOOPS:             scf.for
// LOOPS-NOT:           piko.shared
// LOOPS:             piko.storage.append
// LOOPS:             }
// LOOPS:           } {{.*}}piko.shared
// LOOPS:         } else {
// LOOPS:           scf.for
// LOOPS:             scf.for
// LOOPS:             } {piko.shared}
// LOOPS:           } {{.*}}piko.ordered
// CHECK-LABEL: piko.pipeline @Emits
// CHECK:         gpu.launch
// CHECK-SAME:      threads(%[[T:[a-z0-9]+]],
// CHECK:           %[[BEGIN:.*]], %[[END:.*]] = piko.storage.bucket_range
// CHECK:           %[[COUNT:.*]] = arith.subi %[[END]], %[[BEGIN]]
// CHECK:           %[[MANY:.*]] = arith.cmpi sge, %[[COUNT]], %c5
// CHECK:           scf.if %[[MANY]] {
// CHECK:             scf.for %[[ROUND:.*]] = %[[BEGIN]] to %[[END]] step %c32 {
// CHECK:               arith.addi %[[ROUND]], %[[T]]
// CHECK:               scf.for %{{.*}} = %c0 to %{{.*}} step %c1 {
// CHECK:                 piko.storage.append
// CHECK:               piko.gpu.flush
// CHECK:           } else {
// CHECK:             scf.for %{{.*}} = %[[BEGIN]] to %[[END]] step %c1 {
// CHECK:               scf.for %[[ROUND:.*]] = %c0 to %{{.*}} step %c32 {
// CHECK:                 arith.addi %[[ROUND]], %[[T]]
// CHECK:                 piko.storage.append
// CHECK:                 piko.gpu.flush
piko.pipeline @Emits rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 64 : @F -> [@F] {}
  piko.stage @b bins [8] threads 64 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a lanes iterations {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %n = arith.index_cast %x : i32 to index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %at = arith.index_cast %i : index to i32
          %sum = arith.addi %at, %x : i32
          piko.emit 0 (%sum) : i32
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// Updates of pixels, which other primitives may have, too, keep primitives in order.
// MAPPED-LABEL: piko.pipeline @Updates
// MAPPED:         piko.items of @a lanes iterations attributes {piko.threads = #piko<threads one>} {
// CHECK-LABEL: piko.pipeline @Updates
// CHECK-NOT:     arith.cmpi sge
piko.pipeline @Updates rank 1 {
  piko.image @image : @Pixel rank 1
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 64 : @F -> [@F] {}
  piko.stage @b bins [8] threads 64 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a lanes iterations {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %n = arith.index_cast %x : i32 to index
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.update @image[%i : index] in %bin {
          ^bb0(%old: i32):
            piko.yield [%x : i32]
          }
          piko.emit 0 (%x) : i32
          piko.yield
        }
      }
    }
  }
}
