//===- ImportLoops.cpp - parallelFor and barriers -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/PhaseImporter.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::dyn_cast;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;

llvm::CallInst *PhaseImporter::getBox(const ParallelLoop *loop) {
  auto *count = dyn_cast<llvm::CallInst>(loop->more->getArgOperand(1));
  const Marker *marker = count ? getMarker(count, unit.markers) : nullptr;
  return marker && marker->kind == MarkerKind::cellsOf ? count : nullptr;
}

void PhaseImporter::makeLoop(const ParallelLoop *loop) {
  setLocation(loop->more);
  LoopRegion &region = loopRegions[loop];
  region.body = std::make_unique<mlir::Region>();
  region.entry = &region.body->emplaceBlock();
  if (!getBox(loop)) {
    region.entry->addArgument(builder.getIndexType(), *location);
  } else {
    cells[loop->more->getArgOperand(0)] = region.entry;
    for (int64_t dim = 0; dim < getRank(); ++dim)
      region.entry->addArgument(builder.getI32Type(), *location);
  }
  region.end = &region.body->emplaceBlock();
  loopEntries[loop->getNumber()] = region.entry;
}

/// Reports what goes from one iteration to another, or out of the loop, other
/// than through an array.
LogicalResult PhaseImporter::checkLoop(const ParallelLoop *loop) {
  const llvm::Instruction *carried = nullptr;
  for (llvm::PHINode &phi : loop->blocks->getHeader()->phis())
    if (&phi != loop->more->getArgOperand(0))
      for (auto [value, from] : llvm::zip(phi.incoming_values(), phi.blocks()))
        if (loop->blocks->contains(from) && !carried) {
          carried = dyn_cast<llvm::Instruction>(value.get());
          if (!carried || carried == &phi)
            carried = loop->more;
        }
  for (llvm::BasicBlock *block : loop->blocks->blocks())
    for (llvm::BasicBlock *next : llvm::successors(block))
      if (block != loop->blocks->getHeader() && !loop->blocks->contains(next))
        return reject(block->getTerminator(),
                      "an iteration of parallelFor that does not end");
  for (llvm::BasicBlock *block : loop->blocks->blocks())
    for (llvm::Instruction &instruction : *block)
      for (const llvm::User *user : instruction.users())
        if (!loop->blocks->contains(
                llvm::cast<llvm::Instruction>(user)->getParent()) &&
            !carried)
          carried = &instruction;
  if (!carried)
    return success();
  return fail(carried) << "expected the iterations of parallelFor to be "
                          "independent, but this one assigns a captured "
                          "variable";
}

LogicalResult PhaseImporter::importLoop(const ParallelLoop *loop) {
  setLocation(loop->more);
  if (failed(expectPhase(loop->more, WrapperKind::Process, "parallelFor")) ||
      failed(checkLoop(loop)))
    return failure();
  auto *count = dyn_cast<llvm::Instruction>(loop->more->getArgOperand(1));
  if (count && loop->blocks->contains(count))
    return reject(count, "a number of iterations that changes with them");
  LoopRegion &region = loopRegions[loop];
  llvm::CallInst *box = getBox(loop);
  mlir::Operation *op =
      box ? makePixels(box) : make<ParallelForOp>(getIndex(loop->more, 1));
  op->getRegion(0).takeBody(*region.body);

  builder.setInsertionPointToEnd(region.end);
  make<YieldOp>(mlir::ValueRange(), mlir::ValueRange());
  builder.setInsertionPointToEnd(region.entry);
  llvm::Value *index = loop->more->getArgOperand(0);
  if (!box)
    values[index] = scalars.fromIndex(region.entry->getArgument(0),
                                      scalars.getType(index->getType()));
  return success();
}

mlir::Operation *PhaseImporter::makePixels(llvm::CallInst *box) {
  llvm::SmallVector<mlir::Value> lo, hi;
  for (int64_t dim = 0; dim < getRank(); ++dim) {
    lo.push_back(scalars.get(box->getArgOperand(dim)));
    hi.push_back(scalars.get(box->getArgOperand(4 + dim)));
  }
  return make<ParallelPixelsOp>(lo, hi);
}

LogicalResult PhaseImporter::importCellAt(llvm::CallInst *call) {
  mlir::Block *loop = cells.lookup(call->getArgOperand(0));
  if (!loop)
    return reject(call, "a parallelForPixels whose iterations never end");
  values[call] = loop->getArgument(getConstant(call, 1));
  return success();
}

void PhaseImporter::importLoopExit(const ParallelLoop *loop) {
  llvm::BasicBlock *header = loop->blocks->getHeader();
  for (llvm::BasicBlock *to : llvm::successors(header)) {
    bool stays = loop->blocks->contains(to);
    builder.setInsertionPointToEnd(stays ? loopRegions[loop].entry
                                         : blocks[header]);
    make<mlir::cf::BranchOp>(getTarget(header, to), getArguments(header, to));
  }
}

/// Which of the calls that are reductions the user's text makes.
static std::string getReductionName(llvm::CallInst *call,
                                    const ParsedUnit &unit) {
  CallChain chain(call, unit);
  llvm::StringRef callee = chain.getUserCallee().rsplit("::").second;
  bool isOther = callee == "any" || callee == "all" || callee == "count";
  return isOther ? callee.str() : "reduce";
}

LogicalResult PhaseImporter::importCombination(llvm::CallInst *call,
                                               llvm::StringRef name) {
  bool isScan = name == accessor::scanBegin;
  std::string callee = isScan ? "scan" : getReductionName(call, unit);
  if (failed(checkBarrier(call, callee)))
    return failure();
  // A scan takes its value and its empty value, and combines two values.
  mlir::func::CallOp begin = makePlaceholder(
      isScan ? scanBeginName : reduceBeginName, call, isScan ? 1 : 2);
  if (callee != "reduce" && !isScan)
    begin->setAttr(cppNameAttr, builder.getStringAttr(callee));
  placeholders[call] = begin;
  return success();
}

LogicalResult PhaseImporter::importSort(llvm::CallInst *call, bool isSigned) {
  if (failed(checkBarrier(call, "sort")))
    return failure();
  mlir::Value key = scalars.get(call->getArgOperand(0));
  bool isUnsigned = !isSigned && !llvm::isa<mlir::FloatType>(key.getType());
  return setIndex(call, make<SortOp>(builder.getIndexType(), isUnsigned, key));
}

LogicalResult PhaseImporter::checkBarrier(llvm::CallInst *call,
                                          llvm::StringRef what) {
  if (failed(expectPhase(call, WrapperKind::Process, what)))
    return failure();
  const ParallelLoop *loop = loops.get(call->getParent());
  if (!loop)
    return fail(call) << "expected " << what
                      << " inside a parallelFor, but stage '" << stage.name
                      << "' has one outside";
  if (!loop->outer)
    return success();
  mlir::InFlightDiagnostic diagnostic = fail(call);
  diagnostic << "expected " << what
             << " inside a parallelFor that is not nested";
  diagnostic.attachNote(getUserLocation(loop->outer->more, unit, context))
      << "the outer parallelFor is here";
  return diagnostic;
}
