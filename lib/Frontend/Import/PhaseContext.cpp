//===- PhaseContext.cpp - What importers of a phase share -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/PhaseContext.h"
#include "Support/CallChain.h"

#include "llvm/IR/Constants.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::LogicalResult;
using llvm::success;

PhaseContext::PhaseContext(llvm::Function &source, WrapperKind phase,
                           unsigned stage, ParsedUnit &unit, MemoryMap &memory,
                           mlir::MLIRContext &context)
    : source(source), phase(phase), stage(unit.pipeline.stages[stage]),
      unit(unit), memory(memory), context(context), builder(&context),
      scalars(builder, values) {}

mlir::InFlightDiagnostic
PhaseContext::fail(const llvm::Instruction *instruction) {
  return emitUserError(instruction, unit, context);
}

LogicalResult PhaseContext::reject(const llvm::Instruction *instruction,
                                   const llvm::Twine &what) {
  return fail(instruction) << "not supported in Piko: " << what;
}

LogicalResult PhaseContext::expectPhase(const llvm::Instruction *instruction,
                                        WrapperKind expected,
                                        llvm::StringRef what) {
  if (phase == expected)
    return success();
  return fail(instruction) << "expected " << what
                           << " in a process phase, but stage '" << stage.name
                           << "' has one in another";
}

void PhaseContext::setLocation(const llvm::Instruction *instruction) {
  location = getUserLocation(instruction, unit, context);
  scalars.setLocation(*location);
}

LogicalResult PhaseContext::setIndex(llvm::CallInst *call, mlir::Value index) {
  values[call] = scalars.fromIndex(index, scalars.getType(call->getType()));
  return success();
}

mlir::Value PhaseContext::getIndex(llvm::CallInst *call, unsigned operand) {
  return scalars.toIndex(scalars.get(call->getArgOperand(operand)));
}

int64_t PhaseContext::getConstant(llvm::CallInst *call, unsigned operand) {
  return llvm::cast<llvm::ConstantInt>(call->getArgOperand(operand))
      ->getSExtValue();
}

/// A call that takes the same numbers and gives them `count` times over.
mlir::func::CallOp PhaseContext::makePlaceholder(llvm::StringRef name,
                                                 llvm::CallInst *call,
                                                 unsigned count) {
  llvm::SmallVector<mlir::Value> operands;
  for (llvm::Value *value : call->args())
    operands.push_back(scalars.get(value));
  llvm::SmallVector<mlir::Type> types;
  for (unsigned i = 0; i < count; ++i)
    llvm::append_range(types, mlir::ValueRange(operands).getTypes());
  return make<mlir::func::CallOp>(name, types, operands);
}
