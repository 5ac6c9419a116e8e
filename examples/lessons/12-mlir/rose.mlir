// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
piko.record @Dot {"position.x" : f32 at 0, "position.y" : f32 at 4, "hue" : f32 at 8}
  size 12 align 4
piko.record @Colored {"x" : i32 at 0, "y" : i32 at 4, "r" : f32 at 8, "g" : f32 at 12,
                      "b" : f32 at 16}
  size 20 align 4
piko.record @"piko::scene::Color" {"r" : f32 at 0, "g" : f32 at 4, "b" : f32 at 8,
                                   "a" : f32 at 12}
  size 16 align 4

piko.pipeline @Rose rank 2 {
  piko.image @image : @"piko::scene::Color" rank 2 clear [0.1 : f32, 0.1 : f32, 0.1 : f32, 0.0 : f32]
  piko.source @color
  piko.edge @color[0] -> @plot

  piko.stage @color bins [0, 0] threads 64 : @Dot -> [@Colored] {
    piko.process {
    ^bb0(%dot: !piko.prim<@Dot>):
      %px = piko.get %dot "position.x" : !piko.prim<@Dot> -> f32
      %py = piko.get %dot "position.y" : !piko.prim<@Dot> -> f32
      %hue = piko.get %dot "hue" : !piko.prim<@Dot> -> f32
      %one = arith.constant 1.0 : f32
      %half = arith.constant 0.5 : f32
      %x = arith.fptosi %px : f32 to i32
      %y = arith.fptosi %py : f32 to i32
      %rest = arith.subf %one, %hue : f32
      piko.emit 0 (%x, %y, %hue, %half, %rest) : i32, i32, f32, f32, f32
      piko.return
    }
  }

  piko.stage @plot bins [0, 0] threads 64 : @Colored -> [] {
    piko.process {
    ^bb0(%dot: !piko.prim<@Colored>):
      %x = piko.get %dot "x" : !piko.prim<@Colored> -> i32
      %y = piko.get %dot "y" : !piko.prim<@Colored> -> i32
      %r = piko.get %dot "r" : !piko.prim<@Colored> -> f32
      %g = piko.get %dot "g" : !piko.prim<@Colored> -> f32
      %b = piko.get %dot "b" : !piko.prim<@Colored> -> f32
      %one = arith.constant 1.0 : f32
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%r0: f32, %g0: f32, %b0: f32, %a0: f32):
        %r1 = arith.addf %r0, %r : f32
        %g1 = arith.addf %g0, %g : f32
        %b1 = arith.addf %b0, %b : f32
        piko.yield[%r1, %g1, %b1, %one : f32, f32, f32, f32]
      }
      piko.return
    }
  }
}
