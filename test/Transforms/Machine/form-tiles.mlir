// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-tiles))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-tiles{loads=true}))' %s | FileCheck %s --check-prefix=LOADS

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @Color {"r" : f32 at 0, "a" : f32[2 : 4] at 4} size 12 align 4

// One kernel updates both images, and nothing reads them before: its first launch
// clears them, as there is always one strip. The buffer is left to the program.
// CHECK-LABEL: piko.pipeline @Items
// CHECK:         piko.bins of @last
// CHECK-NEXT:    ^bb0(%[[BIN:.*]]: index):
// CHECK-NEXT:      %[[COLOR:.*]] = piko.tile @color clear in %[[BIN]] : !piko.tile<@Color, [8, 4]>
// CHECK-NEXT:      %[[COUNT:.*]] = piko.tile @count clear in %[[BIN]] : !piko.tile<@F, [8, 4]>
// CHECK:           piko.update @count[%{{.*}}, %{{.*}} : i32, i32] in %[[BIN]] tile(%[[COUNT]] : !piko.tile<@F, [8, 4]>)
// CHECK:           piko.update @color[%{{.*}}, %{{.*}} : i32, i32] in %[[BIN]] tile(%[[COLOR]] : !piko.tile<@Color, [8, 4]>)
// CHECK:           piko.write_tile %[[COUNT]] to @count in %[[BIN]] : !piko.tile<@F, [8, 4]>
// CHECK-NEXT:      piko.write_tile %[[COLOR]] to @color in %[[BIN]] : !piko.tile<@Color, [8, 4]>
// CHECK-NEXT:    }
// CHECK:         piko.clear @sums
// CHECK:         piko.launch @kernel_last(%{{.*}}) clears @count, @color : (!piko.bins<@F>) -> ()
piko.pipeline @Items rank 2 {
  piko.image @count : @F rank 2
  piko.image @color : @Color rank 2 clear [0.5 : f32, 1.0 : f32, 2.0 : f32]
  piko.buffer @sums : @F per_source 0
  piko.source @last
  piko.stage @last bins [8, 4] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @count[%x, %x : i32, i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
        piko.update @color[%x, %x : i32, i32] in %bin {
        ^bb0(%r: f32, %a: f32, %b: f32):
          piko.yield [%a, %b, %r : f32, f32, f32]
        }
      }
    }
  }
  piko.program {
    piko.clear @count, @color, @sums
    %source = piko.feed 0 : !piko.edge<@F>
    piko.strips(%source) {
    ^bb0(%strip: !piko.edge<@F>):
      %bins = piko.join @last(concatenate %strip) : (!piko.edge<@F>) -> !piko.bins<@F>
      piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
      piko.leave
    } : (!piko.edge<@F>) -> ()
  }
}

// Work after a local barrier shares the tile with what stands in front, and may
// read and store pixels that are proved to be in the bin; who reads the image
// comes later. A clear of nothing goes.
// CHECK-LABEL: piko.pipeline @Lists
// CHECK:         piko.kernel @kernel_mark
// CHECK:           %[[TILE:.*]] = piko.tile @count clear in
// CHECK:           piko.items of @mark
// CHECK:             piko.update @count{{.*}} tile(%[[TILE]] :
// CHECK:           piko.lists of @sum from @mark[0]
// CHECK:             piko.load checked @count[%{{.*}} : index] "x" tile(%[[TILE]] : !piko.tile<@F, [16]>) {piko.inside} : i32
// CHECK:             piko.store %{{.*}}, checked @count[%{{.*}} : index] "x" tile(%[[TILE]] : !piko.tile<@F, [16]>) {piko.inside} : i32
// CHECK:           piko.write_tile %[[TILE]] to @count
// CHECK:         piko.kernel @kernel_read
// CHECK-NOT:       piko.tile
// CHECK:         piko.program {
// CHECK-NOT:       piko.clear
// CHECK:           piko.launch @kernel_mark(%{{.*}}) clears @count :
piko.pipeline @Lists rank 1 {
  piko.image @count : @F rank 1
  piko.source @mark
  piko.source @read
  piko.edge @mark[0] -> @sum local
  piko.stage @mark bins [16] threads 1 ordered placed : @F -> [@F] {}
  piko.stage @sum bins [16] threads 1 placed : list @F -> [] {}
  piko.stage @read bins [0] threads 1 split : @F -> [] {}
  piko.kernel @kernel_mark {
    piko.bins of @mark {
    ^bb0(%bin: index):
      piko.items of @mark {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @count[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        piko.place %p of @sum in %bin : !piko.prim<@F>
      }
      piko.lists of @sum from @mark[0] {
      ^bb0(%l: !piko.list<@F>):
        %c16 = arith.constant 16 : index
        %at = arith.muli %bin, %c16 : index
        %old = piko.load checked @count[%at : index] "x" {piko.inside} : i32
        %new = arith.addi %old, %old : i32
        piko.store %new, checked @count[%at : index] "x" {piko.inside} : i32
      }
    }
  }
  piko.kernel @kernel_read {
    piko.bins of @read {
    ^bb0(%bin: index):
      piko.items of @read {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %v = piko.load @count[%x : i32] "x" : i32
      }
    }
  }
  piko.program {
    piko.clear @count
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @mark(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_mark(%bins) : (!piko.bins<@F>) -> ()
    %other = piko.feed 1 : !piko.edge<@F>
    %all = piko.join @read(concatenate %other) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_read(%all) : (!piko.bins<@F>) -> ()
  }
}

// What is read before must be cleared before: then a tile is read from the image,
// and only if that is asked for.
// CHECK-LABEL: piko.pipeline @Before
// CHECK-NOT:     piko.tile
// LOADS-LABEL: piko.pipeline @Before
// LOADS:         piko.tile @count in %{{.*}} : !piko.tile<@F, [8]>
// LOADS:         piko.clear @count
// LOADS:         piko.launch @kernel_last(%{{.*}}) : (!piko.bins<@F>) -> ()
piko.pipeline @Before rank 1 {
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [8] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_before {
    %c0 = arith.constant 0 : index
    %v = piko.load checked @count[%c0 : index] "x" : i32
  }
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @count[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.program {
    piko.clear @count
    piko.launch @kernel_before() : () -> ()
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}
