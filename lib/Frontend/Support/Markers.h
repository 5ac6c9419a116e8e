//===- Markers.h - The functions of piko/markers.h --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_SUPPORT_MARKERS_H
#define PIKO_LIB_FRONTEND_SUPPORT_MARKERS_H

#include "piko/markers.h"
#include "llvm/ADT/SmallVector.h"
#include "llvm/ADT/StringRef.h"

#include <map>
#include <optional>
#include <string>

namespace llvm {
class CallBase;
class Function;
class Module;
} // namespace llvm

namespace piko {

/// One for each function in namespace piko::marker, by the same name; and one
/// for all that assign.
enum class MarkerKind {
  state,
  input,
  element,
  listSize,
  listAt,
  extent,
  imageExtent,
  emit,
  updateBegin,
  updateEnd,
  atomic,
  atomicFetch,
  loopFirst,
  loopMore,
  loopNext,
  cellsOf,
  cellAt,
  sync,
  reduceBegin,
  scanBegin,
  combineEnd,
  sort,
  bin,
  floatPosition,
  binAt,
  binLo,
  binHi,
  domain,
  assign, ///< one of piko::marker::assignments
  schedule,
  endStage,
  endBin,
  batch,
  everyBin,
  order,
  lanes,
  precision,
  source,
  connect,
  allocateForSource,
  phase,
  clear,
};

std::optional<MarkerKind> getMarkerKind(llvm::StringRef name);
/// What a marker assigns; null if it does not.
const marker::Assignment *getAssignment(llvm::StringRef name);

struct Marker {
  MarkerKind kind;
  /// The record that the marker's pointer points to.
  unsigned record = 0;
  /// element: whether only atomics may change what it gives.
  bool isReadOnly = false;
  /// Atomics: which operation. Those and sort: whether on signed numbers.
  int operation = 0;
  bool isSigned = false;
  /// state: where what it gives begins in the pipeline's state.
  int64_t offset = 0;
  const marker::Assignment *assignment = nullptr;
  /// endStage: the stages of that type, by number.
  llvm::SmallVector<unsigned, 1> stages = {};
};

/// Markers by the name of their function in the module.
using MarkerTable = std::map<std::string, Marker, std::less<>>;

/// The marker that an instruction calls, or null.
const Marker *getMarker(const llvm::CallBase *call, const MarkerTable &markers);

/// Keeps calls of a function where they are, and as many as they are.
void setInPlace(llvm::Function &function);

/// Tells LLVM what the markers in a module may do to memory.
void setMarkerEffects(llvm::Module &module, const MarkerTable &markers);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_SUPPORT_MARKERS_H
