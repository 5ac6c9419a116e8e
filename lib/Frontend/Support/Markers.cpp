//===- Markers.cpp - The functions of piko/markers.h ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Support/Markers.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringSwitch.h"
#include "llvm/IR/InstrTypes.h"
#include "llvm/IR/Module.h"

using namespace piko;

const marker::Assignment *piko::getAssignment(llvm::StringRef name) {
  const auto *found =
      llvm::find_if(marker::assignments, [&](const auto &assignment) {
        return name == assignment.marker;
      });
  return found == std::end(marker::assignments) ? nullptr : found;
}

std::optional<MarkerKind> piko::getMarkerKind(llvm::StringRef name) {
  if (getAssignment(name))
    return MarkerKind::assign;
#define MARKER(NAME) .Case(#NAME, MarkerKind::NAME)
  return llvm::StringSwitch<std::optional<MarkerKind>>(name) MARKER(state)
      MARKER(input) MARKER(element) MARKER(listSize) MARKER(listAt)
          MARKER(extent) MARKER(imageExtent) MARKER(emit) MARKER(updateBegin)
              MARKER(updateEnd) MARKER(atomic) MARKER(atomicFetch) MARKER(
                  reduceBegin) MARKER(scanBegin) MARKER(combineEnd) MARKER(sort)
                  MARKER(loopFirst) MARKER(loopMore) MARKER(loopNext) MARKER(
                      cellsOf) MARKER(cellAt) MARKER(sync) MARKER(bin)
                      MARKER(floatPosition) MARKER(binAt) MARKER(binLo)
                          MARKER(binHi) MARKER(domain) MARKER(schedule)
                              MARKER(endStage) MARKER(endBin) MARKER(batch)
                                  MARKER(everyBin) MARKER(order) MARKER(lanes)
                                      MARKER(precision) MARKER(source)
                                          MARKER(connect)
                                              MARKER(allocateForSource)
                                                  MARKER(phase) MARKER(clear)
                                                      .Default(std::nullopt);
#undef MARKER
}

const Marker *piko::getMarker(const llvm::CallBase *call,
                              const MarkerTable &markers) {
  const llvm::Function *callee = call->getCalledFunction();
  if (!callee)
    return nullptr;
  auto found = markers.find(callee->getName());
  return found == markers.end() ? nullptr : &found->second;
}

void piko::setInPlace(llvm::Function &function) {
  function.addFnAttr(llvm::Attribute::NoDuplicate);
  function.addFnAttr(llvm::Attribute::Convergent);
  function.addFnAttr(llvm::Attribute::NoMerge);
}

void piko::setMarkerEffects(llvm::Module &module, const MarkerTable &markers) {
  for (llvm::Function &function : module) {
    auto found = markers.find(function.getName());
    if (found == markers.end())
      continue;
    function.setAttributes({});
    function.setDoesNotThrow();
    function.setWillReturn();
    switch (found->second.kind) {
    case MarkerKind::state:
    case MarkerKind::input:
    case MarkerKind::element:
    case MarkerKind::listAt:
      function.setDoesNotAccessMemory();
      function.addRetAttr(llvm::Attribute::NonNull);
      break;
    case MarkerKind::listSize:
    case MarkerKind::extent:
    case MarkerKind::imageExtent:
    case MarkerKind::bin:
    case MarkerKind::floatPosition:
    case MarkerKind::binAt:
    case MarkerKind::binLo:
    case MarkerKind::binHi:
    case MarkerKind::domain:
    case MarkerKind::cellsOf:
    case MarkerKind::cellAt:
      function.setDoesNotAccessMemory();
      break;
    case MarkerKind::loopFirst:
    case MarkerKind::loopMore:
    case MarkerKind::loopNext:
      function.setDoesNotAccessMemory();
      setInPlace(function);
      break;
    case MarkerKind::phase:
    case MarkerKind::assign:
      function.setOnlyAccessesInaccessibleMemory();
      [[fallthrough]];
    default:
      // What they read and write is seen by nothing else in the module, but
      // they stay where they are, and as many as they are.
      setInPlace(function);
      break;
    }
  }
}
