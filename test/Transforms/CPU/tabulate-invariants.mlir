// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-tabulate-invariants),canonicalize,cse)' %s | FileCheck %s

piko.record @Light {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4
piko.record @Color {"v" : f32 at 0} size 4 align 4

piko.pipeline @Lights rank 2 {
  piko.buffer @lights : @Light
  piko.buffer @changed : @Light
  piko.image @color : @Color rank 2
  piko.source @a

  // The root is the same for all pixels. Only the last one of what follows from a
  // light alone has a table, which is filled once for all loops, as far as the
  // lights go; with more lights each iteration computes it.
  // CHECK-LABEL: piko.kernel @k
  // CHECK:         scf.forall
  // CHECK:           %[[N:.*]] = piko.extent @lights[0]
  // CHECK:           %[[MANY:.*]] = arith.cmpi sge, %[[N]], %c32
  // CHECK:           %[[SHORT:.*]] = arith.cmpi sle, %[[N]], %c1024
  // CHECK:           %[[BOTH:.*]] = arith.andi %[[MANY]], %[[SHORT]]
  // CHECK:           %[[FITS:.*]] = arith.andi %[[BOTH]], %
  // CHECK:           %[[COUNT:.*]] = arith.select %[[FITS]], %[[N]], %c0
  // CHECK:           %[[TABLE:.*]] = memref.alloca() : memref<1024xf32>
  // CHECK-NEXT:      scf.for %[[J:.*]] = %c0 to %[[COUNT]] step %c1 {
  // CHECK:             %[[X:.*]] = piko.load checked @lights[%[[J]] : index] "x"
  // CHECK:             %[[ROOT:.*]] = math.sqrt %[[X]]
  // CHECK:             %[[TWICE:.*]] = arith.addf %[[ROOT]], %[[ROOT]]
  // CHECK:             memref.store %[[TWICE]], %[[TABLE]][%[[J]]]
  // CHECK-NOT:       memref.alloca
  // CHECK:           scf.for
  // CHECK:             scf.for
  // CHECK:               scf.for %[[I:.*]] = %c0 to %[[N]] step %c1
  // CHECK:                 scf.if %[[FITS]] -> (f32) {
  // CHECK-NEXT:              memref.load %[[TABLE]][%[[I]]]
  // CHECK:                 } else {
  // CHECK:                   arith.addf
  // CHECK:                 }
  piko.stage @a bins [0, 0] threads 64 : @Color -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Color>
    %units = piko.storage.unit_count %bins : !piko.bins<@Color>
    %w = piko.domain[0]
    %h = piko.domain[1]
    scf.forall (%u) in (%units) {
      scf.for %y = %c0 to %h step %c1 {
        scf.for %x = %c0 to %w step %c1 {
          %n = piko.extent @lights[0]
          %old = piko.load checked @color[%x, %y : index, index] "v" : f32
          %sum = scf.for %i = %c0 to %n step %c1 iter_args(%before = %zero) -> f32 {
            %lx = piko.load checked @lights[%i : index] "x" : f32
            %root = math.sqrt %lx : f32
            %twice = arith.addf %root, %root : f32
            %product = arith.mulf %old, %twice : f32
            %after = arith.addf %before, %product : f32
            scf.yield %after : f32
          }
          piko.store %sum, checked @color[%x, %y : index, index] "v" : f32
        }
      }
    }
    piko.storage.close_bins %bins : !piko.bins<@Color>
  }

  // There is no table of what takes no root, of state that the kernel changes, of
  // another element than the iteration's, of a number that differs between pixels, nor
  // of a loop that is in no other.
  // CHECK-LABEL: piko.kernel @others
  // CHECK-NOT:     memref.alloca
  piko.source @b
  piko.stage @b bins [0, 0] threads 64 : @Color -> [] {}
  piko.kernel @others {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @b : !piko.bins<@Color>
    %units = piko.storage.unit_count %bins : !piko.bins<@Color>
    %w = piko.domain[0]
    %n = piko.extent @lights[0]
    scf.forall (%u) in (%units) {
      scf.for %x = %c0 to %w step %c1 {
        %old = piko.load checked @color[%x, %u : index, index] "v" : f32
        %sum = scf.for %i = %c0 to %n step %c1 iter_args(%before = %zero) -> f32 {
          %lx = piko.load checked @lights[%i : index] "x" : f32
          %twice = arith.addf %lx, %lx : f32
          %cx = piko.load checked @changed[%i : index] "x" : f32
          %croot = math.sqrt %cx : f32
          %next = arith.addi %i, %c1 : index
          %nx = piko.load checked @lights[%next : index] "y" : f32
          %nroot = math.sqrt %nx : f32
          %px = arith.mulf %lx, %old : f32
          %proot = math.sqrt %px : f32
          %0 = arith.addf %croot, %nroot : f32
          %1 = arith.addf %0, %proot : f32
          %2 = arith.addf %1, %twice : f32
          %after = arith.addf %before, %2 : f32
          scf.yield %after : f32
        }
        piko.store %sum, checked @color[%x, %u : index, index] "v" : f32
        piko.store %sum, checked @changed[%x : index] "x" : f32
      }
      %all = scf.for %i = %c0 to %n step %c1 iter_args(%before = %zero) -> f32 {
        %lx = piko.load checked @lights[%i : index] "x" : f32
        %root = math.sqrt %lx : f32
        %after = arith.addf %before, %root : f32
        scf.yield %after : f32
      }
      piko.store %all, checked @changed[%u : index] "y" : f32
    }
    piko.storage.close_bins %bins : !piko.bins<@Color>
  }
}
