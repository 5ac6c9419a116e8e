// RUN: piko-opt %s | piko-opt | FileCheck %s

piko.record @F {"z" : f32 at 0, "list" : f32[4 : 4] at 4} size 20 align 4
piko.pipeline @P rank 2 {
  piko.buffer @in : @F
  piko.image @depth : @F rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
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
      // CHECK: piko.cpu.get %[[AS]] "list"[%{{.*}}] of @F mask %{{.*}} : vector<16xindex>, vector<16xi1>, vector<16xf32>
      %x = piko.cpu.get %as "list"[%c2] of @F mask %mask : vector<16xindex>, vector<16xi1>, vector<16xf32>
    }
    // CHECK: piko.cpu.permute %[[A]][%{{.*}}] : vector<16xf32>, vector<16xi32>
    %lanes = arith.constant dense<3> : vector<16xi32>
    %p = piko.cpu.permute %a[%lanes] : vector<16xf32>, vector<16xi32>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
