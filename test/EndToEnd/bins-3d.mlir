// bins-3d.cpp, written by hand.
// RUN: piko-compare %s --reference %S/bins-3d.cpp --domain 33 18 7 --count 3000 | FileCheck %s
// CHECK: equal

piko.record @Particle {"position.x" : f32 at 0, "position.y" : f32 at 4,
                       "position.z" : f32 at 8, "mass" : f32 at 12} size 16 align 4
piko.record @Voxel {"density" : f32 at 0, "count" : i32 at 4} size 8 align 4

piko.pipeline @Volume rank 3 {
  piko.image @volume : @Voxel rank 3 clear [0.25 : f32, 0 : i32]
  piko.source @splat
  piko.stage @splat bins [8, 8, 4] threads 64 : @Particle -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Particle>):
      %radius = arith.constant 1.5 : f32
      %px = piko.get %p "position.x" : !piko.prim<@Particle> -> f32
      %py = piko.get %p "position.y" : !piko.prim<@Particle> -> f32
      %pz = piko.get %p "position.z" : !piko.prim<@Particle> -> f32
      %x0 = arith.subf %px, %radius : f32
      %y0 = arith.subf %py, %radius : f32
      %z0 = arith.subf %pz, %radius : f32
      %x1 = arith.addf %px, %radius : f32
      %y1 = arith.addf %py, %radius : f32
      %z1 = arith.addf %pz, %radius : f32
      %fx0 = math.floor %x0 : f32
      %fy0 = math.floor %y0 : f32
      %fz0 = math.floor %z0 : f32
      %fx1 = math.floor %x1 : f32
      %fy1 = math.floor %y1 : f32
      %fz1 = math.floor %z1 : f32
      %ix0 = arith.fptosi %fx0 : f32 to i32
      %iy0 = arith.fptosi %fy0 : f32 to i32
      %iz0 = arith.fptosi %fz0 : f32 to i32
      %ix1 = arith.fptosi %fx1 : f32 to i32
      %iy1 = arith.fptosi %fy1 : f32 to i32
      %iz1 = arith.fptosi %fz1 : f32 to i32
      piko.assign_box [%ix0, %iy0, %iz0 : i32, i32, i32] to [%ix1, %iy1, %iz1 : i32, i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Particle>):
      %radius = arith.constant 1.5 : f32
      %fade = arith.constant 0.9 : f32
      %unit = arith.constant 1.0 : f32
      %one = arith.constant 1 : i32
      %step = arith.constant 1 : index
      %px = piko.get %p "position.x" : !piko.prim<@Particle> -> f32
      %py = piko.get %p "position.y" : !piko.prim<@Particle> -> f32
      %pz = piko.get %p "position.z" : !piko.prim<@Particle> -> f32
      %mass = piko.get %p "mass" : !piko.prim<@Particle> -> f32
      %bin = piko.bin
      %lx = piko.bin_lo %bin[0]
      %ly = piko.bin_lo %bin[1]
      %lz = piko.bin_lo %bin[2]
      %hx = piko.bin_hi %bin[0]
      %hy = piko.bin_hi %bin[1]
      %hz = piko.bin_hi %bin[2]
      %sx0 = arith.subf %px, %radius : f32
      %sy0 = arith.subf %py, %radius : f32
      %sz0 = arith.subf %pz, %radius : f32
      %sx1 = arith.addf %px, %radius : f32
      %sy1 = arith.addf %py, %radius : f32
      %sz1 = arith.addf %pz, %radius : f32
      %fx0 = math.floor %sx0 : f32
      %fy0 = math.floor %sy0 : f32
      %fz0 = math.floor %sz0 : f32
      %fx1 = math.floor %sx1 : f32
      %fy1 = math.floor %sy1 : f32
      %fz1 = math.floor %sz1 : f32
      %ix0 = arith.fptosi %fx0 : f32 to i64
      %iy0 = arith.fptosi %fy0 : f32 to i64
      %iz0 = arith.fptosi %fz0 : f32 to i64
      %ix1 = arith.fptosi %fx1 : f32 to i64
      %iy1 = arith.fptosi %fy1 : f32 to i64
      %iz1 = arith.fptosi %fz1 : f32 to i64
      %cx0 = arith.index_cast %ix0 : i64 to index
      %cy0 = arith.index_cast %iy0 : i64 to index
      %cz0 = arith.index_cast %iz0 : i64 to index
      %cx1 = arith.index_cast %ix1 : i64 to index
      %cy1 = arith.index_cast %iy1 : i64 to index
      %cz1 = arith.index_cast %iz1 : i64 to index
      %ex = arith.addi %cx1, %step : index
      %ey = arith.addi %cy1, %step : index
      %ez = arith.addi %cz1, %step : index
      %x0 = arith.maxsi %cx0, %lx : index
      %y0 = arith.maxsi %cy0, %ly : index
      %z0 = arith.maxsi %cz0, %lz : index
      %x1 = arith.minsi %ex, %hx : index
      %y1 = arith.minsi %ey, %hy : index
      %z1 = arith.minsi %ez, %hz : index
      scf.for %z = %z0 to %z1 step %step {
        scf.for %y = %y0 to %y1 step %step {
          scf.for %x = %x0 to %x1 step %step {
            %xi = arith.index_cast %x : index to i32
            %yi = arith.index_cast %y : index to i32
            %zi = arith.index_cast %z : index to i32
            %xf = arith.sitofp %xi : i32 to f32
            %yf = arith.sitofp %yi : i32 to f32
            %zf = arith.sitofp %zi : i32 to f32
            %dx = arith.subf %xf, %px : f32
            %dy = arith.subf %yf, %py : f32
            %dz = arith.subf %zf, %pz : f32
            %xx = arith.mulf %dx, %dx : f32
            %yy = arith.mulf %dy, %dy : f32
            %zz = arith.mulf %dz, %dz : f32
            %xy = arith.addf %xx, %yy : f32
            %square = arith.addf %xy, %zz : f32
            %below = arith.addf %unit, %square : f32
            %weight = arith.divf %unit, %below : f32
            %added = arith.mulf %weight, %mass : f32
            piko.update @volume[%x, %y, %z : index, index, index] {
            ^bb0(%density: f32, %count: i32):
              %faded = arith.mulf %density, %fade : f32
              %new = arith.addf %faded, %added : f32
              %more = arith.addi %count, %one : i32
              piko.yield [%new, %more : f32, i32]
            }
          }
        }
      }
      piko.return
    }
  }
}
