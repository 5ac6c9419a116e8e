//===- ExpandMarkers.cpp - From pointers to records to their numbers ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A marker that takes a pointer to a record becomes an accessor that takes the
// record's numbers, loaded one by one: no pointer escapes. An update's pixel
// is a local variable, filled when it begins and read when it ends.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"
#include "Support/Accessors.h"

#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/Module.h"

using namespace piko;

namespace {

class MarkerExpander {
public:
  MarkerExpander(llvm::Function &function, MemoryMap &memory, bool isWiring)
      : function(function), memory(memory), isWiring(isWiring),
        builder(function.getContext()) {}

  void run() {
    llvm::SmallVector<llvm::CallInst *> calls;
    for (llvm::Instruction &instruction : llvm::instructions(function))
      if (auto *call = llvm::dyn_cast<llvm::CallInst>(&instruction))
        calls.push_back(call);
    for (llvm::CallInst *call : calls)
      if (const Marker *marker = getMarker(call, memory.markers))
        expand(call, *marker);
  }

private:
  void expand(llvm::CallInst *call, const Marker &marker) {
    builder.SetInsertPoint(call);
    switch (marker.kind) {
    case MarkerKind::emit: {
      llvm::SmallVector<llvm::Value *> values = {
          call->getArgOperand(0), builder.getInt32(marker.record)};
      loadRecord(call->getArgOperand(1), marker.record, values);
      callAccessor(accessor::emit, builder.getVoidTy(), values);
      break;
    }
    case MarkerKind::clear: {
      llvm::SmallVector<llvm::Value *> values;
      loadRecord(call->getArgOperand(0), marker.record, values);
      callAccessor(accessor::clear, builder.getVoidTy(), values);
      break;
    }
    case MarkerKind::updateBegin:
      expandBegin(call, marker);
      break;
    case MarkerKind::reduceBegin:
    case MarkerKind::scanBegin:
    case MarkerKind::combineEnd:
      expandCombination(call, marker);
      break;
    case MarkerKind::updateEnd: {
      llvm::SmallVector<llvm::Value *> values;
      loadRecord(call->getArgOperand(0), marker.record, values);
      callAccessor(accessor::updateEnd, builder.getVoidTy(), values);
      callAccessor(accessor::pixelEnd, builder.getVoidTy(),
                   {call->getArgOperand(0)});
      break;
    }
    case MarkerKind::source:
    case MarkerKind::connect:
    case MarkerKind::allocateForSource:
    case MarkerKind::expectIndex:
      // The pipeline's constructor, run again inside a phase.
      if (isWiring)
        return;
      break;
    default:
      return;
    }
    call->eraseFromParent();
  }

  void expandBegin(llvm::CallInst *call, const Marker &marker) {
    llvm::SmallVector<llvm::Value *> arguments(llvm::drop_begin(call->args()));
    llvm::Value *token =
        callAccessor(accessor::updateBegin, builder.getInt64Ty(), arguments);
    callAccessor(accessor::pixelBegin, builder.getVoidTy(),
                 {call->getArgOperand(0)});
    unsigned number = 0;
    storeRecord(call->getArgOperand(0), marker.record, token, number);
  }

  void expandCombination(llvm::CallInst *call, const Marker &marker) {
    bool isEnd = marker.kind == MarkerKind::combineEnd;
    llvm::SmallVector<llvm::Value *> values;
    loadRecord(call->getArgOperand(isEnd ? 0 : 2), marker.record, values);
    if (marker.kind == MarkerKind::scanBegin)
      loadRecord(call->getArgOperand(3), marker.record, values);
    llvm::Value *token = callAccessor(isEnd ? accessor::combineEnd
                                      : marker.kind == MarkerKind::scanBegin
                                          ? accessor::scanBegin
                                          : accessor::reduceBegin,
                                      builder.getInt64Ty(), values);
    unsigned number = 0;
    storeRecord(call->getArgOperand(isEnd ? 1 : 0), marker.record, token,
                number);
    if (!isEnd)
      storeRecord(call->getArgOperand(1), marker.record, token, number);
  }

  /// Fills a record with the numbers that an accessor gives, from `number` on.
  void storeRecord(llvm::Value *pointer, unsigned record, llvm::Value *token,
                   unsigned &number) {
    for (const MemoryPiece &piece : getRecordPieces(record)) {
      std::string name = accessor::given.str();
      llvm::raw_string_ostream(name) << *piece.type;
      llvm::Value *value =
          callAccessor(name, piece.type, {token, builder.getInt32(number++)});
      builder.CreateStore(value, at(pointer, piece.offset));
    }
  }

  llvm::SmallVector<MemoryPiece> getRecordPieces(unsigned record) {
    const MemoryLayout &layout = memory.getRecordLayout(record);
    llvm::SmallVector<MemoryPiece> pieces;
    for (const MemoryLeaf &leaf : layout.leaves)
      for (int64_t i = 0, e = leaf.getElementCount(); i < e; ++i) {
        int64_t offset = leaf.offset, rest = i;
        for (const MemoryDimension &dimension :
             llvm::reverse(leaf.dimensions)) {
          offset += rest % dimension.count * dimension.stride;
          rest /= dimension.count;
        }
        pieces.push_back({offset, leaf.type});
      }
    return pieces;
  }

  llvm::Value *at(llvm::Value *pointer, int64_t offset) {
    return makeMemberAddress(builder, pointer, offset);
  }

  void loadRecord(llvm::Value *pointer, unsigned record,
                  llvm::SmallVectorImpl<llvm::Value *> &values) {
    for (const MemoryPiece &piece : getRecordPieces(record))
      values.push_back(
          builder.CreateLoad(piece.type, at(pointer, piece.offset)));
  }

  llvm::CallInst *callAccessor(llvm::StringRef name, llvm::Type *result,
                               llvm::ArrayRef<llvm::Value *> arguments) {
    llvm::FunctionCallee callee = function.getParent()->getOrInsertFunction(
        name, llvm::FunctionType::get(result, /*isVarArg=*/true));
    auto *declaration = llvm::cast<llvm::Function>(callee.getCallee());
    declaration->setDoesNotThrow();
    declaration->setWillReturn();
    // An update reads and writes what other calls read, and other iterations
    // come to a barrier: nothing moves past their ends.
    if (!llvm::is_contained({accessor::updateBegin, accessor::updateEnd,
                             accessor::reduceBegin, accessor::scanBegin,
                             accessor::combineEnd},
                            name))
      declaration->setOnlyAccessesInaccessibleMemory();
    setInPlace(*declaration);
    return builder.CreateCall(callee, arguments);
  }

  llvm::Function &function;
  MemoryMap &memory;
  bool isWiring;
  llvm::IRBuilder<> builder;
};

} // namespace

void piko::expandMarkers(llvm::Function &function, MemoryMap &memory,
                         bool isWiring) {
  MarkerExpander(function, memory, isWiring).run();
}
