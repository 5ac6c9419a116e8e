// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: not piko-opt %s --piko-add-checks=numbers=G.z 2>&1 | FileCheck %s --check-prefix=RECORD
// RUN: not piko-opt %s --piko-add-checks=numbers=F.q 2>&1 | FileCheck %s --check-prefix=FIELD
// RUN: not piko-opt %s --piko-add-checks=numbers=F.i 2>&1 | FileCheck %s --check-prefix=TYPE

// RECORD: error: expected the record of a primitive, one of 'F', to be checked for NaN, but got 'G'
// FIELD: [[#@LINE+2]]:1: error: expected a field of 'F' to be checked for NaN, but got 'q', which is none
// TYPE: [[#@LINE+1]]:1: error: expected field 'i' of 'F' to hold floats, because it is to be checked for NaN, but got 'i32'
piko.record @F {"z" : f32 at 0, "i" : i32 at 4} size 8 align 4

piko.pipeline @P rank 1 {
  piko.source @start
  piko.stage @start bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
