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
#include "Import/Import.h"
#include "Import/ScalarImport.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Whether an instruction asks where a pointer points to.
inline bool isPlaceUse(const llvm::Instruction *instruction) {
  return llvm::isa<llvm::PtrToIntInst>(instruction) ||
         (llvm::isa<llvm::ICmpInst>(instruction) &&
          instruction->getOperand(0)->getType()->isPointerTy());
}
constexpr llvm::StringLiteral comparedPlaces =
    "comparing or subtracting pointers that are not known to point into one "
    "array; compare indices";

class PhaseImporter {
public:
  PhaseImporter(llvm::Function &source, WrapperKind phase, unsigned stage,
                ParsedUnit &unit, MemoryMap &memory,
                mlir::MLIRContext &context);

  mlir::OwningOpRef<mlir::func::FuncOp> run();

private:
  mlir::InFlightDiagnostic fail(const llvm::Instruction *instruction);
  llvm::LogicalResult reject(const llvm::Instruction *instruction,
                             const llvm::Twine &what);
  /// Reports what is for another phase.
  llvm::LogicalResult expectPhase(const llvm::Instruction *instruction,
                                  WrapperKind expected, llvm::StringRef what);
  void setLocation(const llvm::Instruction *instruction);

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
  mlir::func::CallOp makePlaceholder(llvm::StringRef name, llvm::CallInst *call,
                                     unsigned count);

  // ImportMemory.cpp: local arrays, state and primitives.
  struct MemoryPlace {
    const StateDescription *state = nullptr; ///< null = a primitive
    mlir::Value prim;
    llvm::SmallVector<mlir::Value> indices, elements;
    llvm::StringRef field;
  };
  llvm::LogicalResult rejectVariable(llvm::AllocaInst *variable);
  llvm::LogicalResult importArray(llvm::AllocaInst *variable);
  llvm::LogicalResult checkLocalSize(llvm::AllocaInst *variable);
  llvm::LogicalResult importDivision(llvm::CallInst *call, unsigned opcode);
  mlir::Value makeElementIndex(const Address &address, int64_t size);
  llvm::LogicalResult importArrayAccess(llvm::Instruction *instruction);
  const StateDescription *getState(llvm::CallInst *user, llvm::Value *handle);
  llvm::SmallVector<mlir::Value>
  getCoordinates(llvm::iterator_range<llvm::User::op_iterator> operands,
                 int64_t rank);
  llvm::LogicalResult getPlace(llvm::CallInst *call, unsigned firstElement,
                               MemoryPlace &place);
  llvm::LogicalResult importAccessor(llvm::CallInst *call,
                                     llvm::StringRef name);
  llvm::LogicalResult importLoad(llvm::CallInst *call);
  llvm::LogicalResult importStore(llvm::CallInst *call);
  /// For an atomic that shows the order of primitives.
  llvm::LogicalResult expectUnordered(llvm::CallInst *call, bool isFetch);
  llvm::LogicalResult importAtomic(llvm::CallInst *call);
  llvm::LogicalResult importUpdateBegin(llvm::CallInst *call);
  llvm::LogicalResult importEmit(llvm::CallInst *call);

  // ImportMarkers.cpp: bins, lists and directives.
  llvm::LogicalResult importMarker(llvm::CallInst *call, const Marker &marker);
  llvm::LogicalResult importQuery(llvm::CallInst *call, const Marker &marker);
  llvm::LogicalResult importDirective(llvm::CallInst *call,
                                      const Marker &marker);
  llvm::LogicalResult importAssignment(llvm::CallInst *call,
                                       const marker::Assignment &assignment);
  llvm::LogicalResult importScheduleDirective(llvm::CallInst *call,
                                              const Marker &marker);
  int64_t getRank() const { return unit.pipeline.rank; }
  llvm::LogicalResult setIndex(llvm::CallInst *call, mlir::Value index);
  mlir::Value getIndex(llvm::CallInst *call, unsigned operand);
  static int64_t getConstant(llvm::CallInst *call, unsigned operand);

  template <typename OpT, typename... Args> OpT make(Args &&...args) {
    return OpT::create(builder, *location, std::forward<Args>(args)...);
  }

  llvm::Function &source;
  WrapperKind phase;
  const StageDescription &stage;
  ParsedUnit &unit;
  MemoryMap &memory;
  mlir::MLIRContext &context;
  ParallelLoops loops;
  mlir::OpBuilder builder;
  ValueMap values;
  ScalarImporter scalars;
  std::optional<mlir::Location> location;
  mlir::OwningOpRef<mlir::func::FuncOp> function;
  mlir::Block *entry = nullptr;
  /// A loop's header is the block before it, with the operation.
  llvm::DenseMap<llvm::BasicBlock *, mlir::Block *> blocks;
  llvm::DenseMap<const ParallelLoop *, LoopRegion> loopRegions;
  /// The first block of the loop over pixels whose counter it is.
  llvm::DenseMap<const llvm::Value *, mlir::Block *> cells;
  /// The first block of the loop of that number.
  llvm::DenseMap<int64_t, mlir::Block *> loopEntries;
  llvm::DenseMap<llvm::Value *, mlir::Value> arrays;
  int64_t localBytes = 0; ///< Of all arrays.
  llvm::DenseMap<llvm::CallInst *, mlir::func::CallOp> placeholders;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_PHASEIMPORTER_H
