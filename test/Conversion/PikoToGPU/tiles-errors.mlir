// RUN: piko-opt %s --piko-to-gpu --verify-diagnostics

piko.record @Pixel {"z" : f32 at 0, "n" : i32[2 : 4] at 4} size 12 align 4
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 2 {
  piko.image @image : @Pixel rank 2 clear [1.0 : f32, 2 : i32, 3 : i32]
  piko.source @a
  piko.stage @a bins [8, 4] threads 1 ordered : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{a kernel for a GPU has no tiles; leave out piko-form-tiles}}
      %t = piko.tile @image clear in %bin : !piko.tile<@Pixel, [8, 4]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %y = piko.get %f "y" : !piko.prim<@F> -> i32
        piko.update @image[%x, %y : i32, i32] in %bin tile(%t : !piko.tile<@Pixel, [8, 4]>) {
        ^bb0(%z: f32, %n: i32, %m: i32):
          %twice = arith.addf %z, %z : f32
          piko.yield [%twice, %n, %m : f32, i32, i32]
        }
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@Pixel, [8, 4]>
    }
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @k(%bins) clears @image : (!piko.bins<@F>) -> ()
  }
}
