//===- Import.cpp - Blocks and branches of phases -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/MathCalls.h"
#include "Import/PhaseImporter.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"
#include "llvm/ADT/PostOrderIterator.h"
#include "llvm/IR/CFG.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/ProfDataUtils.h"

#include <numeric>

using namespace piko;
using llvm::dyn_cast;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;

PhaseImporter::PhaseImporter(llvm::Function &source, WrapperKind phase,
                             unsigned stage, ParsedUnit &unit,
                             MemoryMap &memory, mlir::MLIRContext &context)
    : MemoryImporter(source, phase, stage, unit, memory, context),
      loops(source, unit.markers) {}

mlir::OwningOpRef<mlir::func::FuncOp> PhaseImporter::run() {
  function =
      mlir::func::FuncOp::create(stage.location, source.getName(),
                                 builder.getFunctionType({getInputType()}, {}));
  entry = function->addEntryBlock();
  scalars.setEntry(entry);
  llvm::ReversePostOrderTraversal<llvm::Function *> order(&source);
  for (llvm::BasicBlock *block : order)
    makeBlock(block);
  for (llvm::BasicBlock *block : order)
    if (failed(importBlock(block)))
      return nullptr;
  for (llvm::BasicBlock *block : order)
    if (failed(importTerminator(block->getTerminator())))
      return nullptr;
  return std::move(function);
}

//===----------------------------------------------------------------------===//
// Blocks
//===----------------------------------------------------------------------===//

mlir::Type PhaseImporter::getInputType() {
  auto record = mlir::FlatSymbolRefAttr::get(
      &context, unit.pipeline.records[stage.input].name);
  if (phase == WrapperKind::Schedule)
    return builder.getIndexType();
  if (phase == WrapperKind::Process && stage.takesList)
    return ListType::get(&context, record);
  return PrimType::get(&context, record);
}

void PhaseImporter::makeBlock(llvm::BasicBlock *block) {
  if (block->isEntryBlock()) {
    blocks[block] = entry;
    return;
  }
  const ParallelLoop *header = loops.getByHeader(block);
  const ParallelLoop *around = header ? header->outer : loops.get(block);
  auto *made = new mlir::Block();
  (around ? *loopRegions[around].body : function->getBody()).push_back(made);
  blocks[block] = made;
  if (header) {
    makeLoop(header);
    return;
  }
  for (llvm::PHINode &phi : block->phis())
    values[&phi] = made->addArgument(scalars.getType(phi.getType()),
                                     getUserLocation(&phi, unit, context));
}

LogicalResult PhaseImporter::importBlock(llvm::BasicBlock *block) {
  builder.setInsertionPointToEnd(blocks[block]);
  if (const ParallelLoop *loop = loops.getByHeader(block))
    if (failed(importLoop(loop)))
      return failure();
  for (llvm::Instruction &instruction : *block) {
    if (llvm::isa<llvm::PHINode>(instruction) || instruction.isTerminator())
      continue;
    setLocation(&instruction);
    if (failed(importInstruction(&instruction)))
      return failure();
  }
  return success();
}

/// Whether a value is of 80 bits, as no processor's lanes and no GPU have them.
static bool isLongDouble(const llvm::Value *value) {
  return value->getType()->isX86_FP80Ty() || value->getType()->isFP128Ty();
}

LogicalResult PhaseImporter::importInstruction(llvm::Instruction *instruction) {
  if (llvm::isa<llvm::GetElementPtrInst>(instruction))
    return success();
  if (auto *variable = dyn_cast<llvm::AllocaInst>(instruction))
    return importArray(variable);
  if (llvm::isa<llvm::LoadInst, llvm::StoreInst>(instruction))
    return importArrayAccess(instruction);
  if (auto *call = dyn_cast<llvm::CallInst>(instruction)) {
    if (const Marker *marker = getMarker(call, unit.markers))
      return importMarker(call, *marker);
    llvm::StringRef name = call->getCalledFunction()->getName();
    if (name == accessor::reduceBegin || name == accessor::scanBegin)
      return importCombination(call, name);
    if (name.starts_with("piko."))
      return importAccessor(call, name);
  }
  if (llvm::isa<llvm::WithOverflowInst>(instruction))
    return success(); // Its parts are values.
  if (instruction->getType()->isPointerTy())
    return reject(instruction, manyPlaces);
  if (mlir::Value value = scalars.import(instruction)) {
    values[instruction] = value;
    return success();
  }
  if (auto *call = dyn_cast<llvm::CallInst>(instruction)) {
    if (llvm::isa<llvm::IntrinsicInst>(call) && call->getType()->isVoidTy())
      return success();
    if (std::string math = getMissingMath(*call->getCalledFunction());
        !math.empty())
      return reject(instruction, math);
    return reject(instruction,
                  "a call of '" + call->getCalledFunction()->getName() + "'");
  }
  if (isPlaceUse(instruction))
    return reject(instruction, comparedPlaces);
  if (isLongDouble(instruction) ||
      llvm::any_of(instruction->operand_values(), isLongDouble))
    return reject(instruction, "long double; use double");
  return reject(instruction, llvm::Twine("the operation '") +
                                 instruction->getOpcodeName() + "'");
}

//===----------------------------------------------------------------------===//
// Branches
//===----------------------------------------------------------------------===//

mlir::Block *PhaseImporter::getTarget(llvm::BasicBlock *from,
                                      llvm::BasicBlock *to) {
  const ParallelLoop *loop = loops.getByHeader(to);
  return loop && loop->blocks->contains(from) ? loopRegions[loop].end
                                              : blocks[to];
}

llvm::SmallVector<mlir::Value>
PhaseImporter::getArguments(llvm::BasicBlock *from, llvm::BasicBlock *to) {
  llvm::SmallVector<mlir::Value> arguments;
  if (loops.getByHeader(to))
    return arguments;
  for (llvm::PHINode &phi : to->phis())
    arguments.push_back(scalars.get(phi.getIncomingValueForBlock(from)));
  return arguments;
}

LogicalResult PhaseImporter::importTerminator(llvm::Instruction *terminator) {
  llvm::BasicBlock *from = terminator->getParent();
  builder.setInsertionPointToEnd(blocks[from]);
  setLocation(terminator);
  if (const ParallelLoop *loop = loops.getByHeader(from)) {
    importLoopExit(loop);
    return success();
  }
  if (llvm::isa<llvm::ReturnInst, llvm::UnreachableInst>(terminator)) {
    if (const ParallelLoop *loop = loops.get(from))
      make<mlir::cf::BranchOp>(loopRegions[loop].end);
    else
      make<mlir::func::ReturnOp>();
    return success();
  }
  if (auto *branch = dyn_cast<llvm::BranchInst>(terminator)) {
    llvm::BasicBlock *first = branch->getSuccessor(0);
    if (branch->isUnconditional()) {
      make<mlir::cf::BranchOp>(getTarget(from, first),
                               getArguments(from, first));
      return success();
    }
    llvm::BasicBlock *second = branch->getSuccessor(1);
    auto made = make<mlir::cf::CondBranchOp>(
        scalars.get(branch->getCondition()), getTarget(from, first),
        getArguments(from, first), getTarget(from, second),
        getArguments(from, second));
    if (llvm::SmallVector<uint32_t> weights;
        llvm::extractBranchWeights(*branch, weights) && weights.size() == 2)
      made.setBranchWeights(
          llvm::ArrayRef<int32_t>{int32_t(weights[0]), int32_t(weights[1])});
    return success();
  }
  auto *choice = dyn_cast<llvm::SwitchInst>(terminator);
  if (!choice)
    return reject(terminator, llvm::Twine("the operation '") +
                                  terminator->getOpcodeName() + "'");
  llvm::SmallVector<llvm::APInt> cases;
  llvm::SmallVector<mlir::Block *> targets;
  llvm::SmallVector<llvm::SmallVector<mlir::Value>> arguments;
  for (auto &option : choice->cases()) {
    cases.push_back(option.getCaseValue()->getValue());
    targets.push_back(getTarget(from, option.getCaseSuccessor()));
    arguments.push_back(getArguments(from, option.getCaseSuccessor()));
  }
  llvm::SmallVector<mlir::ValueRange> ranges(arguments.begin(),
                                             arguments.end());
  auto made = make<mlir::cf::SwitchOp>(
      scalars.get(choice->getCondition()),
      getTarget(from, choice->getDefaultDest()),
      getArguments(from, choice->getDefaultDest()), cases, targets, ranges);
  if (llvm::SmallVector<uint32_t> weights;
      llvm::extractBranchWeights(*choice, weights)) {
    double all =
        std::max(1.0, std::accumulate(weights.begin(), weights.end(), 0.0));
    made->setAttr(marks::probabilities,
                  mlir::DenseF64ArrayAttr::get(
                      made.getContext(),
                      llvm::map_to_vector(weights, [&](uint32_t weight) {
                        return weight / all;
                      })));
  }
  return success();
}

mlir::OwningOpRef<mlir::func::FuncOp>
piko::importPhase(llvm::Function &function, WrapperKind phase, unsigned stage,
                  ParsedUnit &unit, MemoryMap &memory,
                  mlir::MLIRContext &context) {
  return PhaseImporter(function, phase, stage, unit, memory, context).run();
}
