// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,convert-piko-to-scf),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @Pixel {"z" : f32 at 0, "w" : f32[2 : 4] at 4} size 12 align 4
piko.record @u32 {"value" : i32 at 0} size 4 align 4

// An update loads the pixel, runs, and stores what changed; a pixel outside is
// reported. Writes to buffers test their index.
// CHECK-LABEL: piko.kernel @kernel_a
// CHECK:         %[[X:.*]] = piko.get %{{.*}} "x"
// CHECK:         %[[Z:.*]] = piko.get %{{.*}} "z"
// CHECK:         %[[XI:.*]] = arith.index_cast %[[X]]
// CHECK:         %[[W:.*]] = piko.domain[0]
// CHECK:         %[[IN:.*]] = arith.cmpi ult, %[[XI]], %[[W]]
// CHECK:         %[[R:.*]] = scf.if %[[IN]] -> (i1) {
// CHECK:           %[[OLD:.*]] = piko.load checked @image[%[[XI]] : index] "z"
// CHECK:           %[[CLOSER:.*]] = arith.cmpf olt, %[[Z]], %[[OLD]]
// CHECK:           %[[NEW:.*]] = arith.select %[[CLOSER]], %[[Z]], %[[OLD]]
// CHECK:           piko.store %[[NEW]], checked @image[%[[XI]] : index] "z"
// CHECK-NOT:       piko.store
// CHECK:           scf.yield %[[CLOSER]]
// CHECK:         } else {
// The bin of the call is found where it is to be told alone.
// CHECK-NEXT:      %[[BIN:.*]] = piko.storage.bucket_bin
// CHECK-NEXT:      piko.fail @a in %[[BIN]] outside bin of @image(%[[XI]])
// CHECK:         %[[N:.*]] = piko.extent @counts[0]
// CHECK:         %[[OK:.*]] = arith.cmpi ult, %[[XI]], %[[N]]
// CHECK:         scf.if %[[OK]] {
// CHECK:           piko.atomic add checked @counts
// CHECK:         } else {
// CHECK-NEXT:      %[[BIN2:.*]] = piko.storage.bucket_bin
// CHECK-NEXT:      piko.fail @a in %[[BIN2]] outside @counts(%[[XI]])
piko.pipeline @P rank 1 {
  piko.image @image : @Pixel rank 1
  piko.buffer @counts : @u32
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %r = piko.update @image[%x : i32] {
      ^bb0(%old: f32, %w0: f32, %w1: f32):
        %closer = arith.cmpf olt, %z, %old : f32
        %new = arith.select %closer, %z, %old : f32
        piko.yield [%new, %w0, %w1 : f32, f32, f32] results [%closer : i1]
      } -> i1
      %one = arith.extui %r : i1 to i32
      piko.atomic add @counts[%x : i32] "value", %one : i32
      piko.return
    }
  }
}
