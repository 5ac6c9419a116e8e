// RUN: piko-opt %s | piko-opt | FileCheck %s

piko.record @F {"z" : f32 at 0, "list" : f32[4 : 4] at 4} size 20 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @N {"n" : f32 at 0} size 4 align 4
piko.record @B {"b" : i8 at 0} size 1 align 1
piko.pipeline @P rank 2 {
  piko.buffer @in : @F
  piko.buffer @numbers : @N
  piko.buffer @bytes : @B
  piko.image @depth : @F rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8, 8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  // CHECK-LABEL: piko.kernel @k
  piko.kernel @k {
    %c2 = arith.constant 2 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<16xindex>
    // CHECK: %[[A:.*]] = piko.cpu.gather @in[%{{.*}} : vector<16xindex>] "z" mask %{{.*}} : vector<16xi1>, vector<16xf32>
    %a = piko.cpu.gather @in[%at : vector<16xindex>] "z" mask %mask : vector<16xi1>, vector<16xf32>
    // CHECK: piko.cpu.gather consecutive @depth[%{{.*}}, %{{.*}} : index, index] "list"[%{{.*}}] mask
    %b = piko.cpu.gather consecutive @depth[%c2, %c2 : index, index] "list"[%c2] mask %mask : vector<16xi1>, vector<16xf32>
    // CHECK: piko.cpu.scatter %[[A]], @depth[%{{.*}}, %{{.*}} : vector<16xindex>, index] "z" mask
    piko.cpu.scatter %a, @depth[%at, %c2 : vector<16xindex>, index] "z" mask %mask : vector<16xi1>, vector<16xf32>
    // CHECK: piko.cpu.scatter %{{.*}}, consecutive @depth[%{{.*}}, %{{.*}} : index, index] "z" mask
    piko.cpu.scatter %b, consecutive @depth[%c2, %c2 : index, index] "z" mask %mask : vector<16xi1>, vector<16xf32>
    %words = arith.constant dense<3> : vector<16xi32>
    // CHECK: piko.cpu.gather_run @numbers[%{{.*}}] "n" mask %{{.*}} : vector<16xi32>, vector<16xi1> -> vector<16xf32>, vector<16xf32>
    %run:2 = piko.cpu.gather_run @numbers[%words] "n" mask %mask : vector<16xi32>, vector<16xi1> -> vector<16xf32>, vector<16xf32>
    // CHECK: piko.cpu.gather_run @bytes[%{{.*}}] "b" mask %{{.*}} : vector<16xindex>, vector<16xi1> -> vector<16xi8>
    %byte = piko.cpu.gather_run @bytes[%at] "b" mask %mask : vector<16xindex>, vector<16xi1> -> vector<16xi8>
    // CHECK: %[[OF:.*]] = piko.cpu.elements @depth[%{{.*}}, %{{.*}} : vector<16xindex>, index] : vector<16xindex>
    %of = piko.cpu.elements @depth[%at, %c2 : vector<16xindex>, index] : vector<16xindex>
    // CHECK: piko.cpu.elements consecutive @depth[%{{.*}}, %{{.*}} : index, index] : vector<16xindex>
    %after = piko.cpu.elements consecutive @depth[%c2, %c2 : index, index] : vector<16xindex>
    // CHECK: piko.cpu.set_fields(%[[A]]) to %[[OF]] ["z"] of @depth mask %{{.*}} : vector<16xindex>, vector<16xi1>, vector<16xf32>
    piko.cpu.set_fields(%a) to %of ["z"] of @depth mask %mask : vector<16xindex>, vector<16xi1>, vector<16xf32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      // CHECK: piko.cpu.is_counted %{{.*}}
      %counted = piko.cpu.is_counted %writer
      // CHECK: %[[AS:.*]] = piko.cpu.items %{{.*}}[%{{.*}} : index] mask %{{.*}} : !piko.bins<@F>, vector<16xi1>, vector<16xindex>
      %as = piko.cpu.items %bins[%c2 : index] mask %mask : !piko.bins<@F>, vector<16xi1>, vector<16xindex>
      // CHECK: piko.cpu.items %{{.*}}[%{{.*}} : vector<16xindex>] mask
      %bs = piko.cpu.items %bins[%at : vector<16xindex>] mask %mask : !piko.bins<@F>, vector<16xi1>, vector<16xindex>
      // CHECK: piko.cpu.append %{{.*}}[0] (%[[A]], %{{.*}} : vector<16xf32>, vector<16xi32>) of @G mask %{{.*}} : vector<16xi1>
      %ys = arith.constant dense<2> : vector<16xi32>
      piko.cpu.append %writer[0] (%a, %ys : vector<16xf32>, vector<16xi32>) of @G mask %mask : vector<16xi1>
      // CHECK: piko.cpu.append %{{.*}}[0] (%[[A]], %{{.*}}, %{{.*}}, %{{.*}} : {{.*}}) of @G mask %{{.*}}, %{{.*}} : vector<16xi1>, vector<16xi1> in @b[%{{.*}}, %{{.*}} : vector<16xindex>, vector<16xindex>]
      piko.cpu.append %writer[0] (%a, %ys, %b, %ys : vector<16xf32>, vector<16xi32>, vector<16xf32>, vector<16xi32>) of @G mask %mask, %mask : vector<16xi1>, vector<16xi1> in @b[%at, %at : vector<16xindex>, vector<16xindex>]
      %memory = memref.alloca() : memref<256xi8>
      // CHECK: piko.cpu.store_records %[[MEMORY:.*]](%[[A]], %{{.*}} : vector<16xf32>, vector<16xi32>) of @G : memref<256xi8>
      piko.cpu.store_records %memory (%a, %ys : vector<16xf32>, vector<16xi32>) of @G : memref<256xi8>
      // CHECK: piko.cpu.append_record %{{.*}}[0] from %[[MEMORY]][%{{.*}} of 16] : memref<256xi8> -> !piko.prim<@G>
      %stored = piko.cpu.append_record %writer[0] from %memory[%c2 of 16] : memref<256xi8> -> !piko.prim<@G>
      // CHECK: piko.cpu.get %[[AS]] "list"[%{{.*}}] of @F mask %{{.*}} : vector<16xindex>, vector<16xi1>, vector<16xf32>
      %x = piko.cpu.get %as "list"[%c2] of @F mask %mask : vector<16xindex>, vector<16xi1>, vector<16xf32>
    }
    // CHECK: piko.cpu.permute %[[A]][%{{.*}}] : vector<16xf32>, vector<16xi32>
    %lanes = arith.constant dense<3> : vector<16xi32>
    %p = piko.cpu.permute %a[%lanes] : vector<16xf32>, vector<16xi32>
    // CHECK: piko.cpu.compress %[[A]] mask %{{.*}} : vector<16xf32>, vector<16xi1>
    %some = arith.cmpf olt, %a, %p : vector<16xf32>
    %front = piko.cpu.compress %a mask %some : vector<16xf32>, vector<16xi1>
    %one = arith.constant 1.0 : f32
    %most = arith.constant 64 : i32
    %list = memref.alloca() : memref<64xf32>
    %numbers = memref.alloca() : memref<64xi32>
    %count = memref.alloca() : memref<1xi32>
    // CHECK: piko.storage.push(%{{.*}} : f32) to(%{{.*}} : memref<64xf32>) count %{{.*}} : memref<1xi32>
    piko.storage.push(%one : f32) to(%list : memref<64xf32>) count %count : memref<1xi32>
    // CHECK: piko.storage.push(%{{.*}}, %{{.*}} : f32, i32) to(%{{.*}}, %{{.*}} : memref<64xf32>, memref<64xi32>) count %{{.*}} below %{{.*}} unsigned padded : memref<1xi32>, i32
    piko.storage.push(%one, %most : f32, i32) to(%list, %numbers : memref<64xf32>, memref<64xi32>)
      count %count below %most unsigned padded : memref<1xi32>, i32
    // CHECK: piko.storage.push count %{{.*}} : memref<1xi32>
    piko.storage.push count %count : memref<1xi32>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
