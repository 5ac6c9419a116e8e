// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-set-directives: writes directives into stages, in the place of what they
// say.

#include "Authored/Schedules.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/StringSet.h"

namespace piko {
#define GEN_PASS_DEF_SETDIRECTIVES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// `stage:key=value`.
struct Directive {
  StringRef stage, key, value;
};

struct SetDirectivesPass : piko::impl::SetDirectivesBase<SetDirectivesPass> {
  using SetDirectivesBase::SetDirectivesBase;
  void runOnOperation() override;

private:
  LogicalResult apply(StringRef text, llvm::StringSet<> &known);
};

} // namespace

static std::optional<Directive> parseDirective(StringRef text) {
  auto [stage, rest] = text.split(':');
  auto [key, value] = rest.split('=');
  if (stage.empty() || key.empty() || value.empty())
    return std::nullopt;
  return Directive{stage, key, value};
}

/// The stage of that name, in C++ or here; null after an error.
static StageOp findStage(PipelineOp pipeline, StringRef name) {
  std::string names;
  for (auto stage : pipeline.getOps<StageOp>()) {
    auto member = stage->getAttrOfType<StringAttr>(cppNameAttr);
    if ((member && member == name) || getCppName(stage) == name ||
        stage.getSymName() == name)
      return stage;
    names += (names.empty() ? "'" : ", '") + getCppName(stage).str() + "'";
  }
  pipeline.emitError() << "piko-set-directives: expected a stage, but got '"
                       << name << "'; the pipeline has " << names;
  return {};
}

static InFlightDiagnostic refuse(StageOp stage, const Directive &directive) {
  return stage.emitError() << "piko-set-directives: cannot set "
                           << directive.key << " of stage '"
                           << getCppName(stage) << "' to '" << directive.value
                           << "': ";
}

static LogicalResult refuseValue(StageOp stage, const Directive &directive,
                                 StringRef expected) {
  return refuse(stage, directive) << "expected " << expected;
}

/// The schedule phase of a stage, which is made where there is none.
static ScheduleOp getOrCreateSchedule(StageOp stage) {
  if (ScheduleOp schedule = stage.getSchedule())
    return schedule;
  OpBuilder builder(stage.getContext());
  builder.setInsertionPoint(stage.getProcess());
  return ScheduleOp::create(builder, stage.getLoc(), ScheduleKind::LoadBalance);
}

static LogicalResult setSchedule(StageOp stage, const Directive &directive) {
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && !schedule.getBody().empty())
    return refuse(stage, directive) << "its schedule depends on the bin or on "
                                       "constants";
  if (directive.value == "none") {
    if (schedule && saysMoreThanCore(schedule))
      return refuse(stage, directive) << "its schedule says more than where "
                                         "bins run";
    if (schedule)
      schedule.erase();
    return success();
  }
  std::optional<ScheduleKind> kind = symbolizeScheduleKind(directive.value);
  if (!kind)
    return refuseValue(stage, directive,
                       "load_balance, direct_map, serialize, all or none");
  schedule = getOrCreateSchedule(stage);
  schedule.setKind(*kind);
  if (*kind != ScheduleKind::All)
    schedule.removeTileSplitAttr();
  return success();
}

static LogicalResult setSplit(StageOp stage, const Directive &directive) {
  int64_t split = 0;
  if (!llvm::to_integer(directive.value, split, 10) || split < 1)
    return refuseValue(stage, directive, "a number of primitives");
  ScheduleOp schedule = stage.getSchedule();
  if (!schedule || schedule.getKind() != ScheduleKind::All ||
      !schedule.getBody().empty())
    return refuse(stage, directive) << "its schedule is not all";
  schedule.setTileSplit(split);
  return success();
}

static LogicalResult setLanes(StageOp stage, const Directive &directive) {
  if (directive.value == "none") {
    if (ScheduleOp schedule = stage.getSchedule())
      schedule.removeLanesAttr();
    return success();
  }
  std::optional<LaneMapping> lanes = symbolizeLaneMapping(directive.value);
  if (!lanes)
    return refuseValue(stage, directive,
                       "items, iterations, collapsed, one or none");
  getOrCreateSchedule(stage).setLanes(*lanes);
  return success();
}

static LogicalResult setPrecision(StageOp stage, const Directive &directive) {
  std::optional<Precision> precision = symbolizePrecision(directive.value);
  if (!precision)
    return refuseValue(stage, directive, "strict, contracted or relaxed");
  stage.getProcess().setPrecision(*precision);
  return success();
}

static LogicalResult setUlps(StageOp stage, const Directive &directive) {
  int64_t ulps = 0;
  if (!llvm::to_integer(directive.value, ulps, 10) || ulps < 1)
    return refuseValue(stage, directive, "a number of units, at least 1");
  stage.getProcess().setUlps(ulps);
  return success();
}

static LogicalResult set(StageOp stage, const Directive &directive) {
  using Set = LogicalResult (*)(StageOp, const Directive &);
  static constexpr std::pair<StringLiteral, Set> keys[] = {
      {"schedule", setSchedule},
      {"split", setSplit},
      {"lanes", setLanes},
      {"precision", setPrecision},
      {"ulps", setUlps}};
  std::string expected;
  for (const auto &[key, set] : keys) {
    if (directive.key == key)
      return set(stage, directive);
    bool isLast = key == std::end(keys)[-1].first;
    expected += (expected.empty() ? "" : isLast ? " or " : ", ") + key.str();
  }
  return refuse(stage, directive)
         << "expected " << expected << ", because others may change results";
}

LogicalResult SetDirectivesPass::apply(StringRef text,
                                       llvm::StringSet<> &known) {
  PipelineOp pipeline = getOperation();
  std::optional<Directive> directive = parseDirective(text);
  if (!directive)
    return pipeline.emitError() << "piko-set-directives: expected "
                                   "STAGE:KEY=VALUE, but got '"
                                << text << "'";
  StageOp stage = findStage(pipeline, directive->stage);
  if (!stage)
    return failure();
  if (!stage.getProcess())
    return refuse(stage, *directive) << "it has no process phase";
  if (!known.insert(text.split('=').first).second)
    return refuse(stage, *directive) << "it is set twice";
  if (failed(set(stage, *directive)))
    return failure();
  stage.emitRemark() << directive->key << " of stage '" << getCppName(stage)
                     << "' is set to '" << directive->value << "'";
  return success();
}

void SetDirectivesPass::runOnOperation() {
  llvm::StringSet<> known;
  for (const std::string &text : directives)
    if (failed(apply(text, known)))
      return signalPassFailure();
}
