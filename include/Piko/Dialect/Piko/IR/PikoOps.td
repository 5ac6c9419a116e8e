// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// All operations of the `piko` dialect.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOOPS_TD

include "Piko/Dialect/Piko/IR/Ops/PikoPipelineOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoStageOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoAssignOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoBodyOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoStateOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoLoopOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoKernelOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoMachineOps.td"

#endif // PIKO_DIALECT_PIKO_IR_PIKOOPS_TD
