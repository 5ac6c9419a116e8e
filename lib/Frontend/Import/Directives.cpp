//===- Directives.cpp - What a schedule phase says ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/Directives.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/IR/Builders.h"
#include "piko/label.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/Analysis/ValueTracking.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::dyn_cast;

namespace {

/// A call that says a directive.
struct Said {
  const llvm::CallInst *call;
  const Marker *marker;
  const Directive *directive;

  bool mayDiffer() const { return directive->varies != Directive::Stage; }
};

class DirectiveReader {
public:
  DirectiveReader(StageDescription &stage, const ParsedUnit &unit,
                  mlir::MLIRContext &context)
      : stage(stage), schedule(stage.schedule), unit(unit), context(context),
        builder(&context) {}

  bool run(llvm::Function &phase);

private:
  mlir::InFlightDiagnostic fail(const llvm::CallInst *call) {
    return emitUserError(call, unit, context);
  }
  bool failPhase(const llvm::CallInst *call) {
    fail(call) << "expected only directives in the schedule phase of stage '"
               << stage.name << "'";
    return false;
  }

  bool collect(const llvm::CallInst *call, const Marker &marker);
  bool read(const Said &said);
  void set(const Said &said, mlir::Attribute value);
  std::optional<int64_t> getConstant(const Said &said, llvm::StringRef what);
  std::optional<int64_t> getEnumerator(const Said &said, llvm::StringRef what,
                                       llvm::StringRef type, int64_t most);
  bool readPolicy(const Said &said);
  bool readStages(const Said &said);
  bool readLabel(const Said &said);

  StageDescription &stage;
  ScheduleDescription &schedule;
  const ParsedUnit &unit;
  mlir::MLIRContext &context;
  mlir::Builder builder;
  llvm::SmallVector<Said> directives;
};

} // namespace

/// Whether an accessor changes something.
static bool isEffect(llvm::StringRef name) {
  return name == accessor::emit || name == accessor::updateBegin ||
         name == accessor::reduceBegin || name == accessor::scanBegin ||
         name.starts_with(accessor::store) ||
         name.starts_with(accessor::atomic) ||
         name.starts_with(accessor::atomicFetch);
}

static bool isConstant(const llvm::CallInst *call, const Once &once) {
  return once.contains(call->getParent()) &&
         llvm::all_of(call->args(), llvm::IsaPred<llvm::ConstantInt>);
}

bool DirectiveReader::run(llvm::Function &phase) {
  for (llvm::Instruction &instruction : llvm::instructions(phase)) {
    auto *call = dyn_cast<llvm::CallInst>(&instruction);
    if (!call)
      continue;
    const Marker *marker = getMarker(call, unit.markers);
    if (!marker && isEffect(call->getCalledFunction()->getName()))
      return failPhase(call);
    if (marker && !collect(call, *marker))
      return false;
  }
  Once once(phase);
  for (const Said &said : directives)
    schedule.isDynamic |= said.mayDiffer() && !isConstant(said.call, once);
  for (const Said &said : directives) {
    if (said.mayDiffer() && schedule.isDynamic)
      continue; // It stays in the phase's code.
    if (!said.mayDiffer() && !once.contains(said.call->getParent())) {
      fail(said.call) << "expected " << said.directive->said
                      << " for every bin, because it may not depend on the bin";
      return false;
    }
    if (!read(said))
      return false;
  }
  return true;
}

/// Collects directives and reports what is none; false after an error.
bool DirectiveReader::collect(const llvm::CallInst *call,
                              const Marker &marker) {
  if (const Directive *directive = getDirective(marker.kind)) {
    directives.push_back({call, &marker, directive});
    if (stage.takesList || directive->varies != Directive::ListBin)
      return true;
    fail(call) << "expected " << directive->said
               << " in a stage whose process takes a list, but that of stage '"
               << stage.name << "' does not";
    return false;
  }
  bool isOther =
      getAssignment(marker.kind) || marker.kind == MarkerKind::loopMore ||
      marker.kind == MarkerKind::sync || marker.kind == MarkerKind::sort;
  return !isOther || failPhase(call);
}

/// A directive that is the same for all bins; false after an error.
bool DirectiveReader::read(const Said &said) {
  std::optional<int64_t> number = 1;
  switch (said.directive->value) {
  case Directive::Flag:
    if (said.call->arg_size() != 0)
      number = getConstant(said, "an order");
    if (number)
      set(said, *number ? builder.getUnitAttr() : mlir::UnitAttr());
    return number.has_value();
  case Directive::Count:
    number = getConstant(said, "a number");
    if (!number)
      return false;
    set(said, builder.getI64IntegerAttr(*number));
    if (*number >= 1)
      return true;
    fail(said.call) << "expected a " << said.directive->said
                    << " of at least 1, but got " << *number;
    return false;
  case Directive::Lanes:
    schedule.lanesLocation = getUserLocation(said.call, unit, context);
    number = getEnumerator(said, "what lanes are given", "Lanes", 3);
    if (number)
      set(said, LaneMappingAttr::get(&context, LaneMapping(*number)));
    return number.has_value();
  case Directive::Precision:
    number = getEnumerator(said, "a precision", "Precision", 2);
    if (number)
      set(said, *number ? PrecisionAttr::get(&context, Precision(*number))
                        : PrecisionAttr());
    return number.has_value();
  case Directive::Policy:
    return readPolicy(said);
  case Directive::Stages:
    return readStages(said);
  case Directive::Label:
    return readLabel(said);
  }
  llvm_unreachable("all kinds of values are listed");
}

/// The last call counts; one that says what is so anyway takes others back.
void DirectiveReader::set(const Said &said, mlir::Attribute value) {
  mlir::NamedAttrList &attributes =
      said.directive->of == Directive::OfStage      ? schedule.ofStage
      : said.directive->of == Directive::OfSchedule ? schedule.ofSchedule
                                                    : schedule.ofProcess;
  attributes.erase(said.directive->attribute);
  if (value)
    attributes.append(said.directive->attribute, value);
}

/// The constant that a directive is given; reports where it is not one.
std::optional<int64_t> DirectiveReader::getConstant(const Said &said,
                                                    llvm::StringRef what) {
  if (auto *number = dyn_cast<llvm::ConstantInt>(said.call->getArgOperand(0)))
    return number->getSExtValue();
  fail(said.call) << "expected " << what << " to be a constant";
  return std::nullopt;
}

/// The same for an enumerator, of which the last one is `most`.
std::optional<int64_t> DirectiveReader::getEnumerator(const Said &said,
                                                      llvm::StringRef what,
                                                      llvm::StringRef type,
                                                      int64_t most) {
  std::optional<int64_t> number = getConstant(said, what);
  if (!number || (*number >= 0 && *number <= most))
    return number;
  fail(said.call) << "expected a value of piko::" << type << ", but got "
                  << *number;
  return std::nullopt;
}

bool DirectiveReader::readPolicy(const Said &said) {
  auto constant = [&](unsigned operand) {
    return llvm::cast<llvm::ConstantInt>(said.call->getArgOperand(operand))
        ->getSExtValue();
  };
  auto kind = ScheduleKind(constant(0));
  int64_t tileSplit = constant(1);
  set(said, ScheduleKindAttr::get(&context, kind));
  // Of others it is accepted, and has no effect.
  constexpr llvm::StringLiteral splitName = "tileSplit";
  schedule.ofSchedule.erase(splitName);
  if (kind == ScheduleKind::All && tileSplit > 0)
    schedule.ofSchedule.append(splitName, builder.getI64IntegerAttr(tileSplit));
  if (tileSplit >= 0)
    return true;
  fail(said.call) << "expected a tile split of at least 0, but got "
                  << tileSplit;
  return false;
}

bool DirectiveReader::readStages(const Said &said) {
  if (said.marker->stages.empty()) {
    fail(said.call) << "expected " << said.directive->said
                    << " of a stage of pipeline '" << unit.pipeline.name << "'";
    return false;
  }
  llvm::SetVector<mlir::Attribute> stages;
  if (auto before = llvm::dyn_cast_or_null<mlir::ArrayAttr>(
          schedule.ofSchedule.get(said.directive->attribute)))
    stages.insert(before.begin(), before.end());
  for (unsigned other : said.marker->stages)
    stages.insert(mlir::FlatSymbolRefAttr::get(
        &context, unit.pipeline.stages[other].symbol));
  set(said, builder.getArrayAttr(stages.getArrayRef()));
  return true;
}

bool DirectiveReader::readLabel(const Said &said) {
  llvm::StringRef attribute = said.directive->attribute, text;
  if (!llvm::getConstantStringInfo(said.call->getArgOperand(0), text)) {
    fail(said.call) << "expected a name to be a constant";
    return false;
  }
  if (!piko::detail::isLabel(text.str().c_str())) {
    fail(said.call) << piko::detail::labelRule << text << "'";
    return false;
  }
  mlir::Attribute label = builder.getStringAttr(text);
  if (mlir::Attribute before = schedule.ofStage.get(attribute);
      before && before != label) {
    fail(said.call) << "expected one name of stage '" << stage.name
                    << "', but got " << before << " and " << label;
    return false;
  }
  for (const StageDescription &other : unit.pipeline.stages) {
    if (&other == &stage ||
        (other.schedule.ofStage.get(attribute) != label && other.name != text))
      continue;
    mlir::InFlightDiagnostic error = fail(said.call);
    error << "expected a name that no other stage has, but got " << label;
    error.attachNote(other.location)
        << "stage '" << other.name << "' is declared here";
    return false;
  }
  set(said, label);
  return true;
}

bool piko::readDirectives(llvm::Function &phase, StageDescription &stage,
                          const ParsedUnit &unit, mlir::MLIRContext &context) {
  return DirectiveReader(stage, unit, context).run(phase);
}
