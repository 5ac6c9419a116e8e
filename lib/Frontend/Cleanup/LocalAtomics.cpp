//===- LocalAtomics.cpp - Atomics on local variables ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nobody else sees a local variable: an atomic on one loads, computes and
// stores. The iterations of a parallelFor share what they capture, so there it
// is an error, as an assignment is.
//
// Whether a result or a rounding shows the order of primitives is not asked of
// the place, which a plain C++ build does not know: the accessor showsOrder
// keeps the question for the phase's stage.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"
#include "Cleanup/ParallelLoops.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"

#include "mlir/IR/Diagnostics.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/Module.h"
#include "llvm/Transforms/Utils/LowerAtomic.h"

using namespace piko;
using llvm::dyn_cast;

static llvm::AtomicRMWInst::BinOp getOperation(const Marker &marker) {
  switch (marker.operation) {
  case 0:
    return llvm::AtomicRMWInst::Add;
  case 1:
    return marker.isSigned ? llvm::AtomicRMWInst::Min
                           : llvm::AtomicRMWInst::UMin;
  case 2:
    return marker.isSigned ? llvm::AtomicRMWInst::Max
                           : llvm::AtomicRMWInst::UMax;
  case 3:
    return llvm::AtomicRMWInst::And;
  case 4:
    return llvm::AtomicRMWInst::Or;
  case 5:
    return llvm::AtomicRMWInst::Xor;
  default:
    return llvm::AtomicRMWInst::FAdd;
  }
}

static void expand(llvm::CallInst *call, const Marker &marker) {
  llvm::IRBuilder<> builder(call);
  llvm::Value *place = call->getArgOperand(0), *value = call->getArgOperand(1);
  llvm::AtomicRMWInst::BinOp operation = getOperation(marker);
  bool isFetch = marker.kind == MarkerKind::atomicFetch;
  if (isFetch || operation == llvm::AtomicRMWInst::FAdd) {
    llvm::FunctionCallee callee = call->getModule()->getOrInsertFunction(
        accessor::showsOrder, builder.getVoidTy(), builder.getInt1Ty());
    auto *question = llvm::cast<llvm::Function>(callee.getCallee());
    question->setDoesNotThrow();
    question->setMemoryEffects(llvm::MemoryEffects::inaccessibleMemOnly());
    builder.CreateCall(callee, {builder.getInt1(isFetch)});
  }
  llvm::Value *old = builder.CreateLoad(value->getType(), place);
  builder.CreateStore(llvm::buildAtomicRMWValue(operation, builder, old, value),
                      place);
  if (isFetch)
    call->replaceAllUsesWith(old);
  call->eraseFromParent();
}

bool piko::expandLocalAtomics(llvm::Function &function, const ParsedUnit &unit,
                              MemoryMap &memory, mlir::MLIRContext &context,
                              bool &changed) {
  llvm::SmallVector<std::pair<llvm::CallInst *, llvm::AllocaInst *>> calls;
  for (llvm::Instruction &instruction : llvm::instructions(function)) {
    auto *call = dyn_cast<llvm::CallInst>(&instruction);
    const Marker *marker = call ? getMarker(call, memory.markers) : nullptr;
    if (!marker || (marker->kind != MarkerKind::atomic &&
                    marker->kind != MarkerKind::atomicFetch))
      continue;
    Address address = getAddress(call->getArgOperand(0), memory.data);
    if (auto *variable = dyn_cast<llvm::AllocaInst>(address.base))
      calls.emplace_back(call, variable);
  }
  if (calls.empty())
    return true;
  ParallelLoops loops(function, memory.markers);
  for (auto [call, variable] : calls) {
    const ParallelLoop *loop = loops.get(call->getParent());
    if (loop && loop->getNumber() != getOwner(variable)) {
      emitUserError(call, unit, context)
          << "expected the iterations of parallelFor to be independent, but "
             "this one changes the captured variable"
          << getVariableName(variable) << " atomically";
      return false;
    }
    expand(call, *getMarker(call, memory.markers));
  }
  changed = true;
  return true;
}
