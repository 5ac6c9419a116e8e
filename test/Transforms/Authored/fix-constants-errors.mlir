// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings}))' 2>&1 | FileCheck %s --check-prefix=FORM
// FORM: error: piko-fix-constants: expected CONSTANT[.FIELD]=VALUE or BUFFER.size=COUNT, but got 'settings'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=none=1}))' 2>&1 | FileCheck %s --check-prefix=NONE
// NONE: error: piko-fix-constants: expected a constant, or .size of a buffer, but got 'none'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=lights=1}))' 2>&1 | FileCheck %s --check-prefix=BUFFER
// BUFFER: error: piko-fix-constants: expected a constant, or .size of a buffer, but got 'lights'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=lights.size=-1}))' 2>&1 | FileCheck %s --check-prefix=SIZE
// SIZE: error: piko-fix-constants: expected how many elements buffer 'lights' has, but got '-1'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.fog=1}))' 2>&1 | FileCheck %s --check-prefix=FIELD
// FIELD: error: piko-fix-constants: expected a field of constant 'settings', but got 'fog', which is none
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.w=1}))' 2>&1 | FileCheck %s --check-prefix=ELEMENT
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.w[2]=1}))' 2>&1 | FileCheck %s --check-prefix=ELEMENT
// ELEMENT: error: piko-fix-constants: expected an element that there is of field 'w', but got 'w
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.kind[0]=1}))' 2>&1 | FileCheck %s --check-prefix=SCALAR
// SCALAR: error: piko-fix-constants: expected no element of field 'kind', but got 'kind[0]'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.kind=1.5}))' 2>&1 | FileCheck %s --check-prefix=TYPE
// TYPE: error: piko-fix-constants: expected a value of 'i8' for 'settings.kind', but got '1.5'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.kind=300}))' 2>&1 | FileCheck %s --check-prefix=RANGE
// RANGE: error: piko-fix-constants: expected a value of 'i8' for 'settings.kind', but got '300'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.kind=-129}))' 2>&1 | FileCheck %s --check-prefix=NEGATIVE
// NEGATIVE: error: piko-fix-constants: expected a value of 'i8' for 'settings.kind', but got '-129'
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.kind=1,settings.kind=2}))' 2>&1 | FileCheck %s --check-prefix=TWICE
// TWICE: error: piko-fix-constants: expected one value of 'settings.kind', but got two
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.w[0]=1e999}))' 2>&1 | FileCheck %s --check-prefix=OVERFLOW
// OVERFLOW: error: piko-fix-constants: expected a value of 'f32' for 'settings.w[0]', but got '1e999'

piko.record @Settings {"kind" : i8 at 0, "w" : f32[2 : 4] at 4} size 12 align 4
piko.record @float {"value" : f32 at 0} size 4 align 4

piko.pipeline @P rank 1 {
  piko.constant @settings : @Settings
  piko.buffer @lights : @float
  piko.source @a
  piko.stage @a bins [0] threads 1 : @float -> [] {}
}
