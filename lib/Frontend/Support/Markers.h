//===- Markers.h - The functions of piko/markers.h --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_SUPPORT_MARKERS_H
#define PIKO_LIB_FRONTEND_SUPPORT_MARKERS_H

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

/// One for each function in namespace piko::marker, by the same name.
enum class MarkerKind {
#define PIKO_MARKER(EFFECT, RESULT, NAME, ...) NAME,
#include "piko/markers.def"
};

std::optional<MarkerKind> getMarkerKind(llvm::StringRef name);

/// What assigns a primitive to bins, and the operation that it becomes.
struct Assignment {
  MarkerKind marker;
  llvm::StringLiteral operation;
  enum Operands { Nothing, Bin, TwoPoints } operands;
};
/// Null for a marker that is none.
const Assignment *getAssignment(MarkerKind marker);

/// What a schedule phase may say.
struct Directive {
  MarkerKind marker;
  llvm::StringLiteral name, said; ///< the marker's, and what a text calls it
  /// For what it may be another: for nothing, for each bin, or for each bin in
  /// a stage that takes a list.
  enum Varies { Stage, AnyBin, ListBin } varies;
  /// What it becomes: an attribute of one of a stage's operations.
  enum Of { OfStage, OfSchedule, OfProcess } of;
  llvm::StringLiteral attribute;
  enum Value { Flag, Count, Lanes, Precision, Policy, Stages, Label } value;
  /// What it becomes where it varies.
  std::string getOperation() const;
};
/// Null for a marker that is none.
const Directive *getDirective(MarkerKind marker);

struct Marker {
  MarkerKind kind;
  /// The record that the marker's pointer points to.
  unsigned record = 0;
  /// element: whether only atomics may change what it gives.
  bool isReadOnly = false;
  /// Atomics: which operation. Those, sort and expectIndex: whether of signed
  /// numbers.
  int operation = 0;
  bool isSigned = false;
  /// state: where what it gives begins in the pipeline's state.
  int64_t offset = 0;
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
