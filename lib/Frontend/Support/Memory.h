//===- Memory.h - What pointers in a phase's LLVM IR point to ---*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pointer in a phase points into a local variable, a constant table, or
// memory that a marker gave. Either way there is a layout: leaves, which are
// numbers or arrays of numbers at fixed places.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_SUPPORT_MEMORY_H
#define PIKO_LIB_FRONTEND_SUPPORT_MEMORY_H

#include "Piko/Frontend/PipelineDescription.h"
#include "Support/Markers.h"
#include "llvm/ADT/DenseMap.h"
#include "llvm/ADT/SmallVector.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/ValueHandle.h"

namespace piko {

struct MemoryDimension {
  int64_t count, stride;
};

struct MemoryLeaf {
  llvm::Type *type;
  int64_t offset;
  llvm::SmallVector<MemoryDimension, 2> dimensions;

  int64_t getElementCount() const {
    int64_t count = 1;
    for (const MemoryDimension &dimension : dimensions)
      count *= dimension.count;
    return count;
  }
};

struct MemoryLayout {
  int64_t size = 0;
  std::vector<MemoryLeaf> leaves;
};

/// The layouts of LLVM's types.
MemoryLayout getLayout(llvm::Type *type, const llvm::DataLayout &data);
/// The LLVM type of a leaf field.
llvm::Type *getScalarType(ScalarType type, llvm::LLVMContext &context);

/// base + offset + sum of value * scale, in bytes. The constant part alone does
/// not say which of a record's arrays a variable index is of: `v[i - 1]` has
/// one that points before `v`.
struct Address {
  llvm::Value *base = nullptr;
  int64_t offset = 0;
  llvm::SmallVector<std::pair<llvm::Value *, int64_t>, 2> terms = {};

  /// The part of `offset` that members add: where the first element is.
  int64_t member = 0;
  /// The part of it that leads to a base class or along an array of bytes.
  int64_t unclear = 0;
  /// The parts of it that elements of a size add, as a count and that size.
  llvm::SmallVector<std::pair<int64_t, int64_t>, 2> steps = {};
};

/// Follows address arithmetic to where it begins.
Address getAddress(llvm::Value *pointer, const llvm::DataLayout &data);

/// What an index of a step is, if it is known: a constant, also a held one.
std::optional<int64_t> getConstantIndex(const llvm::Value *index);

/// Keeps LLVM's passes from taking members for elements at the same place;
/// before each of them that compares addresses.
void holdMembers(llvm::Function &function);
/// Ends this, for all memory or for local variables alone.
void releaseMembers(llvm::Function &function, bool onlyLocal = false);

/// The address of what is `offset` bytes into a record: a member of it.
llvm::Value *makeMemberAddress(llvm::IRBuilderBase &builder,
                               llvm::Value *record, int64_t offset);

/// An index of a leaf array: constant + sum of value * factor.
struct MemoryIndex {
  int64_t constant = 0;
  llvm::SmallVector<std::pair<llvm::Value *, int64_t>, 1> terms;

  /// As an i64.
  llvm::Value *materialize(llvm::IRBuilderBase &builder) const;
};

/// How many bytes an address is from its base.
llvm::Value *makeOffset(const Address &address, llvm::IRBuilderBase &builder);

/// One number in memory.
struct MemoryAccess {
  unsigned leaf;
  llvm::SmallVector<MemoryIndex, 2> indices;
};

/// The number of `size` bytes at an address; none if no leaf is exactly there,
/// or if it cannot be told which one's elements a variable index counts.
std::optional<MemoryAccess> resolveAccess(const MemoryLayout &layout,
                                          const Address &address, int64_t size);

/// A number at a place relative to a pointer.
struct MemoryPiece {
  int64_t offset;
  llvm::Type *type;
};

/// The numbers in `size` bytes at an address, relative to it; none if a number
/// lies only partly in them, or if there are more than `limit`.
std::optional<llvm::SmallVector<MemoryPiece>>
getPieces(const MemoryLayout &layout, const Address &address, int64_t size,
          int64_t limit);

/// Where memory begins, and its layout.
class MemoryMap {
public:
  MemoryMap(const PipelineDescription &pipeline, const MarkerTable &markers,
            const llvm::DataLayout &data, llvm::LLVMContext &context);

  /// The layout of what `base` points to, or null if that is not known.
  const MemoryLayout *getLayout(const llvm::Value *base);
  const MemoryLayout &getRecordLayout(unsigned record) const {
    return recordLayouts[record];
  }
  const MemoryLayout &getTypeLayout(llvm::Type *type);

  /// The piece of state at an address that markers give, or null.
  const StateDescription *getState(llvm::Value *handle) const;
  /// Whether an index that is not known chooses it.
  bool isChosenState(llvm::Value *handle) const;
  /// For leaves of the state's layout: which constant's field it is.
  std::pair<unsigned, unsigned> getConstantField(unsigned leaf) const {
    return constantFields[leaf];
  }
  /// The marker that gave `base`, or null.
  const Marker *getBaseMarker(const llvm::Value *base) const;

  const PipelineDescription &pipeline;
  const MarkerTable &markers;
  const llvm::DataLayout &data;
  /// The pipeline object of each wrapper; null once it is taken apart.
  llvm::DenseMap<const llvm::Function *, llvm::WeakVH> objects;

private:
  std::vector<MemoryLayout> recordLayouts;
  MemoryLayout stateLayout;
  std::vector<std::pair<unsigned, unsigned>> constantFields;
  llvm::DenseMap<llvm::Type *, std::unique_ptr<MemoryLayout>> typeLayouts;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_SUPPORT_MEMORY_H
