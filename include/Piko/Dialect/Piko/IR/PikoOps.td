// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// All operations of the `piko` dialect.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOOPS_TD

include "Piko/Dialect/Piko/IR/PikoPipelineOps.td"
include "Piko/Dialect/Piko/IR/PikoStageOps.td"
include "Piko/Dialect/Piko/IR/PikoAssignOps.td"
include "Piko/Dialect/Piko/IR/PikoBodyOps.td"
include "Piko/Dialect/Piko/IR/PikoStateOps.td"
include "Piko/Dialect/Piko/IR/PikoLoopOps.td"
include "Piko/Dialect/Piko/IR/PikoKernelOps.td"
include "Piko/Dialect/Piko/IR/PikoMachineOps.td"

#endif // PIKO_DIALECT_PIKO_IR_PIKOOPS_TD
