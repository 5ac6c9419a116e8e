//===- PhaseImporter.h - A phase from LLVM IR to MLIR -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Blocks in reverse post-order, phis as block arguments, then terminators.
// Numbers are ScalarImport's. The blocks of a parallelFor become the region of
// one operation, which stands where the loop's header was.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_IMPORT_PHASEIMPORTER_H
#define PIKO_LIB_FRONTEND_IMPORT_PHASEIMPORTER_H

#include "Cleanup/ParallelLoops.h"
#include "Import/MemoryImporter.h"

namespace piko {

class PhaseImporter : protected MemoryImporter {
public:
  PhaseImporter(llvm::Function &source, WrapperKind phase, unsigned stage,
                ParsedUnit &unit, MemoryMap &memory,
                mlir::MLIRContext &context);

  mlir::OwningOpRef<mlir::func::FuncOp> run();

private:
  // Import.cpp: blocks, instructions and branches.
  mlir::Type getInputType();
  void makeBlock(llvm::BasicBlock *block);
  llvm::LogicalResult importBlock(llvm::BasicBlock *block);
  llvm::LogicalResult importInstruction(llvm::Instruction *instruction);
  mlir::Block *getTarget(llvm::BasicBlock *from, llvm::BasicBlock *to);
  llvm::SmallVector<mlir::Value> getArguments(llvm::BasicBlock *from,
                                              llvm::BasicBlock *to);
  llvm::LogicalResult importTerminator(llvm::Instruction *terminator);

  // ImportLoops.cpp: parallelFor and barriers.
  struct LoopRegion {
    /// What becomes the body of the operation.
    std::unique_ptr<mlir::Region> body;
    mlir::Block *entry = nullptr, *end = nullptr;
  };
  void makeLoop(const ParallelLoop *loop);
  llvm::LogicalResult importLoop(const ParallelLoop *loop);
  llvm::LogicalResult checkLoop(const ParallelLoop *loop);
  /// The box of one over pixels; null for one by number.
  llvm::CallInst *getBox(const ParallelLoop *loop);
  mlir::Operation *makePixels(llvm::CallInst *box);
  llvm::LogicalResult importCellAt(llvm::CallInst *call);
  void importLoopExit(const ParallelLoop *loop);
  llvm::LogicalResult checkBarrier(llvm::CallInst *call, llvm::StringRef what);
  llvm::LogicalResult importCombination(llvm::CallInst *call,
                                        llvm::StringRef name);
  llvm::LogicalResult importSort(llvm::CallInst *call, bool isSigned);

  // ImportMarkers.cpp: bins, lists and directives.
  llvm::LogicalResult importMarker(llvm::CallInst *call, const Marker &marker);
  llvm::LogicalResult importQuery(llvm::CallInst *call, const Marker &marker);
  llvm::LogicalResult importDirective(llvm::CallInst *call,
                                      const Marker &marker);
  llvm::LogicalResult importAssignment(llvm::CallInst *call,
                                       const Assignment &assignment);
  llvm::LogicalResult importScheduleDirective(llvm::CallInst *call,
                                              const Marker &marker);

  ParallelLoops loops;
  mlir::OwningOpRef<mlir::func::FuncOp> function;
  /// A loop's header is the block before it, with the operation.
  llvm::DenseMap<llvm::BasicBlock *, mlir::Block *> blocks;
  llvm::DenseMap<const ParallelLoop *, LoopRegion> loopRegions;
  /// The first block of the loop over pixels whose counter it is.
  llvm::DenseMap<const llvm::Value *, mlir::Block *> cells;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_PHASEIMPORTER_H
