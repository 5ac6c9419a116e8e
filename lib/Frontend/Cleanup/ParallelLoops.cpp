//===- ParallelLoops.cpp - parallelFor in LLVM IR -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Cleanup/ParallelLoops.h"

#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"
#include "llvm/Transforms/Utils/PromoteMemToReg.h"

using namespace piko;
using llvm::dyn_cast;

/// The metadata of a variable that an iteration owns: the loop's number.
static constexpr llvm::StringLiteral ownerName = "piko.owner";

/// Of larger arrays it is not worth saying that they begin unset.
static constexpr int64_t unsetLimit = 256;

//===----------------------------------------------------------------------===//
// Loops
//===----------------------------------------------------------------------===//

static llvm::CallInst *findCall(llvm::BasicBlock &block, MarkerKind kind,
                                const MarkerTable &markers) {
  for (llvm::Instruction &instruction : block)
    if (auto *call = dyn_cast<llvm::CallInst>(&instruction))
      if (const Marker *marker = getMarker(call, markers))
        if (marker->kind == kind)
          return call;
  return nullptr;
}

int64_t ParallelLoop::getNumber() const {
  return llvm::cast<llvm::ConstantInt>(more->getArgOperand(2))->getSExtValue();
}

ParallelLoops::ParallelLoops(llvm::Function &function,
                             const MarkerTable &markers)
    : dominance(function), loops(dominance) {
  for (llvm::Loop *loop : loops.getLoopsInPreorder())
    if (llvm::CallInst *more =
            findCall(*loop->getHeader(), MarkerKind::loopMore, markers)) {
      const ParallelLoop *outer = nullptr;
      if (llvm::Loop *parent = loop->getParentLoop())
        outer = get(parent->getHeader());
      parallel.push_back(
          std::make_unique<ParallelLoop>(ParallelLoop{loop, more, outer}));
      byLoop[loop] = parallel.back().get();
    }
}

const ParallelLoop *ParallelLoops::get(const llvm::BasicBlock *block) const {
  for (llvm::Loop *loop = loops.getLoopFor(block); loop;
       loop = loop->getParentLoop())
    if (const ParallelLoop *found = byLoop.lookup(loop))
      return found;
  return nullptr;
}

const ParallelLoop *
ParallelLoops::getByHeader(const llvm::BasicBlock *block) const {
  llvm::Loop *loop = loops.getLoopFor(block);
  return loop && loop->getHeader() == block ? byLoop.lookup(loop) : nullptr;
}

//===----------------------------------------------------------------------===//
// What belongs to whom
//===----------------------------------------------------------------------===//

void piko::labelLoops(llvm::Function &function, MemoryMap &memory) {
  llvm::SmallVector<llvm::CallInst *> unlabeled;
  int64_t next = 1;
  for (llvm::BasicBlock &block : function)
    if (llvm::CallInst *more =
            findCall(block, MarkerKind::loopMore, memory.markers)) {
      auto *number = llvm::cast<llvm::ConstantInt>(more->getArgOperand(2));
      next = std::max(next, number->getSExtValue() + 1);
      if (number->isZero())
        unlabeled.push_back(more);
    }
  llvm::IRBuilder<> builder(function.getContext());
  for (llvm::CallInst *more : unlabeled)
    more->setArgOperand(2, builder.getInt32(next++));
  if (next == 1)
    return;

  ParallelLoops loops(function, memory.markers);
  for (llvm::Instruction &instruction : llvm::instructions(function)) {
    auto *call = dyn_cast<llvm::IntrinsicInst>(&instruction);
    if (!call || call->getIntrinsicID() != llvm::Intrinsic::lifetime_start)
      continue;
    auto *variable = dyn_cast<llvm::AllocaInst>(call->getArgOperand(0));
    const ParallelLoop *loop = loops.get(call->getParent());
    if (!variable || !loop)
      continue;
    variable->setMetadata(
        ownerName, llvm::MDNode::get(function.getContext(),
                                     llvm::ConstantAsMetadata::get(
                                         builder.getInt64(loop->getNumber()))));
    llvm::Type *type = variable->getAllocatedType();
    int64_t count = 0;
    for (const MemoryLeaf &leaf : memory.getTypeLayout(type).leaves)
      count += leaf.getElementCount();
    if (count > unsetLimit)
      continue;
    builder.SetInsertPoint(call);
    builder.CreateStore(llvm::UndefValue::get(type), variable);
  }
}

int64_t piko::getOwner(const llvm::AllocaInst *variable) {
  const llvm::MDNode *owner = variable->getMetadata(ownerName);
  if (!owner)
    return 0;
  return llvm::mdconst::extract<llvm::ConstantInt>(owner->getOperand(0))
      ->getSExtValue();
}

std::string piko::getVariableName(const llvm::AllocaInst *variable) {
  // Inlining appends ".i"; Clang's own variables have a dot in their names,
  // and those of one name in several scopes a number after it.
  llvm::StringRef name = variable->getName();
  while (name.contains('.') && name.rsplit('.').second.starts_with("i") &&
         llvm::all_of(name.rsplit('.').second.drop_front(), llvm::isDigit))
    name = name.rsplit('.').first;
  if (name.empty() || name.contains('.') || llvm::isDigit(name.back()))
    return "";
  return " '" + name.str() + "'";
}

//===----------------------------------------------------------------------===//
// What iterations share
//===----------------------------------------------------------------------===//

/// Whether a store is to a variable that other iterations see as well.
static bool isShared(const llvm::StoreInst *store,
                     const llvm::AllocaInst *variable,
                     const ParallelLoops &loops) {
  const ParallelLoop *loop = loops.get(store->getParent());
  return loop && loop->getNumber() != getOwner(variable);
}

/// Whether a store goes to the next iteration of its loop.
static bool isStep(const llvm::StoreInst *store, const ParsedUnit &unit) {
  auto *call = dyn_cast<llvm::CallInst>(store->getValueOperand());
  const Marker *marker = call ? getMarker(call, unit.markers) : nullptr;
  return marker && marker->kind == MarkerKind::loopNext;
}

/// What the iterations share; a function object that was given to parallelFor
/// is a temporary.
static std::string describeShared(const llvm::AllocaInst *variable) {
  llvm::StringRef name = variable->getName();
  if (name.starts_with("ref.tmp") || name.starts_with("agg.tmp"))
    return "a variable captured by value, of which all share one copy";
  return "the captured variable" + getVariableName(variable);
}

bool piko::promoteVariables(llvm::Function &function, const ParsedUnit &unit,
                            mlir::MLIRContext &context) {
  ParallelLoops loops(function, unit.markers);
  llvm::DominatorTree dominance(function);
  while (true) {
    llvm::SmallVector<llvm::AllocaInst *> variables;
    for (llvm::Instruction &instruction : function.getEntryBlock())
      if (auto *variable = dyn_cast<llvm::AllocaInst>(&instruction))
        if (llvm::isAllocaPromotable(variable))
          variables.push_back(variable);
    if (variables.empty())
      return true;
    for (llvm::AllocaInst *variable : variables)
      for (llvm::User *user : variable->users()) {
        auto *store = dyn_cast<llvm::StoreInst>(user);
        if (!store || !isShared(store, variable, loops) || isStep(store, unit))
          continue;
        mlir::InFlightDiagnostic error = emitUserError(store, unit, context);
        error
            << "expected the iterations of parallelFor to be independent, but "
               "this one assigns "
            << describeShared(variable);
        error.attachNote() << "a variable that the iteration declares is its "
                              "own; reduce, count and atomics on state combine "
                              "what iterations find";
        return false;
      }
    llvm::PromoteMemToReg(variables, dominance);
  }
}

/// Whether iterations of a loop write to a variable that they share.
static bool isWritten(const llvm::Value *pointer,
                      const llvm::AllocaInst *variable,
                      const ParallelLoops &loops) {
  return llvm::any_of(pointer->users(), [&](const llvm::User *user) {
    if (llvm::isa<llvm::GetElementPtrInst>(user))
      return isWritten(user, variable, loops);
    auto *store = dyn_cast<llvm::StoreInst>(user);
    return store && isShared(store, variable, loops);
  });
}

void piko::shareArrays(llvm::Function &function, MemoryMap &memory) {
  ParallelLoops loops(function, memory.markers);
  llvm::IRBuilder<> builder(function.getContext());
  for (llvm::Instruction &instruction :
       llvm::make_early_inc_range(function.getEntryBlock())) {
    auto *variable = dyn_cast<llvm::AllocaInst>(&instruction);
    if (!variable || !variable->getAllocatedType()->isArrayTy() ||
        !isWritten(variable, variable, loops))
      continue;
    // Whoever has the address may write to it: barriers, as far as LLVM knows.
    builder.SetInsertPoint(variable->getNextNode());
    llvm::FunctionCallee share = function.getParent()->getOrInsertFunction(
        accessor::share, builder.getVoidTy(), variable->getType());
    builder.CreateCall(share, {variable});
  }
}
