// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-if-convert))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-if-convert{max-cases=1}))' %s | FileCheck %s --check-prefix=FEW

piko.record @F {"x" : f32 at 0, "y" : f32 at 4, "h" : i32 at 8} size 12 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.buffer @out : @N
  piko.source @nested
  piko.source @computing

  // Cases of the same value are one select, and then the if around them has
  // arms that only choose.
  // CHECK:      piko.kernel @kernel_nested
  // CHECK-DAG:    %[[X:.*]] = piko.get %{{.*}} "x"
  // CHECK-DAG:    %[[Y:.*]] = piko.get %{{.*}} "y"
  // CHECK-NOT:    scf.i
  // CHECK:        %[[IS_12:.*]] = arith.cmpi eq, %[[H:.*]], %{{.*}} : index
  // CHECK:        %[[IS_14:.*]] = arith.cmpi eq, %[[H]], %{{.*}} : index
  // CHECK:        %[[EITHER:.*]] = arith.ori %[[IS_12]], %[[IS_14]] : i1
  // CHECK:        %[[INNER:.*]] = arith.select %[[EITHER]], %[[X]], %{{.*}} : f32
  // CHECK:        %[[ALL:.*]] = arith.select %{{.*}}, %[[Y]], %[[INNER]] : f32
  // CHECK:        piko.store %[[ALL]], @out

  // FEW:        piko.kernel @kernel_nested
  // FEW:          scf.if
  // FEW:            scf.index_switch
  piko.stage @nested bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %four = arith.constant 4 : i32
      %half = arith.constant 5.0e-01 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %y = piko.get %f "y" : !piko.prim<@F> -> f32
      %h = piko.get %f "h" : !piko.prim<@F> -> i32
      %low = arith.cmpi ult, %h, %four : i32
      %v = scf.if %low -> f32 {
        scf.yield %y : f32
      } else {
        %index = arith.index_castui %h : i32 to index
        %inner = scf.index_switch %index -> f32
        case 12 {
          scf.yield %x : f32
        }
        case 14 {
          scf.yield %x : f32
        }
        default {
          scf.yield %half : f32
        }
        scf.yield %inner : f32
      }
      piko.store %v, @out[%zero : i32] "v" : f32
      piko.return
    }
  }

  // Arms that compute stay, and so does one that reads state.
  // CHECK:      piko.kernel @kernel_computing
  // CHECK:        scf.if
  // CHECK:          math.sqrt
  // CHECK:        scf.if
  // CHECK:          piko.load
  piko.stage @computing bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %h = piko.get %f "h" : !piko.prim<@F> -> i32
      %is = arith.cmpi eq, %h, %zero : i32
      %root = scf.if %is -> f32 {
        %s = math.sqrt %x : f32
        scf.yield %s : f32
      } else {
        scf.yield %x : f32
      }
      %read = scf.if %is -> f32 {
        %l = piko.load @out[%h : i32] "v" : f32
        scf.yield %l : f32
      } else {
        scf.yield %root : f32
      }
      piko.store %read, @out[%zero : i32] "v" : f32
      piko.return
    }
  }
}
