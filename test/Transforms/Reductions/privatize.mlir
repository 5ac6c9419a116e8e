// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-privatize),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "n" : i32 at 4, "key" : i64 at 8} size 16 align 8
piko.record @Key {"key" : i64 at 0} size 8 align 8
piko.record @Count {"n" : i32 at 0, "scale" : i32 at 4, "of" : i32[4 : 4] at 8} size 24 align 4

// A unit's copies are there before its primitives. Changes in a loop come often.
// CHECK-LABEL: piko.kernel @kernel_a
// CHECK:         scf.forall
// CHECK:           %[[W:.*]] = piko.cpu.open_writer
// CHECK-DAG:       %[[SEEN:.*]] = piko.cpu.private_copy max_unsigned @seen "key" of %[[W]] often
// CHECK-DAG:       %[[N:.*]] = piko.cpu.private_copy add @counts "n" of %[[W]]{{$}}
// CHECK-DAG:       %[[OF:.*]] = piko.cpu.private_copy xor @counts "of" of %[[W]]{{$}}
// CHECK:           piko.storage.unit_buckets
// CHECK:             piko.load @counts[%{{.*}}] "scale"
// CHECK:             piko.atomic add @counts[%{{.*}} : i32] "n", %{{.*}} in %[[N]] : i32
// CHECK:             piko.atomic add @counts[%{{.*}} : i32] "n", %{{.*}} in %[[N]] : i32
// CHECK:             piko.atomic xor @counts[%{{.*}} : i32] "of"[%{{.*}}], %{{.*}} in %[[OF]] : i32
// CHECK:             scf.for
// CHECK:               piko.atomic max_unsigned @seen[%{{.*}} : index, index] "key", %{{.*}} in %[[SEEN]] : i64

// Another kernel that reads the same is not in the way; a list's calls have no
// loop over primitives.
// CHECK-LABEL: piko.kernel @kernel_b
// CHECK:         piko.cpu.private_copy min_signed @seen "key" of %{{[a-z0-9]+}}{{$}}
// CHECK:         piko.load @counts
piko.pipeline @P rank 2 {
  piko.image @seen : @Key rank 2
  piko.buffer @counts : @Count
  piko.source @a
  piko.source @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %key = piko.get %f "key" : !piko.prim<@F> -> i64
      %scale = piko.load @counts[%x : i32] "scale" : i32
      %more = arith.muli %n, %scale : i32
      // expected-remark @below {{stage 'a' changes private copies of 'counts', which are combined when its kernel ends}}
      piko.atomic add @counts[%x : i32] "n", %n : i32
      piko.atomic add @counts[%n : i32] "n", %more : i32
      // expected-remark @below {{stage 'a' changes private copies of 'counts'}}
      piko.atomic xor @counts[%x : i32] "of"[%one], %n : i32
      %size = piko.extent @seen[0]
      scf.for %i = %zero to %size step %one {
        // expected-remark @below {{stage 'a' changes private copies of 'seen'}}
        piko.atomic max_unsigned @seen[%i, %i : index, index] "key", %key : i64
      }
      piko.return
    }
  }
  piko.stage @b bins [8, 8] threads 1 : list @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%list: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %size = piko.list_size %list : !piko.list<@F>
      scf.for %i = %zero to %size step %one {
        %n = piko.load @counts[%i : index] "n" : i32
        %key = arith.extsi %n : i32 to i64
        // expected-remark @below {{stage 'b' changes private copies of 'seen'}}
        piko.atomic min_signed @seen[%i, %i : index, index] "key", %key : i64
      }
      piko.return
    }
  }
}
