// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-fuse-stages, for each edge, producers first:
//   1. check that both stages run for the same bin on the same core;
//   2. put the consumer's phases where the producer emits, with the emitted
//      numbers in place of the primitive's fields;
//   3. give the consumer's ports and edges to the producer, and drop the
//      consumer.

#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Analysis/StageGraph.h"
#include "Piko/Analysis/Uniformity.h"

#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/LoopLikeInterface.h"

namespace piko {
#define GEN_PASS_DEF_FUSESTAGES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FuseStagesPass : piko::impl::FuseStagesBase<FuseStagesPass> {
  using FuseStagesBase::FuseStagesBase;
  void runOnOperation() override;
  LogicalResult check(EdgeOp edge, Refusal &refusal) {
    return check(edge, lookupInPipeline<StageOp>(edge, edge.getProducerAttr()),
                 refusal);
  }
  LogicalResult check(EdgeOp edge, StageOp host, Refusal &refusal);
  bool emitsFurther(StageOp stage, StageOp host);
  bool runsBetterAfter(EdgeOp edge);
};

/// Makes a stage part of the one that feeds it.
class Fusion {
public:
  Fusion(EdgeOp edge)
      : edge(edge),
        producer(lookupInPipeline<StageOp>(edge, edge.getProducerAttr())),
        consumer(lookupInPipeline<StageOp>(edge, edge.getConsumerAttr())),
        record(lookupRecord(consumer, consumer.getInputAttr())) {}
  void run();

private:
  void replaceEmit(EmissionOpInterface emit);
  /// Copies what a phase does to where `builder` stands, for the primitive that
  /// `emit` emits, and shows each operation to `visit`.
  void copyBody(OpBuilder &builder, Region &phase, EmissionOpInterface emit,
                llvm::function_ref<void(Operation *)> visit);
  void replaceFields(Value prim, EmissionOpInterface emit);
  Value createArray(OpBuilder &builder, FieldAttr field,
                    EmissionOpInterface emit);
  int64_t renumber(int64_t port) { return port - (port > fusedPort()); }
  int64_t fusedPort() { return edge.getPort(); }
  void takePorts();
  void takeWaits();

  EdgeOp edge;
  StageOp producer, consumer;
  RecordOp record;
};

} // namespace

//===----------------------------------------------------------------------===//
// Conditions
//===----------------------------------------------------------------------===//

/// The schedule kind that a stage's text asks for, if it asks for one.
static std::optional<ScheduleKind> getAskedKind(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return schedule ? std::optional(schedule.getKind()) : std::nullopt;
}

/// Two schedules that put one bin onto one core.
static LogicalResult checkSchedules(StageOp producer, StageOp consumer,
                                    Refusal &refusal) {
  auto refuse = [&](StageOp stage, const Twine &why) {
    ScheduleOp schedule = stage.getSchedule();
    refusal = {schedule ? schedule.getOperation() : stage.getOperation(),
               why.str()};
    return failure();
  };
  for (StageOp stage : {producer, consumer})
    if (ScheduleOp schedule = stage.getSchedule();
        schedule && !schedule.getBody().empty())
      return refuse(stage, "the schedule of stage '" + getCppName(stage) +
                               "' depends on the bin");
  ScheduleOp first = producer.getSchedule(), second = consumer.getSchedule();
  if ((first && first.getUnordered()) != (second && second.getUnordered()))
    return refuse(second ? consumer : producer,
                  "only one of the stages is unordered");
  if (second && second.getLanes())
    return refuse(consumer, "the lanes of stage '" + getCppName(consumer) +
                                "' are specified");
  std::optional<ScheduleKind> kind = getAskedKind(consumer);
  if (!kind)
    return success(); // wherever its primitives are
  ScheduleKind before =
      getAskedKind(producer).value_or(ScheduleKind::LoadBalance);
  if (*kind == ScheduleKind::LoadBalance)
    return refuse(consumer, "load_balance lets any core take the bin");
  if (*kind != before)
    return refuse(consumer, stringifyScheduleKind(*kind) +
                                " may choose another core than " +
                                stringifyScheduleKind(before) + " of stage '" +
                                getCppName(producer) + "'");
  if (second.getTileSplit() != first.getTileSplit())
    return refuse(consumer, "bins are cut at other sizes");
  return success();
}

/// The loop around an operation in whose iterations an assignment would count
/// once for all, or null.
static Operation *getLoopAround(Operation *op) {
  for (Operation *parent = op->getParentOp(); !isa<AssignOp>(parent);
       parent = parent->getParentOp())
    if (!isa<scf::IfOp, scf::IndexSwitchOp>(parent))
      return parent;
  return nullptr;
}

/// Checks an edge whose producer is, or will be, part of `host`.
LogicalResult FuseStagesPass::check(EdgeOp edge, StageOp host,
                                    Refusal &refusal) {
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
  auto refuse = [&](Operation *at, const Twine &why) {
    refusal = {at, why.str()};
    return failure();
  };
  for (StageOp stage : {producer, consumer})
    if (isOnCycle(stage))
      return refuse(stage, "stage '" + getCppName(stage) + "' is on a cycle");
  if (hasSource(consumer) || getEdgesInto(consumer).size() != 1)
    return refuse(consumer, "it is fed from several places");
  if (producer.getBins() != consumer.getBins())
    return refuse(consumer, "its bins are of another size");
  if (producer.getTile() || consumer.getTile())
    return refuse(consumer, "bins are divided into tiles");
  if (consumer.collects())
    return refuse(consumer, "it waits until no primitive can reach it");
  if (ScheduleOp schedule = consumer.getSchedule();
      schedule && schedule.getAfter())
    return refuse(consumer, "its loops fill vectors after the other");
  if (failed(checkSchedules(producer.getSchedule() ? producer : host, consumer,
                            refusal)))
    return failure();

  AssignOp assign = consumer.getAssign();
  if (!assign && !consumer.isWholeDomain())
    return refuse(consumer, "it has no assign phase");
  if (assign) {
    Operation *only = getOnlyAssignment(assign);
    if (!isa_and_nonnull<AssignPreviousOp>(only))
      return refuse(only ? only : assign.getOperation(),
                    "the bin is not known to be the same");
    if (Operation *loop = getLoopAround(only))
      return refuse(loop, "it is assigned in a loop");
  }

  SmallVector<EmissionOpInterface> emits = getEmits(producer, edge.getPort());
  if (int64_t(emits.size()) > maxCopies)
    return refuse(emits.back(),
                  "it would be copied to " + Twine(emits.size()) + " places");
  for (Operation *phase : {assign ? assign.getOperation() : nullptr,
                           consumer.getProcess().getOperation()}) {
    if (!phase)
      continue;
    for (Operation *user : phase->getRegion(0).getArgument(0).getUsers())
      if (!isa<GetOp>(user))
        return refuse(user, "the primitive is used whole");
    WalkResult barrier = phase->walk([&](ParallelLoopOpInterface loop) {
      if (!loop.hasBarriers())
        return WalkResult::advance();
      refusal = {loop, "its iterations meet"};
      return WalkResult::interrupt();
    });
    if (barrier.wasInterrupted())
      return failure();
  }
  for (EmissionOpInterface emit : emits)
    for (auto loop = emit->getParentOfType<ParallelLoopOpInterface>(); loop;
         loop = loop->getParentOfType<ParallelLoopOpInterface>())
      if (loop.hasBarriers())
        return refuse(emit, "it is emitted between iterations that meet");
  return success();
}

//===----------------------------------------------------------------------===//
// Loop fission
//===----------------------------------------------------------------------===//

static bool isLoop(Operation *op) {
  return isa<LoopLikeOpInterface, ParallelLoopOpInterface>(op);
}

/// Whether a phase has a loop that is not over pixels or iterations.
static bool hasLoop(ProcessOp process) {
  return process
      ->walk([](LoopLikeOpInterface) { return WalkResult::interrupt(); })
      .wasInterrupted();
}

/// Whether a stage, with all that become part of it, emits to another.
bool FuseStagesPass::emitsFurther(StageOp stage, StageOp host) {
  return llvm::any_of(getEdgesFrom(stage), [&](EdgeOp edge) {
    Refusal refusal;
    auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
    return failed(check(edge, host, refusal)) || emitsFurther(consumer, host);
  });
}

/// Whether all that a stage emits stays in its bin, and meets nothing else:
/// lineage is not needed, as it is in order there.
static bool staysInBin(StageOp stage) {
  return llvm::all_of(getEdgesFrom(stage), [&](EdgeOp edge) {
    auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
    AssignOp assign = consumer.getAssign();
    return assign && consumer.getBins() == stage.getBins() &&
           !isOnCycle(consumer) && !hasSource(consumer) &&
           getEdgesInto(consumer).size() == 1 &&
           isa_and_nonnull<AssignPreviousOp>(getOnlyAssignment(assign)) &&
           !consumer.getTile() && staysInBin(consumer);
  });
}

/// Whether a consumer that can be fused is better run after its producer, bin
/// by bin: loops of what is emitted in a loop are run for the few iterations
/// that emit at a time, and lanes of a vector have nothing to do; from a list
/// they are full. What only ends in pixels has piko-defer-shading for that.
bool FuseStagesPass::runsBetterAfter(EdgeOp edge) {
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
  if (producer.isWholeDomain() || !hasLoop(consumer.getProcess()) ||
      !getWrittenState(consumer.getProcess()).empty())
    return false;
  if (ScheduleOp schedule = producer.getSchedule();
      schedule && (schedule.getTileSplit() || schedule.getUnordered()))
    return false;
  bool isInLoop = llvm::any_of(
      getEmits(producer, edge.getPort()), [&](EmissionOpInterface emit) {
        Operation *at = emit->getParentOp();
        while (at != producer.getProcess() && !isLoop(at))
          at = at->getParentOp();
        return at != producer.getProcess();
      });
  llvm::DenseSet<StringAttr> written = getWrittenState(producer.getProcess());
  bool readsChanges =
      consumer.getProcess()
          ->walk([&](StateAccessOpInterface access) {
            return written.contains(access.getAccessedState().getAttr())
                       ? WalkResult::interrupt()
                       : WalkResult::advance();
          })
          .wasInterrupted();
  return isInLoop && !readsChanges && staysInBin(consumer) &&
         emitsFurther(consumer, producer);
}

/// Lets a stage run after its producer, on the same core.
static void runAfter(StageOp stage, StageOp producer) {
  ScheduleOp schedule = stage.getSchedule();
  OpBuilder builder(stage.getProcess());
  if (!schedule) {
    ScheduleOp before = producer.getSchedule();
    schedule = ScheduleOp::create(
        builder, stage.getLoc(),
        getAskedKind(producer).value_or(ScheduleKind::LoadBalance));
    schedule.setResolved(before && before.getResolved());
  }
  schedule.setAfter(true);
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

/// The numbers of an array field, in memory that an index can choose from.
Value Fusion::createArray(OpBuilder &builder, FieldAttr field,
                          EmissionOpInterface emit) {
  Location loc = emit.getLoc();
  int64_t first = getElementIndex(record, field.getName());
  Value array = memref::AllocaOp::create(
      builder, loc,
      MemRefType::get({field.getElementCount()}, field.getType()));
  for (int64_t i = 0; i < field.getElementCount(); ++i) {
    Value at = arith::ConstantIndexOp::create(builder, loc, i);
    memref::StoreOp::create(builder, loc, emit.getNumbers()[first + i], array,
                            at);
  }
  return array;
}

/// The number of an element with these indices, if they are constant and in
/// range.
static std::optional<int64_t> getConstantElement(GetOp get, FieldAttr field) {
  int64_t element = 0;
  for (auto [index, count] : llvm::zip(get.getElements(), field.getCounts())) {
    APInt constant;
    if (!matchPattern(index, m_ConstantInt(&constant)) ||
        constant.getSExtValue() < 0 || constant.getSExtValue() >= count)
      return std::nullopt;
    element = element * count + constant.getSExtValue();
  }
  return element;
}

void Fusion::replaceFields(Value prim, EmissionOpInterface emit) {
  llvm::DenseMap<StringAttr, Value> arrays;
  for (Operation *user : llvm::make_early_inc_range(prim.getUsers())) {
    auto get = cast<GetOp>(user);
    FieldAttr field = record.getField(get.getField());
    int64_t first = getElementIndex(record, get.getField());
    if (std::optional<int64_t> element = getConstantElement(get, field)) {
      get.replaceAllUsesWith(emit.getNumbers()[first + *element]);
      get.erase();
      continue;
    }
    Value &array = arrays[get.getFieldAttr()];
    if (!array) {
      OpBuilder atEmit(prim.getDefiningOp());
      array = createArray(atEmit, field, emit);
    }
    OpBuilder builder(get);
    Value index;
    for (auto [element, count] :
         llvm::zip(get.getElements(), field.getCounts())) {
      if (!index) {
        index = element;
        continue;
      }
      Value extent =
          arith::ConstantIndexOp::create(builder, get.getLoc(), count);
      index = arith::MulIOp::create(builder, get.getLoc(), index, extent);
      index = arith::AddIOp::create(builder, get.getLoc(), index, element);
    }
    Value number = memref::LoadOp::create(builder, get.getLoc(), array, index);
    get.replaceAllUsesWith(number);
    get.erase();
  }
}

void Fusion::copyBody(OpBuilder &builder, Region &phase,
                      EmissionOpInterface emit,
                      llvm::function_ref<void(Operation *)> visit) {
  auto prim = ub::PoisonOp::create(builder, emit.getLoc(),
                                   phase.getArgument(0).getType(),
                                   ub::PoisonAttr::get(builder.getContext()));
  IRMapping mapping;
  mapping.map(phase.getArgument(0), prim);
  for (Operation &op : phase.front().without_terminator())
    builder.clone(op, mapping)->walk([&](Operation *copy) {
      noteOrigin(copy, consumer, isa<AssignOp>(phase.getParentOp()));
      visit(copy);
    });
  replaceFields(prim, emit);
  prim.erase();
}

void Fusion::replaceEmit(EmissionOpInterface emit) {
  OpBuilder builder(emit);
  AssignPreviousOp assignment;
  if (AssignOp assign = consumer.getAssign()) {
    copyBody(builder, assign.getBody(), emit, [&](Operation *op) {
      if (auto found = dyn_cast<AssignPreviousOp>(op))
        assignment = found;
    });
    builder.setInsertionPoint(assignment);
  }
  // The consumer's ports follow the producer's.
  int64_t ports = producer.getOutputs().size() - 1;
  SmallVector<EmissionOpInterface> emits;
  copyBody(builder, consumer.getProcess().getBody(), emit, [&](Operation *op) {
    if (auto inner = dyn_cast<EmissionOpInterface>(op))
      emits.push_back(inner);
  });
  for (EmissionOpInterface inner : emits)
    asEmit(inner).setPort(ports + inner.getPort());
  if (assignment)
    assignment.erase();
  emit.erase();
}

void Fusion::takePorts() {
  SmallVector<Attribute> outputs(producer.getOutputs().getValue());
  int64_t kept = outputs.size() - 1;
  outputs.erase(outputs.begin() + fusedPort());
  llvm::append_range(outputs, consumer.getOutputs());
  for (EdgeOp other : getEdgesFrom(producer))
    other.setPort(renumber(other.getPort()));
  for (EdgeOp other : getEdgesFrom(consumer)) {
    other.setProducerAttr(edge.getProducerAttr());
    other.setPort(kept + other.getPort());
  }
  producer.setOutputsAttr(ArrayAttr::get(producer.getContext(), outputs));
}

/// Who waited for the consumer now waits for the producer.
void Fusion::takeWaits() {
  for (auto stage : getPipeline(producer).getOps<StageOp>()) {
    ScheduleOp schedule = stage.getSchedule();
    if (!schedule || !schedule.getEndStageAttr())
      continue;
    SmallVector<Attribute> waits;
    for (Attribute wait : schedule.getEndStageAttr()) {
      if (wait == edge.getConsumerAttr())
        wait = edge.getProducerAttr();
      if (!llvm::is_contained(waits, wait))
        waits.push_back(wait);
    }
    schedule.setEndStageAttr(ArrayAttr::get(stage.getContext(), waits));
  }
}

void Fusion::run() {
  SmallVector<EmissionOpInterface> emits = getEmits(producer, fusedPort());
  // The producer's own emissions first, as the consumer's are put among them.
  producer.walk([&](EmissionOpInterface emit) {
    if (emit.getPort() > fusedPort())
      asEmit(emit).setPort(renumber(emit.getPort()));
  });
  for (EmissionOpInterface emit : emits)
    replaceEmit(emit);
  takeWaits();
  SmallVector<Attribute> names;
  if (ArrayAttr before = producer.getFusedAttr())
    llvm::append_range(names, before);
  names.push_back(consumer.getSymNameAttr());
  if (ArrayAttr inside = consumer.getFusedAttr())
    llvm::append_range(names, inside);
  producer.setFusedAttr(ArrayAttr::get(producer.getContext(), names));
  producer.setThreads(std::max(producer.getThreads(), consumer.getThreads()));
  takePorts();
  edge.erase();
  consumer.erase();
}

void FuseStagesPass::runOnOperation() {
  SmallVector<StageOp> stages(getOperation().getOps<StageOp>());
  llvm::SmallDenseSet<Operation *> gone;
  for (StageOp producer : stages) {
    if (gone.contains(producer) || !producer.getProcess())
      continue;
    for (bool changed = true; changed;) {
      changed = false;
      for (EdgeOp edge : getEdgesFrom(producer)) {
        auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
        Refusal refusal;
        if (failed(check(edge, refusal)))
          continue;
        if (fission && runsBetterAfter(edge)) {
          runAfter(consumer, producer);
          consumer.emitRemark()
              << "stage '" << getCppName(consumer) << "' takes what stage '"
              << getCppName(producer)
              << "' emits in a loop from a list, as its own loops fill vectors "
                 "there";
          continue;
        }
        consumer.emitRemark()
            << "stage '" << getCppName(consumer) << "' runs inside stage '"
            << getCppName(producer) << "'";
        gone.insert(consumer);
        Fusion(edge).run();
        changed = true;
        break;
      }
    }
    for (EdgeOp edge : getEdgesFrom(producer)) {
      Refusal refusal;
      (void)check(edge, refusal);
      auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
      InFlightDiagnostic remark = consumer.emitRemark()
                                  << "stage '" << getCppName(consumer)
                                  << "' is not fused with stage '"
                                  << getCppName(producer) << "'";
      remark.attachNote(refusal.at->getLoc()) << refusal.why;
    }
  }
}
