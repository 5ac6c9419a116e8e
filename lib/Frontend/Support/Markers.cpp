//===- Markers.cpp - The functions of piko/markers.h ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Support/Markers.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/StringSwitch.h"
#include "llvm/IR/InstrTypes.h"
#include "llvm/IR/Module.h"

using namespace piko;

std::optional<MarkerKind> piko::getMarkerKind(llvm::StringRef name) {
  return llvm::StringSwitch<std::optional<MarkerKind>>(name)
#define PIKO_MARKER(EFFECT, RESULT, NAME, ...) .Case(#NAME, MarkerKind::NAME)
#include "piko/markers.def"
      .Default(std::nullopt);
}

/// The row of a table that is about a marker.
template <class Row, size_t count>
static const Row *findRow(const Row (&table)[count], MarkerKind marker) {
  const Row *found = llvm::find_if(
      table, [&](const Row &row) { return row.marker == marker; });
  return found == std::end(table) ? nullptr : found;
}

const Assignment *piko::getAssignment(MarkerKind marker) {
  static constexpr Assignment assignments[] = {
#define PIKO_ASSIGNMENT(NAME, OPERATION, OPERANDS)                             \
  {MarkerKind::NAME, OPERATION, Assignment::OPERANDS},
#include "piko/markers.def"
  };
  return findRow(assignments, marker);
}

const Directive *piko::getDirective(MarkerKind marker) {
  static constexpr Directive directives[] = {
#define PIKO_DIRECTIVE(NAME, SAID, VARIES, OF, ATTRIBUTE, VALUE, ...)          \
  {MarkerKind::NAME,  #NAME,      #SAID,           Directive::VARIES,          \
   Directive::Of##OF, #ATTRIBUTE, Directive::VALUE},
#include "piko/markers.def"
  };
  return findRow(directives, marker);
}

std::string Directive::getOperation() const {
  return "piko.set_" + llvm::convertToSnakeFromCamelCase(name);
}

namespace {
/// What LLVM may think of a marker; see piko/markers.def.
enum class MarkerEffect { Place, Value, Loop, InPlace, Opaque };
} // namespace

static MarkerEffect getEffect(MarkerKind marker) {
  switch (marker) {
#define PIKO_MARKER(EFFECT, RESULT, NAME, ...)                                 \
  case MarkerKind::NAME:                                                       \
    return MarkerEffect::EFFECT;
#include "piko/markers.def"
  }
  llvm_unreachable("all markers are listed");
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
    switch (getEffect(found->second.kind)) {
    case MarkerEffect::Place:
      function.addRetAttr(llvm::Attribute::NonNull);
      [[fallthrough]];
    case MarkerEffect::Value:
      function.setDoesNotAccessMemory();
      break;
    case MarkerEffect::Loop:
      function.setDoesNotAccessMemory();
      setInPlace(function);
      break;
    case MarkerEffect::Opaque:
      function.setOnlyAccessesInaccessibleMemory();
      setInPlace(function);
      break;
    case MarkerEffect::InPlace:
      // What they read and write is seen by nothing else in the module.
      setInPlace(function);
      break;
    }
  }
}
