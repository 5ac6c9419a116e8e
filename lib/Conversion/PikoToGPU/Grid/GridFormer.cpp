// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Makes a launch of a kernel's work: a block runs one unit of it after the
// other.

#include "PikoToGPU/Grid/GridFormer.h"

#include "Piko/Conversion/KernelImage.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"

#include "llvm/ADT/StringExtras.h"

using namespace mlir;
using namespace piko;

/// Where the first phase of the work stands.
static Location findPhase(Operation *work) {
  Location place = work->getLoc();
  work->walk<WalkOrder::PreOrder>([&](WorkOpInterface phase) {
    place = phase.getLoc();
    return WalkResult::interrupt();
  });
  return place;
}

/// PTX has no other characters: a pipeline may be in a namespace.
static std::string makePTXName(std::string name) {
  for (char &c : name)
    if (!llvm::isAlnum(c) && c != '_' && c != '$')
      c = '_';
  return name;
}

/// The launch has a name for who runs it: its stage, and where that stands.
void GridFormer::createUnits(StageOp stage, IntegerAttr source) {
  auto type = BinsType::get(rewriter.getContext(), stage.getInputAttr());
  bins = OpenBinsOp::create(rewriter, loc, type,
                            FlatSymbolRefAttr::get(stage.getSymNameAttr()),
                            source);
  Value zero = constant(0), one = constant(1), size = constant(threads);
  Value blocks = BlockCountOp::create(rewriter, loc, bins, size);
  Value any = arith::CmpIOp::create(rewriter, loc, arith::CmpIPredicate::ugt,
                                    blocks, zero);
  // A GPU refuses a grid without blocks.
  auto ifAny = scf::IfOp::create(rewriter, loc, any);
  CloseBinsOp::create(rewriter, loc, bins);
  rewriter.setInsertionPointToStart(ifAny.thenBlock());
  auto pipeline = kernel->getParentOfType<PipelineOp>();
  auto symbol = [&](const std::string &name) {
    return FlatSymbolRefAttr::get(rewriter.getContext(), name);
  };
  std::string name = pipeline.getSymName().str();
  log = OpenLogOp::create(rewriter, loc, WriterType::get(rewriter.getContext()),
                          bins);
  auto origin = NameLoc::get(stage.getSymNameAttr(), findPhase(work));
  launch = gpu::LaunchOp::create(
      rewriter, origin, blocks, one, one, size, one, one,
      /*dynamicSharedMemorySize=*/Value(), /*asyncTokenType=*/Type(),
      /*asyncDependencies=*/ValueRange(), /*workgroupAttributions=*/TypeRange(),
      /*privateAttributions=*/TypeRange(), Value(), Value(), Value(),
      symbol(name + kernelsSuffix.str()),
      symbol(makePTXName(name + "_" + kernel.getSymName().str())));
  CloseLogOp::create(rewriter, loc, log);
  rewriter.setInsertionPointToEnd(&launch.getBody().front());
  unitEnd = gpu::TerminatorOp::create(rewriter, loc);
  unit = launch.getBlockIds().x;
}

/// Whether a join asks at which positions of a kernel primitives were emitted:
/// for keys, or to permute them. The places of a loop and the buckets of a
/// source take positions, too.
static bool needsPositions(KernelOp kernel) {
  ProgramOp program = getProgram(kernel->getParentOfType<PipelineOp>());
  if (getAssignedSource(kernel) || !program)
    return true;
  SmallVector<EdgeOp> emitted = getEmittedEdges(kernel);
  bool needs = false;
  program->walk([&](Operation *op) {
    if (auto launch = dyn_cast<LaunchOp>(op))
      needs |= launch.getKernel() == kernel.getSymName() &&
               op->getParentOfType<WavesOp>();
    if (auto join = dyn_cast<JoinOp>(op))
      for (auto [edge, permute, keys] :
           llvm::zip(join.getEdges(), join.getPermutes(), join.getKeys()))
        needs |= (permute || keys > 0) &&
                 llvm::is_contained(emitted, getOrigin(edge));
  });
  return needs;
}

template <class OpT> static OpT findOnly(KernelOp kernel) {
  OpT found;
  kernel.walk([&](OpT op) { found = op; });
  return found;
}

void piko::launchBefore(KernelOp kernel, KernelOp first) {
  auto bins = findOnly<OpenBinsOp>(kernel),
       ownBins = findOnly<OpenBinsOp>(first);
  auto log = findOnly<OpenLogOp>(kernel), ownLog = findOnly<OpenLogOp>(first);
  auto blocks = findOnly<BlockCountOp>(kernel),
       ownBlocks = findOnly<BlockCountOp>(first);
  auto launches = cast<scf::IfOp>(ownLog->getParentOp());
  findOnly<CloseBinsOp>(first)->erase();
  findOnly<CloseLogOp>(first)->erase();
  ownBins.getBins().replaceAllUsesWith(bins.getBins());
  ownLog.getLog().replaceAllUsesWith(log.getLog());
  ownLog->erase();
  Block::iterator after = std::next(log->getIterator());
  Block &body = *launches.thenBlock();
  log->getBlock()->getOperations().splice(after, body.getOperations(),
                                          body.begin(),
                                          body.getTerminator()->getIterator());
  launches->erase();
  // Constants of the first may be before its bins.
  Block &all = *first.getBodyBlock();
  ownBlocks.getBlocks().replaceAllUsesWith(blocks.getBlocks());
  ownBlocks->erase();
  ownBins->erase();
  kernel.getBodyBlock()->getOperations().splice(
      std::next(blocks->getIterator()), all.getOperations(), all.begin(),
      all.end());
  first.erase();
}

Value GridFormer::createWriter(Location at, FlatSymbolRefAttr other) {
  rewriter.setInsertionPoint(unitEnd);
  return other ? LogOfOp::create(rewriter, at, log, other).getResult() : log;
}

void piko::dropEnds(KernelOp kernel, gpu::LaunchOp launch) {
  SmallVector<NextOp> ends;
  bool emits = false;
  launch.walk([&](Operation *op) {
    if (auto next = dyn_cast<NextOp>(op))
      ends.push_back(next);
    emits |= isa<AppendOp, AppendBinOp>(op);
  });
  if (!emits || !needsPositions(kernel))
    for (NextOp end : ends)
      end.erase();
}
