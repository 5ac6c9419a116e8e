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
  }
}
