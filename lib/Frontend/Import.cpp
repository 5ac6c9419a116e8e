//===- Import.cpp - Phases in MLIR ----------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Blocks in reverse post-order, phis as block arguments, then terminators.
// Numbers are ScalarImport's, markers and accessors are written here.
//
//===----------------------------------------------------------------------===//

#include "Import.h"

#include "Cleanup.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
#include "ScalarImport.h"
#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/ControlFlow/IR/ControlFlowOps.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "llvm/ADT/PostOrderIterator.h"
#include "llvm/IR/CFG.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"

using namespace piko;
using llvm::cast;
using llvm::dyn_cast;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;

namespace {

class PhaseImporter {
public:
  PhaseImporter(WrapperKind phase, unsigned stage, ParsedUnit &unit,
                MemoryMap &memory, mlir::MLIRContext &context)
      : phase(phase), stage(unit.pipeline.stages[stage]), unit(unit),
        memory(memory), context(context), builder(&context),
        scalars(builder, values) {}

  mlir::OwningOpRef<mlir::func::FuncOp> run(llvm::Function &source) {
    mlir::Type prim = PrimType::get(
        &context, mlir::FlatSymbolRefAttr::get(
                      &context, unit.pipeline.records[stage.input].name));
    mlir::OwningOpRef<mlir::func::FuncOp> function = mlir::func::FuncOp::create(
        stage.location, source.getName(), builder.getFunctionType({prim}, {}));
    entry = function->addEntryBlock();
    scalars.setEntry(entry);
    llvm::ReversePostOrderTraversal<llvm::Function *> order(&source);
    for (llvm::BasicBlock *block : order)
      makeBlock(block, *function);
    for (llvm::BasicBlock *block : order)
      if (failed(importBlock(block)))
        return nullptr;
    for (llvm::BasicBlock *block : order)
      if (failed(importTerminator(block->getTerminator())))
        return nullptr;
    return function;
  }

private:
  mlir::InFlightDiagnostic fail(const llvm::Instruction *instruction) {
    return mlir::emitError(getUserLocation(instruction, unit, context));
  }
  LogicalResult reject(const llvm::Instruction *instruction,
                       const llvm::Twine &what) {
    return fail(instruction) << "not supported in Piko: " << what;
  }

  void makeBlock(llvm::BasicBlock *block, mlir::func::FuncOp function) {
    if (block->isEntryBlock()) {
      blocks[block] = entry;
      return;
    }
    mlir::Block *made = function.addBlock();
    blocks[block] = made;
    for (llvm::PHINode &phi : block->phis())
      values[&phi] = made->addArgument(scalars.getType(phi.getType()),
                                       getUserLocation(&phi, unit, context));
  }

  LogicalResult importBlock(llvm::BasicBlock *block) {
    builder.setInsertionPointToEnd(blocks[block]);
    for (llvm::Instruction &instruction : *block) {
      if (llvm::isa<llvm::PHINode>(instruction) || instruction.isTerminator())
        continue;
      location = getUserLocation(&instruction, unit, context);
      scalars.setLocation(*location);
      if (failed(importInstruction(&instruction)))
        return failure();
    }
    return success();
  }

  LogicalResult importInstruction(llvm::Instruction *instruction) {
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
      if (name.starts_with("piko."))
        return importAccessor(call, name);
    }
    if (instruction->getType()->isPointerTy())
      return reject(instruction,
                    "a pointer that can point to different places");
    if (mlir::Value value = scalars.import(instruction)) {
      values[instruction] = value;
      return success();
    }
    if (auto *call = dyn_cast<llvm::IntrinsicInst>(instruction)) {
      if (call->getType()->isVoidTy())
        return success();
      return reject(instruction,
                    "a call of '" + call->getCalledFunction()->getName() + "'");
    }
    return reject(instruction, llvm::Twine("the operation '") +
                                   instruction->getOpcodeName() + "'");
  }

  //===--------------------------------------------------------------------===//
  // Local arrays
  //===--------------------------------------------------------------------===//

  LogicalResult importArray(llvm::AllocaInst *variable) {
    llvm::Type *type = variable->getAllocatedType();
    int64_t count = 1;
    while (auto *array = dyn_cast<llvm::ArrayType>(type)) {
      count *= array->getNumElements();
      type = array->getElementType();
    }
    if (variable->isArrayAllocation() || type->isStructTy() ||
        type->isPointerTy())
      return reject(variable, "a local variable whose parts are accessed in "
                              "ways that cannot be told apart");
    mlir::OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(entry);
    arrays[variable] = mlir::memref::AllocaOp::create(
        builder, *location,
        mlir::MemRefType::get({count}, scalars.getType(type)));
    return success();
  }

  /// An address in an array as the index of an element of `size` bytes.
  mlir::Value makeElementIndex(const Address &address, int64_t size) {
    // Not every term need be a multiple of the size, though their sum is.
    bool divides = llvm::all_of(address.terms, [&](const auto &term) {
      return term.second % size == 0;
    });
    int64_t unit = divides ? size : 1;
    mlir::Value index;
    for (auto [value, scale] : address.terms) {
      mlir::Value term = scalars.toIndex(scalars.get(value));
      if (scale != unit)
        term = mlir::arith::MulIOp::create(builder, *location, term,
                                           scalars.makeIndex(scale / unit));
      index = index
                  ? mlir::arith::AddIOp::create(builder, *location, index, term)
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

  LogicalResult importArrayAccess(llvm::Instruction *instruction) {
    auto *store = dyn_cast<llvm::StoreInst>(instruction);
    Address address =
        getAddress(const_cast<llvm::Value *>(
                       llvm::getLoadStorePointerOperand(instruction)),
                   memory.data);
    auto found = arrays.find(address.base);
    if (found == arrays.end())
      return reject(instruction, "access through a pointer that can point to "
                                 "different places");
    mlir::Value array = found->second;
    mlir::Type element =
        cast<mlir::MemRefType>(array.getType()).getElementType();
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

  const StateDescription *getState(llvm::CallInst *user, llvm::Value *handle) {
    const StateDescription *state = memory.getState(handle);
    if (!state)
      reject(user, "a buffer or image that is not a member of the state")
          .failed();
    return state;
  }

  llvm::SmallVector<mlir::Value>
  getCoordinates(llvm::iterator_range<llvm::User::op_iterator> operands,
                 int64_t rank) {
    llvm::SmallVector<mlir::Value> coordinates;
    for (llvm::Value *operand :
         llvm::make_range(operands.begin(), operands.begin() + rank))
      coordinates.push_back(scalars.getCoordinate(operand));
    return coordinates;
  }

  /// Where an accessor goes: what, which element of it, which field.
  struct Place {
    const StateDescription *state = nullptr; ///< null = the primitive
    llvm::SmallVector<mlir::Value> indices, elements;
    llvm::StringRef field;
  };

  LogicalResult getPlace(llvm::CallInst *call, unsigned firstElement,
                         Place &place) {
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
    case MarkerKind::element:
      place.state = getState(call, base->getArgOperand(0));
      if (!place.state)
        return failure();
      place.indices =
          getCoordinates(llvm::drop_begin(base->args()), place.state->rank);
      break;
    default:
      break;
    }
    place.field = unit.pipeline.records[record].fields[leaf].name;
    for (llvm::Value *index : llvm::drop_begin(call->args(), firstElement))
      place.elements.push_back(scalars.toIndex(scalars.get(index)));
    return success();
  }

  LogicalResult importAccessor(llvm::CallInst *call, llvm::StringRef name) {
    if (name == accessor::emit)
      return importEmit(call);
    if (name == accessor::updateBegin)
      return importUpdateBegin(call);
    if (name.starts_with(accessor::updateValue)) {
      auto *begin = cast<llvm::CallInst>(call->getArgOperand(0));
      values[call] = updates[begin].getResult(
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
    Place place;
    if (name.starts_with(accessor::load)) {
      if (failed(getPlace(call, 2, place)))
        return failure();
      mlir::Type type = scalars.getType(call->getType());
      if (place.state)
        values[call] =
            LoadOp::create(builder, *location, type, place.state->name,
                           place.indices, place.field, place.elements);
      else
        values[call] =
            GetOp::create(builder, *location, type, entry->getArgument(0),
                          place.field, place.elements);
      return success();
    }
    if (phase != WrapperKind::Process)
      return fail(call) << "expected the state to be changed in the process "
                           "phase, but stage '"
                        << stage.name << "' changes it in another";
    if (name.starts_with(accessor::store)) {
      if (failed(getPlace(call, 3, place)))
        return failure();
      StoreOp::create(builder, *location, scalars.get(call->getArgOperand(2)),
                      place.state->name, place.indices, place.field,
                      place.elements);
      return success();
    }
    if (failed(getPlace(call, 5, place)))
      return failure();
    AtomicOp::create(builder, *location, /*old=*/mlir::Type(),
                     getAtomicKind(call), place.state->name, place.indices,
                     place.field, place.elements,
                     scalars.get(call->getArgOperand(4)));
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
    default:
      return AtomicKind::Xor;
    }
  }

  LogicalResult importUpdateBegin(llvm::CallInst *call) {
    if (phase != WrapperKind::Process)
      return fail(call) << "expected update in a process phase, but stage '"
                        << stage.name << "' has one in another";
    const StateDescription *state = getState(call, call->getArgOperand(0));
    if (!state)
      return failure();
    const RecordDescription &record = unit.pipeline.records[state->record];
    llvm::SmallVector<mlir::Type> types;
    for (const LeafField &field : record.fields)
      types.append(field.getElementCount(), scalars.getType(field.type));
    updates[call] = mlir::func::CallOp::create(
        builder, *location, (updateBeginName + state->name).str(), types,
        getCoordinates(llvm::drop_begin(call->args()), state->rank));
    return success();
  }

  LogicalResult importEmit(llvm::CallInst *call) {
    if (phase != WrapperKind::Process)
      return fail(call) << "expected emit in a process phase, but stage '"
                        << stage.name << "' has one in another";
    auto *port = dyn_cast<llvm::ConstantInt>(call->getArgOperand(0));
    if (!port)
      return fail(call) << "expected the port of an emit to be a constant";
    int64_t number = port->getSExtValue();
    if (number < 0 || number >= static_cast<int64_t>(stage.outputs.size()))
      return fail(call) << "expected one of the " << stage.outputs.size()
                        << " ports of stage '" << stage.name
                        << "', but got port " << number;
    unsigned record =
        cast<llvm::ConstantInt>(call->getArgOperand(1))->getZExtValue();
    if (record != stage.outputs[number])
      return fail(call) << "expected a '"
                        << unit.pipeline.records[stage.outputs[number]].name
                        << "' for port " << number << " of stage '"
                        << stage.name << "', but got a '"
                        << unit.pipeline.records[record].name << "'";
    llvm::SmallVector<mlir::Value> numbers;
    for (llvm::Value *value : llvm::drop_begin(call->args(), 2))
      numbers.push_back(scalars.get(value));
    EmitOp::create(builder, *location, number, numbers);
    return success();
  }

  //===--------------------------------------------------------------------===//
  // Bins
  //===--------------------------------------------------------------------===//

  LogicalResult importMarker(llvm::CallInst *call, const Marker &marker) {
    int64_t rank = unit.pipeline.rank;
    auto set = [&](mlir::Value index) {
      values[call] = scalars.fromIndex(index, scalars.getType(call->getType()));
      return success();
    };
    auto constant = [&](unsigned operand) -> int64_t {
      return cast<llvm::ConstantInt>(call->getArgOperand(operand))
          ->getSExtValue();
    };
    auto index = [&](unsigned operand) {
      return scalars.toIndex(scalars.get(call->getArgOperand(operand)));
    };
    switch (marker.kind) {
    case MarkerKind::state:
    case MarkerKind::input:
    case MarkerKind::element:
    case MarkerKind::phase:
      return success();
    case MarkerKind::extent:
    case MarkerKind::imageExtent: {
      const StateDescription *state = getState(call, call->getArgOperand(0));
      if (!state)
        return failure();
      return set(ExtentOp::create(builder, *location, builder.getIndexType(),
                                  state->name, constant(1)));
    }
    case MarkerKind::bin:
      return set(BinOp::create(builder, *location, builder.getIndexType()));
    case MarkerKind::binAt:
      return set(BinAtOp::create(builder, *location, builder.getIndexType(),
                                 getCoordinates(call->args(), rank)));
    case MarkerKind::binLo:
      return set(BinLoOp::create(builder, *location, builder.getIndexType(),
                                 index(0), constant(1)));
    case MarkerKind::binHi:
      return set(BinHiOp::create(builder, *location, builder.getIndexType(),
                                 index(0), constant(1)));
    case MarkerKind::domain:
      return set(DomainOp::create(builder, *location, builder.getIndexType(),
                                  constant(0)));
    default:
      break;
    }
    if (phase != WrapperKind::Assign)
      return fail(call) << "expected directives in the phase they are for, but "
                           "stage '"
                        << stage.name << "' has one in its process phase";
    switch (marker.kind) {
    case MarkerKind::assignBin:
      AssignToOp::create(builder, *location, index(0));
      return success();
    case MarkerKind::assignAll:
      AssignAllOp::create(builder, *location);
      return success();
    case MarkerKind::assignPrevious:
      AssignPreviousOp::create(builder, *location);
      return success();
    case MarkerKind::assignBox:
      AssignBoxOp::create(
          builder, *location, getCoordinates(call->args(), rank),
          getCoordinates(llvm::drop_begin(call->args(), 4), rank));
      return success();
    default:
      return fail(call) << "expected directives in the phase they are for, but "
                           "stage '"
                        << stage.name << "' has one in its assignBin phase";
    }
  }

  //===--------------------------------------------------------------------===//
  // Branches
  //===--------------------------------------------------------------------===//

  llvm::SmallVector<mlir::Value> getArguments(llvm::BasicBlock *from,
                                              llvm::BasicBlock *to) {
    llvm::SmallVector<mlir::Value> arguments;
    for (llvm::PHINode &phi : to->phis())
      arguments.push_back(scalars.get(phi.getIncomingValueForBlock(from)));
    return arguments;
  }

  LogicalResult importTerminator(llvm::Instruction *terminator) {
    llvm::BasicBlock *from = terminator->getParent();
    builder.setInsertionPointToEnd(blocks[from]);
    location = getUserLocation(terminator, unit, context);
    scalars.setLocation(*location);
    if (llvm::isa<llvm::ReturnInst, llvm::UnreachableInst>(terminator)) {
      mlir::func::ReturnOp::create(builder, *location);
      return success();
    }
    if (auto *branch = dyn_cast<llvm::BranchInst>(terminator)) {
      llvm::BasicBlock *first = branch->getSuccessor(0);
      if (branch->isUnconditional()) {
        mlir::cf::BranchOp::create(builder, *location, blocks[first],
                                   getArguments(from, first));
        return success();
      }
      llvm::BasicBlock *second = branch->getSuccessor(1);
      mlir::cf::CondBranchOp::create(
          builder, *location, scalars.get(branch->getCondition()),
          blocks[first], getArguments(from, first), blocks[second],
          getArguments(from, second));
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
      targets.push_back(blocks[option.getCaseSuccessor()]);
      arguments.push_back(getArguments(from, option.getCaseSuccessor()));
    }
    llvm::SmallVector<mlir::ValueRange> ranges(arguments.begin(),
                                               arguments.end());
    mlir::cf::SwitchOp::create(
        builder, *location, scalars.get(choice->getCondition()),
        blocks[choice->getDefaultDest()],
        getArguments(from, choice->getDefaultDest()), cases, targets, ranges);
    return success();
  }

  WrapperKind phase;
  const StageDescription &stage;
  ParsedUnit &unit;
  MemoryMap &memory;
  mlir::MLIRContext &context;
  mlir::OpBuilder builder;
  ValueMap values;
  ScalarImporter scalars;
  std::optional<mlir::Location> location;
  mlir::Block *entry = nullptr;
  llvm::DenseMap<llvm::BasicBlock *, mlir::Block *> blocks;
  llvm::DenseMap<llvm::Value *, mlir::Value> arrays;
  llvm::DenseMap<llvm::CallInst *, mlir::func::CallOp> updates;
};

} // namespace

mlir::OwningOpRef<mlir::func::FuncOp>
piko::importPhase(llvm::Function &function, WrapperKind phase, unsigned stage,
                  ParsedUnit &unit, MemoryMap &memory,
                  mlir::MLIRContext &context) {
  return PhaseImporter(phase, stage, unit, memory, context).run(function);
}
