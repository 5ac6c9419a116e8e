//===- KeptPixels.cpp - References to pixels after their update ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pixel of an update is a local variable, which is written back when the
// update ends: what is done through a reference that was kept would be lost. It
// stays in memory, held by a call, until it is known which loads and stores are
// to it. None of them may come after the end of the update.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"

#include "Cleanup/FillVariables.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/IR/IntrinsicInst.h"

using namespace piko;
using llvm::dyn_cast;

namespace {

/// An update's pixel.
struct HeldPixel {
  llvm::SmallVector<llvm::CallInst *, 1> begins, ends;
  llvm::SmallPtrSet<const llvm::Instruction *, 8> accesses;
};

} // namespace

static bool isCallOf(const llvm::Instruction &instruction,
                     llvm::StringRef name) {
  auto *call = dyn_cast<llvm::CallInst>(&instruction);
  return call && call->getCalledFunction() &&
         call->getCalledFunction()->getName() == name;
}

/// Whether a store only says that a variable has no value yet.
static bool isUnset(const llvm::StoreInst *store) {
  const llvm::Value *value = store->getValueOperand();
  auto *call = dyn_cast<llvm::CallInst>(value);
  return llvm::isa<llvm::UndefValue>(value) ||
         (call && call->getCalledFunction() &&
          call->getCalledFunction()->getName().starts_with(undefinedName));
}

/// Finds what is done with a pixel; false while a reference to it is somewhere
/// in memory or is chosen.
static bool findAccesses(llvm::Value *pointer, HeldPixel &pixel,
                         const MemoryMap &memory) {
  bool isKnown = true;
  for (llvm::User *user : pointer->users()) {
    auto *instruction = llvm::cast<llvm::Instruction>(user);
    auto *call = dyn_cast<llvm::CallInst>(user);
    const Marker *marker = call ? getMarker(call, memory.markers) : nullptr;
    auto *store = dyn_cast<llvm::StoreInst>(user);
    if (llvm::isa<llvm::GetElementPtrInst>(user)) {
      isKnown &= findAccesses(user, pixel, memory);
    } else if (isCallOf(*instruction, accessor::pixelBegin) ||
               isCallOf(*instruction, accessor::pixelEnd) ||
               llvm::isa<llvm::LifetimeIntrinsic, llvm::ICmpInst>(user)) {
      continue;
    } else if (llvm::isa<llvm::LoadInst, llvm::MemIntrinsic>(user) ||
               (store && store->getPointerOperand() == pointer) ||
               (marker && (marker->kind == MarkerKind::atomic ||
                           marker->kind == MarkerKind::atomicFetch))) {
      if (!store || !isUnset(store))
        pixel.accesses.insert(instruction);
    } else {
      isKnown = false;
    }
  }
  return isKnown;
}

/// An access after an end, on some way that does not lead into the next
/// update; null if there is none.
static const llvm::Instruction *findAfter(const llvm::CallInst *end,
                                          const HeldPixel &pixel) {
  llvm::SmallPtrSet<const llvm::BasicBlock *, 8> visited;
  llvm::SmallVector<const llvm::Instruction *> work{end->getNextNode()};
  while (!work.empty()) {
    const llvm::Instruction *at = work.pop_back_val();
    const llvm::BasicBlock *block = at->getParent();
    while (at && !llvm::is_contained(pixel.begins, at)) {
      if (pixel.accesses.contains(at))
        return at;
      if (at->isTerminator())
        for (const llvm::BasicBlock *next : llvm::successors(block))
          if (visited.insert(next).second)
            work.push_back(&next->front());
      at = at->getNextNode();
    }
  }
  return nullptr;
}

bool piko::releasePixels(llvm::Function &function, const ParsedUnit &unit,
                         MemoryMap &memory, mlir::MLIRContext &context,
                         bool all, bool &changed) {
  llvm::MapVector<llvm::Value *, HeldPixel> pixels;
  for (llvm::Instruction &instruction : llvm::instructions(function)) {
    bool begins = isCallOf(instruction, accessor::pixelBegin);
    if (!begins && !isCallOf(instruction, accessor::pixelEnd))
      continue;
    auto *call = llvm::cast<llvm::CallInst>(&instruction);
    HeldPixel &pixel =
        pixels[getAddress(call->getArgOperand(0), memory.data).base];
    (begins ? pixel.begins : pixel.ends).push_back(call);
  }
  for (auto &[base, pixel] : pixels) {
    if (!findAccesses(base, pixel, memory) && !all)
      continue;
    for (llvm::CallInst *end : pixel.ends)
      if (const llvm::Instruction *kept = findAfter(end, pixel)) {
        mlir::InFlightDiagnostic error =
            mlir::emitError(getUserLocation(kept, unit, context))
            << "expected a pixel to be used inside its update, but this "
               "reference to it was kept";
        error.attachNote(getUserLocation(end, unit, context))
            << "the update is here";
        return false;
      }
    for (auto *calls : {&pixel.begins, &pixel.ends})
      for (llvm::CallInst *call : *calls)
        call->eraseFromParent();
    changed = true;
  }
  return true;
}
