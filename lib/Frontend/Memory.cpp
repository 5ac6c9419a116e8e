//===- Memory.cpp - What pointers in a phase's LLVM IR point to -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Memory.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/IR/GlobalVariable.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/Operator.h"
#include "llvm/IR/PatternMatch.h"
#include "llvm/Support/MathExtras.h"

using namespace piko;
using llvm::dyn_cast;

//===----------------------------------------------------------------------===//
// Layouts
//===----------------------------------------------------------------------===//

static void addLeaves(llvm::Type *type, int64_t offset,
                      const llvm::SmallVector<MemoryDimension, 2> &dimensions,
                      const llvm::DataLayout &data, MemoryLayout &layout) {
  if (auto *structure = dyn_cast<llvm::StructType>(type)) {
    const llvm::StructLayout *fields = data.getStructLayout(structure);
    for (unsigned i = 0; i < structure->getNumElements(); ++i)
      addLeaves(structure->getElementType(i),
                offset + fields->getElementOffset(i), dimensions, data, layout);
  } else if (auto *array = dyn_cast<llvm::ArrayType>(type)) {
    auto inner = dimensions;
    inner.push_back(
        {static_cast<int64_t>(array->getNumElements()),
         static_cast<int64_t>(data.getTypeAllocSize(array->getElementType()))});
    addLeaves(array->getElementType(), offset, inner, data, layout);
  } else {
    layout.leaves.push_back({type, offset, dimensions});
  }
}

MemoryLayout piko::getLayout(llvm::Type *type, const llvm::DataLayout &data) {
  MemoryLayout layout;
  layout.size = data.getTypeAllocSize(type);
  addLeaves(type, 0, {}, data, layout);
  return layout;
}

llvm::Type *piko::getScalarType(ScalarType type, llvm::LLVMContext &context) {
  switch (type) {
  case ScalarType::F32:
    return llvm::Type::getFloatTy(context);
  case ScalarType::F64:
    return llvm::Type::getDoubleTy(context);
  case ScalarType::I8:
    return llvm::Type::getInt8Ty(context);
  case ScalarType::I16:
    return llvm::Type::getInt16Ty(context);
  case ScalarType::I32:
    return llvm::Type::getInt32Ty(context);
  case ScalarType::I64:
    return llvm::Type::getInt64Ty(context);
  }
  llvm_unreachable("all scalar types are listed");
}

static MemoryLayout getLayout(const RecordDescription &record,
                              llvm::LLVMContext &context) {
  MemoryLayout layout;
  layout.size = record.size;
  for (const LeafField &field : record.fields) {
    MemoryLeaf leaf{getScalarType(field.type, context), field.offset, {}};
    for (auto [count, stride] : llvm::zip(field.counts, field.strides))
      leaf.dimensions.push_back({count, stride});
    layout.leaves.push_back(std::move(leaf));
  }
  return layout;
}

//===----------------------------------------------------------------------===//
// Addresses
//===----------------------------------------------------------------------===//

/// x * constant, as a value and a factor.
static std::pair<llvm::Value *, int64_t> splitFactor(llvm::Value *value) {
  using namespace llvm::PatternMatch;
  llvm::Value *inner;
  const llvm::APInt *constant;
  if (value->getType()->isIntegerTy(64)) {
    if (match(value, m_Mul(m_Value(inner), m_APInt(constant))))
      return {inner, constant->getSExtValue()};
    if (match(value, m_Shl(m_Value(inner), m_APInt(constant))) &&
        constant->ult(62))
      return {inner, int64_t(1) << constant->getZExtValue()};
  }
  return {value, 1};
}

Address piko::getAddress(llvm::Value *pointer, const llvm::DataLayout &data) {
  Address address;
  llvm::MapVector<llvm::Value *, int64_t> terms;
  while (auto *step = dyn_cast<llvm::GEPOperator>(pointer)) {
    unsigned width = data.getIndexTypeSizeInBits(step->getType());
    llvm::SmallMapVector<llvm::Value *, llvm::APInt, 4> variable;
    llvm::APInt constant(width, 0);
    if (!step->collectOffset(data, width, variable, constant))
      break;
    address.offset += constant.getSExtValue();
    for (auto &[index, scale] : variable) {
      auto [value, factor] = splitFactor(index);
      terms[value] += scale.getSExtValue() * factor;
    }
    pointer = step->getPointerOperand();
  }
  address.base = pointer;
  for (auto &[value, scale] : terms)
    address.terms.push_back({value, scale});
  return address;
}

llvm::Value *MemoryIndex::materialize(llvm::IRBuilderBase &builder) const {
  llvm::Value *sum = nullptr;
  for (auto [value, factor] : terms) {
    llvm::Value *term = builder.CreateSExtOrTrunc(value, builder.getInt64Ty());
    if (factor != 1)
      term = builder.CreateMul(term, builder.getInt64(factor));
    sum = sum ? builder.CreateAdd(sum, term) : term;
  }
  if (!sum)
    return builder.getInt64(constant);
  return constant ? builder.CreateAdd(sum, builder.getInt64(constant)) : sum;
}

/// Divides an address among the dimensions of a leaf. `inside` says whether the
/// constant part is within the array.
static std::optional<MemoryAccess>
matchLeaf(const MemoryLeaf &leaf, const Address &address, bool &inside) {
  MemoryAccess access{0, {}};
  int64_t rest = address.offset - leaf.offset;
  inside = true;
  llvm::SmallVector<std::pair<llvm::Value *, int64_t>, 2> terms(
      address.terms.begin(), address.terms.end());
  for (const MemoryDimension &dimension : leaf.dimensions) {
    MemoryIndex index;
    // A term belongs to the outermost dimension whose stride divides its scale.
    llvm::erase_if(terms, [&](auto &term) {
      if (dimension.stride == 0 || term.second % dimension.stride != 0)
        return false;
      index.terms.push_back({term.first, term.second / dimension.stride});
      return true;
    });
    index.constant = dimension.stride == 0
                         ? 0
                         : llvm::divideFloorSigned(rest, dimension.stride);
    rest -= index.constant * dimension.stride;
    inside &= index.constant >= 0 && index.constant < dimension.count;
    if (!inside && index.terms.empty())
      return std::nullopt;
    access.indices.push_back(std::move(index));
  }
  if (rest != 0 || !terms.empty())
    return std::nullopt;
  return access;
}

std::optional<MemoryAccess> piko::resolveAccess(const MemoryLayout &layout,
                                                const Address &address,
                                                int64_t size) {
  std::optional<MemoryAccess> outside;
  for (auto [number, leaf] : llvm::enumerate(layout.leaves)) {
    if (static_cast<int64_t>(leaf.type->getPrimitiveSizeInBits() + 7) / 8 !=
            size &&
        !(leaf.type->isPointerTy() && size == 8))
      continue;
    bool inside;
    std::optional<MemoryAccess> access = matchLeaf(leaf, address, inside);
    if (!access)
      continue;
    access->leaf = number;
    if (inside)
      return access;
    if (!outside)
      outside = access;
  }
  return outside;
}

std::optional<llvm::SmallVector<MemoryPiece>>
piko::getPieces(const MemoryLayout &layout, const Address &address,
                int64_t size, int64_t limit) {
  // What a variable index selects looks the same at each index.
  int64_t begin = address.offset, end = begin + size;
  llvm::SmallVector<MemoryPiece> pieces;
  for (const MemoryLeaf &leaf : layout.leaves) {
    int64_t bytes = leaf.type->isPointerTy()
                        ? 8
                        : (leaf.type->getPrimitiveSizeInBits() + 7) / 8;
    int64_t count = leaf.getElementCount();
    for (int64_t i = 0; i < count; ++i) {
      int64_t at = leaf.offset, rest = i;
      for (const MemoryDimension &dimension : llvm::reverse(leaf.dimensions)) {
        at += rest % dimension.count * dimension.stride;
        rest /= dimension.count;
      }
      if (at + bytes <= begin || at >= end)
        continue;
      if (at < begin || at + bytes > end)
        return std::nullopt;
      pieces.push_back({at - begin, leaf.type});
      if (static_cast<int64_t>(pieces.size()) > limit)
        return std::nullopt;
    }
  }
  return pieces;
}

//===----------------------------------------------------------------------===//
// The map
//===----------------------------------------------------------------------===//

MemoryMap::MemoryMap(const PipelineDescription &pipeline,
                     const MarkerTable &markers, const llvm::DataLayout &data,
                     llvm::LLVMContext &context)
    : pipeline(pipeline), markers(markers), data(data) {
  for (const RecordDescription &record : pipeline.records)
    recordLayouts.push_back(::getLayout(record, context));
  for (auto [number, state] : llvm::enumerate(pipeline.state)) {
    if (state.kind != StateDescription::Constant)
      continue;
    const MemoryLayout &constant = recordLayouts[state.record];
    for (auto [field, leaf] : llvm::enumerate(constant.leaves)) {
      stateLayout.leaves.push_back(leaf);
      stateLayout.leaves.back().offset += state.offset;
      constantFields.push_back({number, field});
    }
    stateLayout.size = std::max(stateLayout.size, state.offset + constant.size);
  }
}

const Marker *MemoryMap::getBaseMarker(const llvm::Value *base) const {
  const auto *call = dyn_cast<llvm::CallBase>(base);
  return call ? getMarker(call, markers) : nullptr;
}

const MemoryLayout &MemoryMap::getTypeLayout(llvm::Type *type) {
  std::unique_ptr<MemoryLayout> &layout = typeLayouts[type];
  if (!layout)
    layout = std::make_unique<MemoryLayout>(piko::getLayout(type, data));
  return *layout;
}

const MemoryLayout *MemoryMap::getLayout(const llvm::Value *base) {
  if (const auto *variable = dyn_cast<llvm::AllocaInst>(base)) {
    if (variable->isArrayAllocation())
      return nullptr;
    return &getTypeLayout(variable->getAllocatedType());
  }
  if (const auto *table = dyn_cast<llvm::GlobalVariable>(base))
    return table->isConstant() ? &getTypeLayout(table->getValueType())
                               : nullptr;
  const Marker *marker = getBaseMarker(base);
  if (!marker)
    return nullptr;
  switch (marker->kind) {
  case MarkerKind::state:
    return &stateLayout;
  case MarkerKind::input:
  case MarkerKind::element:
  case MarkerKind::listAt:
    return &recordLayouts[marker->record];
  default:
    return nullptr;
  }
}

const StateDescription *MemoryMap::getState(llvm::Value *handle) const {
  Address address = getAddress(handle, data);
  const Marker *marker = getBaseMarker(address.base);
  if (!marker || marker->kind != MarkerKind::state || !address.terms.empty())
    return nullptr;
  for (const StateDescription &state : pipeline.state)
    if (state.offset == address.offset &&
        state.kind != StateDescription::Constant)
      return &state;
  return nullptr;
}
