//===- ImportMemory.cpp - Local arrays, state and primitives --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Cleanup/FillVariables.h"
#include "Cleanup/ParallelLoops.h"
#include "Import/MemoryImporter.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Support/Accessors.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::cast;
using llvm::dyn_cast;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;

//===--------------------------------------------------------------------===//
// Local arrays
//===--------------------------------------------------------------------===//

/// What the local arrays of a phase may take, in bytes: phases that run inside
/// one another share a thread's stack, and a fiber of the reference has 1 MiB.
static constexpr int64_t localLimit = 256 * 1024;

/// The first access to a variable that says where it is: a variable itself does
/// not, and where it begins and ends to live is where its function is called.
static const llvm::Instruction *findLocatedUse(const llvm::Value *pointer) {
  const llvm::Instruction *found = nullptr;
  for (const llvm::User *user : pointer->users()) {
    auto *use = dyn_cast<llvm::Instruction>(user);
    if (use && llvm::isa<llvm::GetElementPtrInst>(use) && !use->getDebugLoc())
      use = findLocatedUse(use);
    if (use && use->getDebugLoc() && !use->isLifetimeStartOrEnd() &&
        (!found ||
         use->getDebugLoc().getLine() < found->getDebugLoc().getLine()))
      found = use;
  }
  return found;
}

/// An access to a part of a variable that is known when it runs.
static const llvm::Instruction *findComputedUse(const llvm::Value *pointer,
                                                int depth = 0) {
  for (const llvm::User *user : pointer->users()) {
    const auto *use = dyn_cast<llvm::Instruction>(user);
    if (!use || depth == 8)
      continue;
    const auto *part = dyn_cast<llvm::GetElementPtrInst>(use);
    if (part && !part->hasAllConstantIndices())
      return part->getDebugLoc() ? part : findLocatedUse(part);
    if (part || llvm::isa<llvm::PHINode, llvm::SelectInst>(use))
      if (const llvm::Instruction *found = findComputedUse(use, depth + 1))
        return found;
  }
  return nullptr;
}

/// What keeps a variable whole, if it is a question of where it is.
static const llvm::Instruction *findPlaceUse(const llvm::Value *pointer,
                                             int depth = 0) {
  for (const llvm::User *user : pointer->users()) {
    const auto *use = dyn_cast<llvm::Instruction>(user);
    if (!use || depth == 8)
      continue;
    if (isPlaceUse(use))
      return use;
    if (llvm::isa<llvm::GetElementPtrInst, llvm::PHINode, llvm::SelectInst>(
            use))
      if (const llvm::Instruction *found = findPlaceUse(use, depth + 1))
        return found;
  }
  return nullptr;
}

/// Where an object is told which virtual functions it has.
static const llvm::Instruction *findVirtual(const llvm::Value *pointer,
                                            int depth = 0) {
  for (const llvm::User *user : pointer->users()) {
    if (auto *store = dyn_cast<llvm::StoreInst>(user)) {
      const auto *table = dyn_cast<llvm::GlobalVariable>(
          store->getValueOperand()->stripInBoundsConstantOffsets());
      if (table && table->getName().starts_with("_ZTV"))
        return store;
    }
    if (depth < 8 && llvm::isa<llvm::GetElementPtrInst>(user))
      if (const llvm::Instruction *found = findVirtual(user, depth + 1))
        return found;
  }
  return nullptr;
}

LogicalResult MemoryImporter::rejectVariable(llvm::AllocaInst *variable) {
  if (const llvm::Instruction *made = findVirtual(variable))
    return reject(made->getDebugLoc() ? made : findLocatedUse(variable),
                  "an object of a class with virtual functions" +
                      getVariableName(variable) +
                      "; use a switch that calls each function by its name");
  if (const llvm::Instruction *use = findPlaceUse(variable))
    return reject(use, comparedPlaces);
  const llvm::Instruction *use = findComputedUse(variable);
  if (!use)
    use = findLocatedUse(variable);
  return reject(use ? use : variable,
                "a local variable" + getVariableName(variable) +
                    " whose parts are accessed in ways that cannot be told "
                    "apart, in stage '" +
                    stage.name +
                    "'; access its members by name and its arrays by index");
}

LogicalResult MemoryImporter::checkLocalSize(llvm::AllocaInst *variable) {
  int64_t size = memory.data.getTypeAllocSize(variable->getAllocatedType());
  localBytes += size;
  if (localBytes <= localLimit)
    return success();
  const llvm::Instruction *use = findLocatedUse(variable);
  return fail(use ? use : variable)
         << "expected the local arrays of a phase to take at most "
         << localLimit << " bytes, but with"
         << (getVariableName(variable).empty() ? " one more"
                                               : getVariableName(variable))
         << " they take " << localBytes;
}

LogicalResult MemoryImporter::importArray(llvm::AllocaInst *variable) {
  llvm::Type *type = variable->getAllocatedType();
  int64_t count = 1;
  while (auto *array = dyn_cast<llvm::ArrayType>(type)) {
    count *= array->getNumElements();
    type = array->getElementType();
  }
  if (variable->isArrayAllocation() || type->isStructTy() ||
      type->isPointerTy())
    return rejectVariable(variable);
  if (failed(checkLocalSize(variable)))
    return failure();
  // What belongs to an iteration begins with it.
  mlir::OpBuilder::InsertionGuard guard(builder);
  mlir::Block *owner = loopEntries.lookup(getOwner(variable));
  builder.setInsertionPointToStart(owner ? owner : entry);
  arrays[variable] = mlir::memref::AllocaOp::create(
      builder, *location,
      mlir::MemRefType::get({count}, scalars.getType(type)));
  return success();
}

/// An address in an array as the index of an element of `size` bytes.
mlir::Value MemoryImporter::makeElementIndex(const Address &address,
                                             int64_t size) {
  // Not every term need be a multiple of the size, though their sum is.
  bool divides = llvm::all_of(
      address.terms, [&](const auto &term) { return term.second % size == 0; });
  int64_t unit = divides ? size : 1;
  mlir::Value index;
  for (auto [value, scale] : address.terms) {
    mlir::Value term = scalars.toIndex(scalars.get(value));
    if (scale != unit)
      term = mlir::arith::MulIOp::create(builder, *location, term,
                                         scalars.makeIndex(scale / unit));
    index = index ? mlir::arith::AddIOp::create(builder, *location, index, term)
                  : term;
  }
  if (!index)
    return scalars.makeIndex(address.offset / size);
  if (address.offset)
    index = mlir::arith::AddIOp::create(
        builder, *location, index, scalars.makeIndex(address.offset / unit));
  if (!divides)
    index = mlir::arith::DivSIOp::create(builder, *location, index,
                                         scalars.makeIndex(size));
  return index;
}

LogicalResult
MemoryImporter::importArrayAccess(llvm::Instruction *instruction) {
  auto *store = dyn_cast<llvm::StoreInst>(instruction);
  if (store && llvm::isa<llvm::UndefValue>(store->getValueOperand()))
    return success();
  Address address = getAddress(
      const_cast<llvm::Value *>(llvm::getLoadStorePointerOperand(instruction)),
      memory.data);
  auto found = arrays.find(address.base);
  if (found == arrays.end())
    return reject(instruction, "access through " + manyPlaces);
  mlir::Value array = found->second;
  mlir::Type element = cast<mlir::MemRefType>(array.getType()).getElementType();
  int64_t size = (element.getIntOrFloatBitWidth() + 7) / 8;
  llvm::Type *accessed = llvm::getLoadStoreType(instruction);
  bool fits =
      !accessed->isPointerTy() && address.offset % size == 0 &&
      accessed->getPrimitiveSizeInBits() == element.getIntOrFloatBitWidth();
  if (!fits)
    return reject(instruction,
                  "access to an array that is not to one of its elements");
  mlir::Value index = makeElementIndex(address, size);
  mlir::Type type = scalars.getType(accessed);
  if (store) {
    mlir::Value value = scalars.get(store->getValueOperand());
    if (type != element)
      value =
          mlir::arith::BitcastOp::create(builder, *location, element, value);
    mlir::memref::StoreOp::create(builder, *location, value, array, index);
    return success();
  }
  mlir::Value value =
      mlir::memref::LoadOp::create(builder, *location, array, index);
  if (type != element)
    value = mlir::arith::BitcastOp::create(builder, *location, type, value);
  values[instruction] = value;
  return success();
}

//===--------------------------------------------------------------------===//
// State and primitives
//===--------------------------------------------------------------------===//

const StateDescription *MemoryImporter::getState(llvm::CallInst *user,
                                                 llvm::Value *handle) {
  const StateDescription *state = memory.getState(handle);
  if (!state)
    reject(user, memory.isChosenState(handle)
                     ? "a buffer or image of an array whose index is not known "
                       "when the pipeline is compiled; write one access for "
                       "each, or take one image of one more dimension"
                     : "a buffer or image that is not a member of the state")
        .failed();
  return state;
}

llvm::SmallVector<mlir::Value> MemoryImporter::getCoordinates(
    llvm::iterator_range<llvm::User::op_iterator> operands, int64_t rank) {
  llvm::SmallVector<mlir::Value> coordinates;
  for (llvm::Value *operand :
       llvm::make_range(operands.begin(), operands.begin() + rank))
    coordinates.push_back(scalars.getCoordinate(operand));
  return coordinates;
}

LogicalResult MemoryImporter::getPlace(llvm::CallInst *call,
                                       unsigned firstElement,
                                       MemoryPlace &place) {
  auto *base = cast<llvm::CallInst>(call->getArgOperand(0));
  unsigned leaf =
      cast<llvm::ConstantInt>(call->getArgOperand(1))->getZExtValue();
  const Marker *marker = getMarker(base, unit.markers);
  unsigned record = marker->record;
  switch (marker->kind) {
  case MarkerKind::state: {
    auto [state, field] = memory.getConstantField(leaf);
    place.state = &unit.pipeline.state[state];
    record = place.state->record;
    leaf = field;
    break;
  }
  case MarkerKind::listAt:
    place.prim = values[base];
    break;
  case MarkerKind::element:
    place.state = getState(call, base->getArgOperand(0));
    if (!place.state)
      return failure();
    place.indices =
        getCoordinates(llvm::drop_begin(base->args()), place.state->rank);
    break;
  default:
    place.prim = entry->getArgument(0);
    break;
  }
  place.field = unit.pipeline.records[record].fields[leaf].name;
  for (llvm::Value *index : llvm::drop_begin(call->args(), firstElement))
    place.elements.push_back(scalars.toIndex(scalars.get(index)));
  return success();
}

static DivisionKind getDivisionKind(unsigned opcode) {
  switch (opcode) {
  case llvm::Instruction::SDiv:
    return DivisionKind::QuotientS;
  case llvm::Instruction::UDiv:
    return DivisionKind::QuotientU;
  case llvm::Instruction::SRem:
    return DivisionKind::RemainderS;
  default:
    return DivisionKind::RemainderU;
  }
}

LogicalResult MemoryImporter::importDivision(llvm::CallInst *call,
                                             unsigned opcode) {
  mlir::Value a = scalars.get(call->getArgOperand(0));
  mlir::Value b = scalars.get(call->getArgOperand(1));
  if (!a || !b || a.getType().getIntOrFloatBitWidth() > 64)
    return reject(call, "a division of integers of more than 64 bits");
  values[call] = make<DivideOp>(getDivisionKind(opcode), a, b, /*of=*/nullptr,
                                /*assign=*/false);
  return success();
}

LogicalResult MemoryImporter::importAccessor(llvm::CallInst *call,
                                             llvm::StringRef name) {
  if (std::optional<unsigned> opcode = getDivision(name))
    return importDivision(call, *opcode);
  if (name.starts_with(undefinedName)) {
    values[call] = UndefinedOp::create(builder, *location,
                                       scalars.getType(call->getType()));
    return success();
  }
  if (name == accessor::emit)
    return importEmit(call);
  if (name == accessor::updateBegin)
    return importUpdateBegin(call);
  if (name == accessor::combineEnd) {
    placeholders[call] = makePlaceholder(combineEndName, call, 1);
    return success();
  }
  if (name.starts_with(accessor::given)) {
    auto *giver = cast<llvm::CallInst>(call->getArgOperand(0));
    values[call] = placeholders[giver].getResult(
        cast<llvm::ConstantInt>(call->getArgOperand(1))->getZExtValue());
    return success();
  }
  if (name == accessor::updateEnd) {
    llvm::SmallVector<mlir::Value> pixel;
    for (llvm::Value *value : call->args())
      pixel.push_back(scalars.get(value));
    mlir::func::CallOp::create(builder, *location, updateEndName,
                               mlir::TypeRange(), pixel);
    return success();
  }
  if (name == accessor::share)
    return success();
  if (name == accessor::showsOrder)
    return expectUnordered(
        call, !cast<llvm::ConstantInt>(call->getArgOperand(0))->isZero());
  if (name.starts_with(accessor::load))
    return importLoad(call);
  if (phase != WrapperKind::Process)
    return fail(call) << "expected the state to be changed in the process "
                         "phase, but stage '"
                      << stage.name << "' changes it in another";
  return name.starts_with(accessor::store) ? importStore(call)
                                           : importAtomic(call);
}

LogicalResult MemoryImporter::importLoad(llvm::CallInst *call) {
  MemoryPlace place;
  if (failed(getPlace(call, 2, place)))
    return failure();
  mlir::Type type = scalars.getType(call->getType());
  if (!place.state) {
    values[call] = make<GetOp>(type, place.prim, place.field, place.elements);
    return success();
  }
  if (phase == WrapperKind::Schedule &&
      place.state->kind != StateDescription::Constant)
    return fail(call) << "expected a schedule to depend on the bin and on "
                         "constants alone, but stage '"
                      << stage.name << "' reads '" << place.state->name << "'";
  values[call] = make<LoadOp>(type, place.state->name, place.indices,
                              place.field, place.elements,
                              /*tile=*/mlir::Value(), /*checked=*/false,
                              /*of=*/nullptr);
  return success();
}

LogicalResult MemoryImporter::importStore(llvm::CallInst *call) {
  MemoryPlace place;
  if (failed(getPlace(call, 3, place)))
    return failure();
  make<StoreOp>(scalars.get(call->getArgOperand(2)), place.state->name,
                place.indices, place.field, place.elements,
                /*tile=*/mlir::Value(), /*checked=*/false, /*of=*/nullptr);
  return success();
}

static AtomicKind getAtomicKind(llvm::CallInst *call) {
  bool isSigned = !cast<llvm::ConstantInt>(call->getArgOperand(3))->isZero();
  switch (cast<llvm::ConstantInt>(call->getArgOperand(2))->getZExtValue()) {
  case 0:
    return AtomicKind::Add;
  case 1:
    return isSigned ? AtomicKind::MinS : AtomicKind::MinU;
  case 2:
    return isSigned ? AtomicKind::MaxS : AtomicKind::MaxU;
  case 3:
    return AtomicKind::And;
  case 4:
    return AtomicKind::Or;
  case 5:
    return AtomicKind::Xor;
  default:
    return AtomicKind::AddF;
  }
}

LogicalResult MemoryImporter::expectUnordered(llvm::CallInst *call,
                                              bool isFetch) {
  if (stage.schedule.says("unordered"))
    return success();
  return fail(call) << "expected "
                    << (isFetch ? "an atomic that returns the old value"
                                : "an atomic on a float")
                    << " in a stage that is Unordered, but stage '"
                    << stage.name
                    << "' is not; say specifyOrder(piko::Unordered) in its "
                       "schedule, or take "
                    << (isFetch ? "one that returns nothing" : "an integer");
}

LogicalResult MemoryImporter::importAtomic(llvm::CallInst *call) {
  MemoryPlace place;
  if (failed(getPlace(call, 5, place)))
    return failure();
  AtomicKind kind = getAtomicKind(call);
  mlir::Type old;
  if (!call->getType()->isVoidTy())
    old = scalars.getType(call->getType());
  if ((old || kind == AtomicKind::AddF) &&
      failed(expectUnordered(call, /*isFetch=*/bool(old))))
    return failure();
  auto op =
      make<AtomicOp>(old, kind, place.state->name, place.indices, place.field,
                     place.elements, scalars.get(call->getArgOperand(4)),
                     /*checked=*/false, /*of=*/nullptr, /*copy=*/nullptr);
  if (old)
    values[call] = op.getOld();
  return success();
}

LogicalResult MemoryImporter::importUpdateBegin(llvm::CallInst *call) {
  if (failed(expectPhase(call, WrapperKind::Process, "update")))
    return failure();
  const StateDescription *state = getState(call, call->getArgOperand(0));
  if (!state)
    return failure();
  const RecordDescription &record = unit.pipeline.records[state->record];
  llvm::SmallVector<mlir::Type> types;
  for (const LeafField &field : record.fields)
    types.append(field.getElementCount(), scalars.getType(field.type));
  placeholders[call] = mlir::func::CallOp::create(
      builder, *location, (updateBeginName + state->name).str(), types,
      getCoordinates(llvm::drop_begin(call->args()), state->rank));
  return success();
}

LogicalResult MemoryImporter::importEmit(llvm::CallInst *call) {
  if (failed(expectPhase(call, WrapperKind::Process, "emit")))
    return failure();
  auto *port = dyn_cast<llvm::ConstantInt>(call->getArgOperand(0));
  if (!port)
    return fail(call) << "expected the port of an emit to be a constant";
  int64_t number = port->getSExtValue();
  if (number < 0 || number >= static_cast<int64_t>(stage.outputs.size()))
    return fail(call) << "expected one of the " << stage.outputs.size()
                      << " ports of stage '" << stage.name << "', but got port "
                      << number;
  unsigned record =
      cast<llvm::ConstantInt>(call->getArgOperand(1))->getZExtValue();
  if (record != stage.outputs[number])
    return fail(call) << "expected a '"
                      << unit.pipeline.records[stage.outputs[number]].name
                      << "' for port " << number << " of stage '" << stage.name
                      << "', but got a '" << unit.pipeline.records[record].name
                      << "'";
  llvm::SmallVector<mlir::Value> numbers;
  for (llvm::Value *value : llvm::drop_begin(call->args(), 2))
    numbers.push_back(scalars.get(value));
  EmitOp::create(builder, *location, /*prim=*/mlir::Type(), number, numbers);
  return success();
}
