// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-strips: finds launches in a row that may take a source strip by
// strip. A launch is a node, with its join, and so is a cycle.
//
//   1. a node that one source alone feeds begins a group;
//   2. the next nodes join it as long as all that feeds them is in the group
//   and
//      nothing shows that they run before all primitives have come;
//   3. a group of two launches or more becomes a piko.strips.

#include "Support/StateAccess.h"

#include "Piko/Analysis/StageGraph.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_FORMSTRIPS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// A launch and what leads to it, or a cycle.
struct Node {
  SmallVector<Operation *> statements; ///< In order.
  int64_t launches = 0;
  llvm::SetVector<Operation *> stages;
};

/// Why a node is not in a group, and what shows it.
struct Objection {
  std::string text;
  Operation *culprit = nullptr;
};

/// What each stage does to state.
using Accesses = llvm::DenseMap<Operation *, llvm::MapVector<Attribute, int>>;

class StripGroup {
public:
  StripGroup(PipelineOp pipeline, const Accesses &accesses)
      : pipeline(pipeline), accesses(&accesses) {}

  /// Whether the node may be the first one, and the source that feeds it.
  std::optional<Objection> whyNotFirst(const Node &node);
  /// Whether the node may come next.
  std::optional<Objection> whyNotNext(const Node &node);
  void add(const Node &node);

  bool feeds(const Node &node);
  bool empty() const { return stages.empty(); }
  SmallVector<Operation *> statements; ///< In order.
  int64_t launches = 0;
  SmallVector<StageOp> stages; ///< In the order of launches.
  int64_t source = 0;

private:
  std::optional<Objection> whyNotAtAll(const Node &node);
  std::optional<Objection> findConflict(StageOp stage);
  SmallVector<int64_t> sourcesOf(StageOp stage);
  SmallVector<EdgeOp> edgesInto(const Node &node, StageOp stage);

  PipelineOp pipeline;
  const Accesses *accesses;
  /// The stage that began the lineage of what a stage of the group emits; null
  /// = the source.
  llvm::DenseMap<Operation *, Operation *> roots;
};

struct FormStripsPass : piko::impl::FormStripsBase<FormStripsPass> {
  void runOnOperation() override;
  void finish(const StripGroup &group);
  void refuse(StageOp stage, const Objection &reason);
};

} // namespace

//===----------------------------------------------------------------------===//
// What may run in strips
//===----------------------------------------------------------------------===//

SmallVector<int64_t> StripGroup::sourcesOf(StageOp stage) {
  SmallVector<int64_t> numbers;
  for (auto [number, source] : llvm::enumerate(pipeline.getOps<SourceOp>()))
    if (source.getStageAttr().getAttr() == stage.getSymNameAttr())
      numbers.push_back(number);
  return numbers;
}

/// The edges into a stage but for those from its own node.
SmallVector<EdgeOp> StripGroup::edgesInto(const Node &node, StageOp stage) {
  SmallVector<EdgeOp> edges;
  for (auto edge : pipeline.getOps<EdgeOp>())
    if (edge.getConsumerAttr().getAttr() == stage.getSymNameAttr() &&
        !node.stages.contains(
            lookupInPipeline<StageOp>(edge, edge.getProducerAttr())))
      edges.push_back(edge);
  return edges;
}

static std::string quoteName(StageOp stage) {
  return ("'" + getCppName(stage) + "'").str();
}

/// What one stage writes and another one sees shows when they run.
std::optional<Objection> StripGroup::findConflict(StageOp stage) {
  for (auto [state, mine] : accesses->lookup(stage))
    for (StageOp other : stages) {
      int theirs = accesses->lookup(other).lookup(state), both = mine | theirs;
      if (other == stage || !theirs || both == StateAccess::reads ||
          both == StateAccess::changesAtomically)
        continue;
      return Objection{("it and stage " + quoteName(other) + " both use @" +
                        cast<FlatSymbolRefAttr>(state).getValue() +
                        ", which one of them writes")
                           .str(),
                       other};
    }
  return std::nullopt;
}

std::optional<Objection> StripGroup::whyNotAtAll(const Node &node) {
  for (Operation *op : node.stages) {
    auto stage = cast<StageOp>(op);
    ScheduleOp schedule = stage.getSchedule();
    if (stage.getTakesList())
      return Objection{
          "its process phase takes a list, which must be complete"};
    if (schedule && schedule.getEndBin())
      return Objection{"it waits until nothing can reach its bins", schedule};
    if (!stage.collects())
      continue;
    if (isOnCycle(stage))
      return Objection{"it waits and is on a cycle, which runs in rounds",
                       schedule};
    for (auto name :
         schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>()) {
      auto other = lookupInPipeline<StageOp>(stage, name);
      if (llvm::is_contained(stages, other))
        return Objection{"it waits for stage " + quoteName(other) +
                             ", which runs in the same strips",
                         schedule};
    }
    if (!stage.isWholeDomain() && !stage.getOutputs().empty())
      return Objection{"it waits, so that what it emits is in the order of its "
                       "bins",
                       schedule};
  }
  return std::nullopt;
}

bool StripGroup::feeds(const Node &node) {
  return llvm::any_of(node.stages, [&](Operation *stage) {
    return llvm::any_of(
        edgesInto(node, cast<StageOp>(stage)), [&](EdgeOp edge) {
          return llvm::is_contained(
              stages, lookupInPipeline<StageOp>(edge, edge.getProducerAttr()));
        });
  });
}

std::optional<Objection> StripGroup::whyNotFirst(const Node &node) {
  SmallVector<int64_t> sources;
  for (Operation *op : node.stages) {
    auto stage = cast<StageOp>(op);
    sources.append(sourcesOf(stage));
    for (EdgeOp edge : edgesInto(node, stage))
      return Objection{"stage " +
                           quoteName(lookupInPipeline<StageOp>(
                               edge, edge.getProducerAttr())) +
                           ", which feeds it, does not run in strips with it",
                       edge};
  }
  if (sources.empty())
    return Objection{"nothing feeds it"};
  if (sources.size() > 1)
    return Objection{"several sources feed it"};
  if (auto reason = whyNotAtAll(node))
    return reason;
  source = sources.front();
  return std::nullopt;
}

std::optional<Objection> StripGroup::whyNotNext(const Node &node) {
  SmallVector<Operation *> lineages;
  for (Operation *op : node.stages) {
    auto stage = cast<StageOp>(op);
    if (empty() || !sourcesOf(stage).empty())
      return Objection{"a source feeds it, too"};
    for (EdgeOp edge : edgesInto(node, stage)) {
      auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
      if (!llvm::is_contained(stages, producer))
        return Objection{"stage " + quoteName(producer) +
                             ", which feeds it, does not run in strips with it",
                         edge};
      lineages.push_back(roots.lookup(producer));
    }
  }
  if (lineages.empty())
    return Objection{"nothing feeds it"};
  if (!llvm::all_equal(lineages))
    return Objection{
        "what reaches it is of several lineages, one of which comes "
        "after the other"};
  if (auto reason = whyNotAtAll(node))
    return reason;
  for (Operation *op : node.stages)
    if (auto reason = findConflict(cast<StageOp>(op)))
      return reason;
  return std::nullopt;
}

void StripGroup::add(const Node &node) {
  Operation *root = nullptr;
  for (Operation *op : node.stages)
    for (EdgeOp edge : edgesInto(node, cast<StageOp>(op)))
      root =
          roots.lookup(lookupInPipeline<StageOp>(edge, edge.getProducerAttr()));
  for (Operation *op : node.stages) {
    auto stage = cast<StageOp>(op);
    stages.push_back(stage);
    roots[stage] = stage.collects() ? op : root;
  }
  llvm::append_range(statements, node.statements);
  launches += node.launches;
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// The joins, waits and kernels of sources that come before a launch.
static void addOperands(Operation *op, Node &node) {
  for (Value operand : op->getOperands())
    if (Operation *before = operand.getDefiningOp();
        before && isa<JoinOp, LaunchOp>(before)) {
      auto launch = dyn_cast<LaunchOp>(before);
      if (launch && !getAssignedSource(launch.getKernelOp()))
        continue;
      node.launches += isa<LaunchOp>(before);
      addOperands(before, node);
      node.statements.push_back(before);
    }
}

static SmallVector<Node> findNodes(ProgramOp program) {
  SmallVector<Node> nodes;
  SmallVector<Operation *> waits;
  for (Operation &op : *program.getBodyBlock()) {
    auto launch = dyn_cast<LaunchOp>(op);
    if (isa<WaitOp>(op))
      waits.push_back(&op);
    if (!isa<WavesOp, RoundsOp>(op) &&
        (!launch || getStages(launch.getKernelOp()).empty()))
      continue;
    Node &node = nodes.emplace_back();
    std::swap(node.statements, waits);
    addOperands(&op, node);
    node.statements.push_back(&op);
    op.walk([&](LaunchOp inner) {
      ++node.launches;
      for (StageOp stage : getStages(inner.getKernelOp()))
        node.stages.insert(stage);
    });
  }
  return nodes;
}

/// What the phases of each stage do, wherever they are.
static Accesses findAccesses(PipelineOp pipeline) {
  Accesses accesses;
  pipeline.walk([&](Operation *op) {
    if (auto [state, access] = getStateAccess(op); state)
      accesses[getPhaseStage(op)][state] |= access;
  });
  return accesses;
}

void FormStripsPass::refuse(StageOp stage, const Objection &reason) {
  InFlightDiagnostic remark = stage.emitRemark()
                              << "stage '" << getCppName(stage)
                              << "' does not run in strips: " << reason.text;
  // The front end has one place for a stage and its schedule.
  if (reason.culprit && reason.culprit->getLoc() != stage.getLoc())
    remark.attachNote(reason.culprit->getLoc()) << "because of this";
}

/// The tile of `All` is what the whole machine takes at a time.
static IntegerAttr getChunk(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  bool isTiled = schedule && schedule.getKind() == ScheduleKind::All &&
                 schedule.getBody().empty() && stage.isWholeDomain();
  return isTiled ? schedule.getTileSplitAttr() : IntegerAttr();
}

/// What leads from some statements to others.
static SmallVector<Value> findLeaving(ArrayRef<Operation *> statements) {
  SmallVector<Value> leaving;
  for (Operation *op : statements)
    for (Value result : op->getResults())
      if (llvm::none_of(result.getUsers(), [&](Operation *user) {
            return llvm::is_contained(statements, user);
          }))
        leaving.push_back(result);
  return leaving;
}

void FormStripsPass::finish(const StripGroup &group) {
  if (group.empty())
    return;
  StageOp first = group.stages.front();
  if (group.launches == 1)
    return refuse(first, {"no stage that could follow it in them takes what it "
                          "emits"});
  FeedOp feed;
  for (auto found : getProgram(getOperation()).getOps<FeedOp>())
    if (found.getSource() == group.source)
      feed = found;
  SmallVector<Value> leaving = findLeaving(group.statements);
  Operation *front = group.statements.front();
  OpBuilder builder(feed->isBeforeInBlock(front) ? front : feed->getNextNode());
  auto strips = StripsOp::create(
      builder, first.getLoc(), llvm::to_vector(ValueRange(leaving).getTypes()),
      feed.getEdge(), getChunk(first));
  for (auto [value, result] : llvm::zip(leaving, strips.getEdges()))
    value.replaceAllUsesWith(result);
  Block *body = builder.createBlock(&strips.getBody());
  Value strip = body->addArgument(feed.getEdge().getType(), feed.getLoc());
  feed.getEdge().replaceUsesWithIf(
      strip, [&](OpOperand &use) { return use.getOwner() != strips; });
  for (Operation *statement : group.statements)
    statement->moveBefore(body, body->end());
  LeaveOp::create(builder, first.getLoc(), leaving, ValueRange());
}

void FormStripsPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  Accesses accesses = findAccesses(pipeline);
  StripGroup group(pipeline, accesses);
  ProgramOp program = getProgram(pipeline);
  if (!program) {
    pipeline.emitError("expected a piko.program, which piko-form-program "
                       "makes");
    return signalPassFailure();
  }
  for (const Node &node : findNodes(program)) {
    std::optional<Objection> notNext = group.whyNotNext(node);
    if (!notNext) {
      group.add(node);
      continue;
    }
    bool isFedByGroup = group.feeds(node);
    finish(group);
    group = StripGroup(pipeline, accesses);
    if (auto notFirst = group.whyNotFirst(node))
      refuse(cast<StageOp>(node.stages.front()),
             isFedByGroup ? *notNext : *notFirst);
    else
      group.add(node);
  }
  finish(group);
}
