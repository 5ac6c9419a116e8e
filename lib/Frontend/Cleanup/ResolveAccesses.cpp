//===- ResolveAccesses.cpp - From loads and stores to fields --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A load or store through a pointer that a marker gave becomes a call of an
// accessor that names the leaf, before instcombine rewrites addresses. Reading
// a primitive or a constant is without effect, so that LLVM's passes can merge
// such reads across stores.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"
#include "llvm/IR/Module.h"

using namespace piko;
using llvm::dyn_cast;

namespace {

class AccessResolver {
public:
  AccessResolver(llvm::Function &function, ParsedUnit &unit, MemoryMap &memory,
                 mlir::MLIRContext &context)
      : function(function), unit(unit), memory(memory), context(context),
        builder(function.getContext()) {}

  bool run() {
    for (llvm::Instruction &instruction : llvm::instructions(function))
      if (auto *call = dyn_cast<llvm::CallInst>(&instruction))
        if (!call->getCalledFunction())
          return fail(call, "a virtual call or a call through a pointer; use a "
                            "switch that calls each function by its name");
    for (llvm::Instruction &instruction :
         llvm::make_early_inc_range(llvm::instructions(function)))
      if (!resolve(&instruction))
        return false;
    return true;
  }

private:
  bool resolve(llvm::Instruction *instruction) {
    builder.SetInsertPoint(instruction);
    if (auto *load = dyn_cast<llvm::LoadInst>(instruction))
      return resolveLoad(load);
    if (auto *store = dyn_cast<llvm::StoreInst>(instruction))
      return resolveStore(store);
    if (auto *copy = dyn_cast<llvm::MemIntrinsic>(instruction))
      return fail(instruction,
                  llvm::isa<llvm::Constant>(copy->getLength())
                      ? "copying or filling more than 4096 numbers at once, or "
                        "memory whose layout is not known"
                      : "copying or filling a number of bytes that varies, of "
                        "which it is not known that they are whole elements of "
                        "one type; write a loop over the elements");
    if (auto *call = dyn_cast<llvm::CallInst>(instruction))
      if (const Marker *marker = getMarker(call, memory.markers))
        if (marker->kind == MarkerKind::atomic ||
            marker->kind == MarkerKind::atomicFetch)
          return resolveAtomic(call, *marker);
    return true;
  }

  bool fail(llvm::Instruction *instruction, const llvm::Twine &what) {
    emitUserError(instruction, unit, context)
        << "not supported in Piko: " << what;
    return false;
  }

  /// The accessor call for a number at `pointer`; null after an error.
  llvm::Value *makeAccess(llvm::Instruction *instruction, llvm::Value *pointer,
                          llvm::Type *type, llvm::StringRef prefix, bool writes,
                          llvm::ArrayRef<llvm::Value *> operands, bool &isLocal,
                          llvm::Type *&leafType) {
    Address address = getAddress(pointer, memory.data);
    isLocal = llvm::isa<llvm::AllocaInst>(address.base);
    if (isLocal)
      return nullptr;
    const MemoryLayout *layout = memory.getLayout(address.base);
    const Marker *marker = memory.getBaseMarker(address.base);
    if (!layout || !marker) {
      fail(instruction, describeBase(address.base));
      return nullptr;
    }
    std::optional<MemoryAccess> access =
        resolveAccess(*layout, address, memory.data.getTypeStoreSize(type));
    if (!access || type->isPointerTy()) {
      fail(instruction, "access to a record that is not to one of its fields; "
                        "choose between values, as in c ? p.a : p.b");
      return nullptr;
    }
    bool isElement = marker->kind == MarkerKind::element;
    if (writes && !isElement) {
      fail(instruction, marker->kind == MarkerKind::state
                            ? "writing to a constant of the state"
                            : "writing to the primitive that is processed");
      return nullptr;
    }
    if (writes && marker->isReadOnly && !prefix.starts_with("piko.atomic")) {
      fail(instruction, "changing a pixel through the reference that image(xy) "
                        "gives; write image.store or update");
      return nullptr;
    }
    leafType = layout->leaves[access->leaf].type;
    llvm::SmallVector<llvm::Value *> arguments = {
        address.base, builder.getInt32(access->leaf)};
    for (llvm::Value *operand : operands) {
      if (operand->getType() != leafType && operand == operands.back())
        operand = builder.CreateBitCast(operand, leafType);
      arguments.push_back(operand);
    }
    for (const MemoryIndex &index : access->indices)
      arguments.push_back(index.materialize(builder));

    std::string name = prefix.str();
    llvm::raw_string_ostream(name)
        << *leafType << (isElement ? "" : ".constant");
    bool gives = !writes || prefix == accessor::atomicFetch;
    llvm::Type *result = gives ? leafType : builder.getVoidTy();
    llvm::FunctionCallee callee = function.getParent()->getOrInsertFunction(
        name, llvm::FunctionType::get(result, /*isVarArg=*/true));
    auto *declaration = llvm::cast<llvm::Function>(callee.getCallee());
    declaration->setDoesNotThrow();
    declaration->setWillReturn();
    if (!isElement)
      declaration->setDoesNotAccessMemory();
    else if (!writes)
      declaration->setMemoryEffects(llvm::MemoryEffects::readOnly());
    return builder.CreateCall(callee, arguments);
  }

  std::string describeBase(llvm::Value *base) {
    if (auto *call = dyn_cast<llvm::IntrinsicInst>(base))
      if (call->getIntrinsicID() == llvm::Intrinsic::threadlocal_address)
        base = call->getArgOperand(0);
    if (auto *variable = dyn_cast<llvm::GlobalVariable>(base)) {
      llvm::StringRef name = variable->getName();
      if (name.starts_with("_ZTI"))
        return "run-time type information";
      return "access to " + describeVariable(name) +
             ", which is outside the pipeline";
    }
    if (llvm::isa<llvm::IntToPtrInst>(base))
      return "a pointer made from an integer";
    if (llvm::isa<llvm::ConstantPointerNull>(base))
      return "access through a null pointer";
    return ("access through " + manyPlaces).str();
  }

  bool resolveLoad(llvm::LoadInst *load) {
    bool isLocal;
    llvm::Type *leafType;
    llvm::Value *value =
        makeAccess(load, load->getPointerOperand(), load->getType(),
                   accessor::load, /*writes=*/false, {}, isLocal, leafType);
    if (!value)
      return isLocal;
    if (value->getType() != load->getType())
      value = builder.CreateBitCast(value, load->getType());
    load->replaceAllUsesWith(value);
    load->eraseFromParent();
    return true;
  }

  bool resolveStore(llvm::StoreInst *store) {
    bool isLocal;
    llvm::Type *leafType;
    llvm::Value *value = store->getValueOperand();
    if (!makeAccess(store, store->getPointerOperand(), value->getType(),
                    accessor::store, /*writes=*/true, {value}, isLocal,
                    leafType))
      return isLocal;
    store->eraseFromParent();
    return true;
  }

  bool resolveAtomic(llvm::CallInst *call, const Marker &marker) {
    bool isLocal;
    llvm::Type *leafType;
    llvm::Value *value = call->getArgOperand(1);
    llvm::Value *operands[] = {builder.getInt32(marker.operation),
                               builder.getInt1(marker.isSigned), value};
    bool isFetch = marker.kind == MarkerKind::atomicFetch;
    llvm::Value *access =
        makeAccess(call, call->getArgOperand(0), value->getType(),
                   isFetch ? accessor::atomicFetch : accessor::atomic,
                   /*writes=*/true, operands, isLocal, leafType);
    if (!access)
      return false;
    if (isFetch)
      call->replaceAllUsesWith(access);
    call->eraseFromParent();
    return true;
  }

  llvm::Function &function;
  ParsedUnit &unit;
  MemoryMap &memory;
  mlir::MLIRContext &context;
  llvm::IRBuilder<> builder;
};

} // namespace

bool piko::resolveAccesses(llvm::Function &function, ParsedUnit &unit,
                           MemoryMap &memory, mlir::MLIRContext &context) {
  return AccessResolver(function, unit, memory, context).run();
}

bool piko::localizeTables(llvm::Function &function, MemoryMap &memory) {
  llvm::SmallVector<llvm::LoadInst *> loads;
  for (llvm::Instruction &instruction : llvm::instructions(function))
    if (auto *load = dyn_cast<llvm::LoadInst>(&instruction))
      loads.push_back(load);
  llvm::DenseMap<llvm::GlobalVariable *, llvm::AllocaInst *> copies;
  bool changed = false;
  for (llvm::LoadInst *load : loads) {
    llvm::SmallVector<llvm::GetElementPtrInst *> steps;
    llvm::Value *base = load->getPointerOperand();
    while (auto *step = dyn_cast<llvm::GetElementPtrInst>(base)) {
      steps.push_back(step);
      base = step->getPointerOperand();
    }
    auto *table = dyn_cast<llvm::GlobalVariable>(base);
    if (!table || !table->isConstant() || !table->hasInitializer() ||
        steps.empty())
      continue;
    llvm::AllocaInst *&copy = copies[table];
    if (!copy) {
      llvm::IRBuilder<> builder(&*function.getEntryBlock().begin());
      copy = builder.CreateAlloca(table->getValueType());
      // A copy of a record or table: splitMemory takes it apart.
      builder.CreateMemCpy(copy, llvm::MaybeAlign(), table, llvm::MaybeAlign(),
                           memory.data.getTypeAllocSize(table->getValueType()));
    }
    llvm::Value *pointer = copy;
    for (llvm::GetElementPtrInst *step : llvm::reverse(steps)) {
      auto *clone = llvm::cast<llvm::GetElementPtrInst>(step->clone());
      clone->setOperand(0, pointer);
      clone->insertBefore(load->getIterator());
      pointer = clone;
    }
    load->setOperand(0, pointer);
    changed = true;
  }
  return changed;
}
