//===- Memory.cpp - What pointers in a phase's LLVM IR point to -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Support/Memory.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/IR/GetElementPtrTypeIterator.h"
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

/// Adds the constant indices of a step, as members and elements.
static void addConstants(llvm::GEPOperator *step, const llvm::DataLayout &data,
                         Address &address) {
  for (auto part = llvm::gep_type_begin(step), end = llvm::gep_type_end(step);
       part != end; ++part) {
    std::optional<int64_t> number = getConstantIndex(part.getOperand());
    if (!number || *number == 0)
      continue;
    if (llvm::StructType *structure = part.getStructTypeOrNull())
      address.member += data.getStructLayout(structure)->getElementOffset(
          static_cast<unsigned>(*number));
    else
      address.steps.push_back(
          {*number, part.getSequentialElementStride(data).getFixedValue()});
  }
}

/// What the steps from the base say about its constant part. Clang writes the
/// way to a base class like a step along an array of bytes; what the pointer
/// points to before and after it may tell them apart.
static void addSteps(llvm::ArrayRef<llvm::GEPOperator *> steps,
                     const llvm::DataLayout &data, Address &address) {
  llvm::Type *pointee = nullptr;
  for (llvm::GEPOperator *step : llvm::reverse(steps)) {
    llvm::Type *type = step->getSourceElementType();
    std::optional<int64_t> bytes = getConstantIndex(step->getOperand(1));
    // A step over elements of so many bytes, as indexed pointers are.
    bool isUntyped = type->isArrayTy() && step->getNumIndices() == 1 &&
                     type->getArrayElementType()->isIntegerTy(8);
    if (isUntyped && data.getTypeAllocSize(type) == 1) {
      addConstants(step, data, address);
      if (!bytes)
        pointee = llvm::Type::getInt8Ty(type->getContext());
      continue;
    }
    if (!type->isIntegerTy(8)) {
      address.member += address.unclear;
      address.unclear = 0;
      addConstants(step, data, address);
      if (!isUntyped)
        pointee = step->getResultElementType();
      continue;
    }
    if (!bytes)
      pointee = type;
    else if (!pointee)
      address.unclear += *bytes;
    else if (pointee->isStructTy())
      address.member += *bytes;
    else
      address.steps.push_back({*bytes, 1});
    if (pointee && pointee->isStructTy())
      pointee = nullptr;
  }
}

Address piko::getAddress(llvm::Value *pointer, const llvm::DataLayout &data) {
  Address address;
  llvm::SmallVector<llvm::GEPOperator *> steps;
  while (auto *step = dyn_cast<llvm::GEPOperator>(pointer)) {
    unsigned width = data.getIndexTypeSizeInBits(step->getType());
    llvm::SmallMapVector<llvm::Value *, llvm::APInt, 4> variable;
    llvm::APInt constant(width, 0);
    if (!step->collectOffset(data, width, variable, constant))
      break;
    address.offset += constant.getSExtValue();
    for (auto &[index, scale] : variable) {
      if (std::optional<int64_t> held = getConstantIndex(index)) {
        address.offset += *held * scale.getSExtValue();
        continue;
      }
      auto [value, factor] = splitFactor(index);
      // One number may be an index of two dimensions: they stay apart.
      address.terms.push_back({value, scale.getSExtValue() * factor});
    }
    steps.push_back(step);
    pointer = step->getPointerOperand();
  }
  address.base = pointer;
  addSteps(steps, data, address);
  return address;
}

llvm::Value *piko::makeMemberAddress(llvm::IRBuilderBase &builder,
                                     llvm::Value *record, int64_t offset) {
  if (offset == 0)
    return record;
  llvm::Type *byte = builder.getInt8Ty();
  return builder.CreateStructGEP(
      llvm::StructType::get(llvm::ArrayType::get(byte, offset), byte), record,
      1);
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

llvm::Value *piko::makeOffset(const Address &address,
                              llvm::IRBuilderBase &builder) {
  MemoryIndex offset{address.offset, {}};
  for (auto [value, scale] : address.terms)
    offset.terms.push_back({value, scale});
  return offset.materialize(builder);
}

/// The element of a leaf at an offset in its record.
static std::optional<MemoryAccess> matchLeaf(const MemoryLeaf &leaf,
                                             int64_t offset) {
  MemoryAccess access{0, {}};
  int64_t rest = offset - leaf.offset;
  for (auto [count, stride] : leaf.dimensions) {
    int64_t index = stride == 0 ? 0 : llvm::divideFloorSigned(rest, stride);
    rest -= index * stride;
    if (index < 0 || index >= count)
      return std::nullopt;
    access.indices.push_back({index, {}});
  }
  return rest == 0 ? std::optional(access) : std::nullopt;
}

/// Adds so many bytes to the indices of a leaf, those of the outer dimensions
/// first; false if there is a rest.
static bool addBytes(const MemoryLeaf &leaf, int64_t bytes,
                     MemoryAccess &access) {
  for (auto [dimension, index] : llvm::zip(leaf.dimensions, access.indices)) {
    if (dimension.stride == 0)
      continue;
    index.constant += bytes / dimension.stride;
    bytes %= dimension.stride;
  }
  return bytes == 0;
}

/// Divides what is added to the first element among the dimensions of a leaf.
static bool addIndices(const MemoryLeaf &leaf, const Address &address,
                       MemoryAccess &access) {
  // A term belongs to the outermost dimension whose stride divides its scale.
  auto find = [&](int64_t scale) -> std::optional<unsigned> {
    for (auto [number, dimension] : llvm::enumerate(leaf.dimensions))
      if (dimension.stride != 0 && scale % dimension.stride == 0)
        return number;
    return std::nullopt;
  };
  for (auto [value, scale] : address.terms) {
    std::optional<unsigned> number = find(scale);
    if (!number)
      return false;
    access.indices[*number].terms.push_back(
        {value, scale / leaf.dimensions[*number].stride});
  }
  int64_t bytes = 0;
  for (auto [count, scale] : address.steps) {
    if (std::optional<unsigned> number = find(scale))
      access.indices[*number].constant +=
          count * (scale / leaf.dimensions[*number].stride);
    else
      bytes += count * scale;
  }
  return addBytes(leaf, bytes, access);
}

/// The access to the array of which an element is at `member`.
static std::optional<MemoryAccess> resolveElement(const MemoryLayout &layout,
                                                  const Address &address,
                                                  int64_t size,
                                                  int64_t member) {
  for (auto [number, leaf] : llvm::enumerate(layout.leaves)) {
    int64_t bytes =
        leaf.type->isPointerTy()
            ? 8
            : static_cast<int64_t>(leaf.type->getPrimitiveSizeInBits() + 7) / 8;
    if (bytes != size)
      continue;
    std::optional<MemoryAccess> access = matchLeaf(leaf, member);
    if (!access)
      continue;
    access->leaf = number;
    if (addIndices(leaf, address, *access))
      return access;
  }
  return std::nullopt;
}

std::optional<MemoryAccess> piko::resolveAccess(const MemoryLayout &layout,
                                                const Address &address,
                                                int64_t size) {
  if (address.terms.empty())
    return resolveElement(layout, Address{address.base}, size, address.offset);
  std::optional<MemoryAccess> access =
      resolveElement(layout, address, size, address.member + address.unclear);
  if (size != 1 || address.unclear == 0)
    return access;
  Address along = address;
  along.steps.push_back({address.unclear, 1});
  std::optional<MemoryAccess> other =
      resolveElement(layout, along, size, address.member);
  if (access && other && access->leaf != other->leaf)
    return std::nullopt;
  return access ? access : other;
}

std::optional<llvm::SmallVector<MemoryPiece>>
piko::getPieces(const MemoryLayout &layout, const Address &address,
                int64_t size, int64_t limit) {
  // What a variable index selects looks the same at each index.
  int64_t begin =
      address.terms.empty() ? address.offset : address.member + address.unclear;
  int64_t end = begin + size;
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

bool MemoryMap::isChosenState(llvm::Value *handle) const {
  Address address = getAddress(handle, data);
  const Marker *marker = getBaseMarker(address.base);
  return marker && marker->kind == MarkerKind::state && !address.terms.empty();
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
