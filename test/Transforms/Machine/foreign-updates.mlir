// RUN: piko-test-opt %s --piko-own-pixels=tile=4 --piko-form-kernels --piko-form-program --piko-form-work --verify-diagnostics | FileCheck %s
// RUN: not piko-test-opt %s --piko-add-checks 2>&1 | FileCheck %s --check-prefix=CHECKED

// An update of which nobody knows the pixel is an update: the bin is not divided
// by owners of pixels, and its order shows. Checking mode, which tells which
// element is accessed, refuses it.
// CHECK: piko.stage @a {{.*}} threads 1 lineage 0 ordered placed writes :
// CHECKED: error: expected an access of the piko dialect, because checking mode tells which element it is to, but got 'piko_test.smear'

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 lineage 0 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-remark@+1 {{stage 'a' shares no bin by its pixels}}
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      // expected-note@+1 {{it is not known which pixel this updates}}
      piko_test.smear @image
      piko.return
    }
  }
}
