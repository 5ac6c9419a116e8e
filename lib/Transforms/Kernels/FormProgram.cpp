// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-program: writes down the run of a pipeline, kernel by kernel. All
// kernels of a cycle go into one region, where the first of them stands:
//
//   waves    a cycle of stages that do not collect. All edges of the cycle go
//            around, so that a wave takes what the one before it emitted.
//   rounds   a cycle with stages that collect: waves, and stages that are on no
//            such cycle, producers first; then the stages that collect. An edge
//            goes around where its consumer stands before its producer.

#include "Piko/Analysis/ProgramPlan.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Transforms/Passes.h"

namespace piko {
#define GEN_PASS_DEF_FORMPROGRAM
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FormProgramPass : piko::impl::FormProgramBase<FormProgramPass> {
  void runOnOperation() override;
};

using Edges = SmallVector<const PlannedEdge *>;

/// A loop of a cycle, or a stage of it.
struct Part {
  SmallVector<int> stages;
  bool isLoop;
};

class ProgramWriter {
public:
  ProgramWriter(PipelineOp pipeline, const ProgramPlan &plan)
      : pipeline(pipeline), plan(plan), builder(pipeline.getContext()) {}

  LogicalResult run();

private:
  LogicalResult findKernels();
  void setRoots(ProgramOp program);
  void clearState();
  void createKernel(KernelOp kernel);
  void createInputs(ArrayRef<int> stages);
  void assignSource(KernelOp kernel);
  void createLaunch(int stage, std::optional<int64_t> turn = std::nullopt);
  JoinOp createJoin(int stage);
  SmallVector<StageOp> getAwaited(StageOp stage);
  void createWaits(StageOp stage);
  void createCycle(int component);
  void createRounds(ArrayRef<int> stages);
  SmallVector<Part> sortParts(ArrayRef<int> stages);
  void createWaves(int loop);
  template <typename OpT>
  OpT createRegion(ArrayRef<int> stages, const Edges &around,
                   function_ref<void()> body);
  Edges findEdges(function_ref<bool(const PlannedEdge &)> isWanted);
  Type getType(const PlannedEdge &edge);
  void setValue(Operation *edge, Value value);
  Value takeValue(const PlannedEdge &edge);
  SmallVector<Value> takeValues(const Edges &edges);
  void remark(JoinOp join, int stage);
  std::string describe(const PlannedEdge &edge);

  PipelineOp pipeline;
  const ProgramPlan &plan;
  OpBuilder builder;
  llvm::DenseMap<Operation *, Value> values; ///< By source or edge.
  /// The same, at the end of the region, of edges that go around in it.
  llvm::DenseMap<Operation *, Value> aroundValues;
  llvm::DenseMap<int, KernelOp> kernels; ///< Of process phases.
  SmallVector<KernelOp> assigns;         ///< Of sources.
  llvm::DenseSet<Operation *> created;   ///< Kernels.
  llvm::DenseSet<int> componentsDone;
};

} // namespace

//===----------------------------------------------------------------------===//
// Edges as values
//===----------------------------------------------------------------------===//

Edges ProgramWriter::findEdges(
    function_ref<bool(const PlannedEdge &)> isWanted) {
  Edges found;
  for (const PlannedEdge &edge : plan.edges)
    if (!edge.local && isWanted(edge))
      found.push_back(&edge);
  return found;
}

Type ProgramWriter::getType(const PlannedEdge &edge) {
  StageOp stage = plan.graph.getStage(edge.consumer);
  return EdgeType::get(builder.getContext(), stage.getInputAttr());
}

Value ProgramWriter::takeValue(const PlannedEdge &edge) {
  Value &value = values[edge.op];
  if (!value && edge.producer < 0)
    value = FeedOp::create(builder, edge.op->getLoc(), getType(edge),
                           int64_t(edge.port));
  return value;
}

void ProgramWriter::setValue(Operation *edge, Value value) {
  auto around = aroundValues.find(edge);
  (around == aroundValues.end() ? values[edge] : around->second) = value;
}

SmallVector<Value> ProgramWriter::takeValues(const Edges &edges) {
  return llvm::map_to_vector(
      edges, [&](const PlannedEdge *edge) { return takeValue(*edge); });
}

//===----------------------------------------------------------------------===//
// Launches
//===----------------------------------------------------------------------===//

static std::string quote(StageOp stage) {
  return ("'" + getCppName(stage) + "'").str();
}

std::string ProgramWriter::describe(const PlannedEdge &edge) {
  return edge.producer < 0
             ? "source " + std::to_string(edge.port)
             : "stage " + quote(plan.graph.getStage(edge.producer));
}

/// Says why a join is more than a concatenation.
void ProgramWriter::remark(JoinOp join, int stage) {
  StageOp consumer = plan.graph.getStage(stage);
  std::string from;
  for (const PlannedEdge *edge : plan.getInputs(stage)) {
    from += (from.empty() ? "" : ", ") + describe(*edge);
    if (!edge->permute)
      continue;
    StageOp producer = plan.graph.getStage(edge->producer);
    edge->op->emitRemark("what stage ")
        << quote(producer) << " emits to stage " << quote(consumer)
        << " is permuted: it runs " << (producer.getTile() ? "tile" : "bin")
        << " by " << (producer.getTile() ? "tile" : "bin")
        << ", which is not the order of lineage";
  }
  if (!join.getMerge())
    return;
  int64_t width = 0;
  for (int64_t keys : join.getKeys())
    width = std::max(width, keys);
  consumer.emitRemark("what comes to stage ")
      << quote(consumer) << " is merged by keys of " << width
      << (width == 1 ? " word" : " words") << ": it comes from " << from;
}

JoinOp ProgramWriter::createJoin(int stage) {
  StageOp consumer = plan.graph.getStage(stage);
  Edges edges;
  SmallVector<bool> permutes;
  SmallVector<int64_t> keys;
  for (const PlannedEdge *edge : plan.getInputs(stage)) {
    edges.push_back(edge);
    permutes.push_back(edge->permute);
    keys.push_back(edge->keys);
  }
  bool isKeyed = llvm::any_of(keys, [](int64_t width) { return width > 0; });
  int64_t keeps = plan.keeps[stage];
  auto join = JoinOp::create(
      builder, consumer.getLoc(),
      BinsType::get(builder.getContext(), consumer.getInputAttr()),
      consumer.getSymName(), isKeyed && plan.merges(stage), takeValues(edges),
      permutes, keys, keeps ? builder.getI64IntegerAttr(keeps) : IntegerAttr());
  remark(join, stage);
  return join;
}

/// Waits that no edge implies.
/// The stages whose end a stage waits for though no edges lead there.
SmallVector<StageOp> ProgramWriter::getAwaited(StageOp stage) {
  SmallVector<StageOp> awaited;
  ScheduleOp schedule = stage.getSchedule();
  if (!schedule || !schedule.getEndStageAttr())
    return awaited;
  int number = plan.graph.getNumber(stage);
  for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
    if (!plan.isReached(plan.graph.getNumber(name), number))
      awaited.push_back(plan.graph.getStage(plan.graph.getNumber(name)));
  return awaited;
}

void ProgramWriter::createWaits(StageOp stage) {
  for (StageOp awaited : getAwaited(stage))
    WaitOp::create(builder, stage.getSchedule().getLoc(),
                   FlatSymbolRefAttr::get(awaited.getSymNameAttr()));
}

void ProgramWriter::createLaunch(int stage, std::optional<int64_t> turn) {
  KernelOp kernel = kernels.at(stage);
  for (StageOp member : getStages(kernel))
    createWaits(member);
  Value bins = createJoin(stage).getBins();
  SmallVector<EdgeOp> edges = getEmittedEdges(kernel);
  SmallVector<Type> types;
  for (EdgeOp edge : edges)
    types.push_back(
        EdgeType::get(builder.getContext(),
                      lookupInPipeline<StageOp>(edge, edge.getConsumerAttr())
                          .getInputAttr()));
  auto launch = LaunchOp::create(
      builder, kernel.getLoc(), types, kernel.getSymName(), bins,
      turn ? builder.getI64IntegerAttr(*turn) : IntegerAttr(),
      /*clears=*/nullptr);
  for (auto [edge, value] : llvm::zip(edges, launch.getEdges()))
    setValue(edge, value);
}

/// The primitives of a source get their bins where its kernel stands.
void ProgramWriter::assignSource(KernelOp kernel) {
  const PlannedEdge &edge = plan.edges[*getAssignedSource(kernel)];
  values[edge.op] =
      LaunchOp::create(builder, kernel.getLoc(), getType(edge),
                       kernel.getSymName(), takeValue(edge), IntegerAttr(),
                       /*clears=*/nullptr)
          .getResult(0);
}

//===----------------------------------------------------------------------===//
// Cycles
//===----------------------------------------------------------------------===//

/// Makes a region for some stages, and what leads to them, goes around and
/// leaves.
template <typename OpT>
OpT ProgramWriter::createRegion(ArrayRef<int> stages, const Edges &around,
                                function_ref<void()> body) {
  auto holds = [&](int stage) { return llvm::is_contained(stages, stage); };
  Edges entries = findEdges([&](const PlannedEdge &edge) {
    return holds(edge.consumer) && !holds(edge.producer);
  });
  Edges leaving = findEdges([&](const PlannedEdge &edge) {
    return holds(edge.producer) && !holds(edge.consumer);
  });
  auto types = [&](const Edges &edges) {
    return llvm::map_to_vector(
        edges, [&](const PlannedEdge *edge) { return getType(*edge); });
  };
  Location loc = plan.graph.getStage(stages.front()).getLoc();
  auto op = OpT::create(builder, loc, types(leaving), takeValues(entries));
  Edges arguments = entries;
  llvm::append_range(arguments, around);
  OpBuilder::InsertionGuard guard(builder);
  Block *block = builder.createBlock(&op.getBody());
  for (const PlannedEdge *edge : arguments)
    values[edge->op] = block->addArgument(getType(*edge), loc);
  for (const PlannedEdge *edge : around)
    aroundValues[edge->op];
  body();
  SmallVector<Value> again;
  for (const PlannedEdge *edge : around) {
    again.push_back(aroundValues.at(edge->op));
    aroundValues.erase(edge->op);
  }
  LeaveOp::create(builder, loc, takeValues(leaving), again);
  for (auto [edge, value] : llvm::zip(leaving, op.getEdges()))
    setValue(edge->op, value);
  return op;
}

void ProgramWriter::createWaves(int loop) {
  ArrayRef<int> stages = plan.getLoopStages(loop);
  Edges around = findEdges([&](const PlannedEdge &edge) {
    return llvm::is_contained(stages, edge.producer) &&
           llvm::is_contained(stages, edge.consumer);
  });
  auto waves = createRegion<WavesOp>(stages, around, [&] {
    for (int stage : stages)
      createLaunch(stage);
  });
  if (int64_t keys = plan.loopKeys[loop])
    waves.setKeys(keys);
}

/// The parts of a cycle, which form none; each after those that emit into it.
SmallVector<Part> ProgramWriter::sortParts(ArrayRef<int> stages) {
  SmallVector<Part> parts, sorted;
  for (int stage : stages) {
    int loop = plan.getLoop(stage);
    if (!plan.graph.getStage(stage).collects() &&
        plan.getLoopStages(loop).front() == stage)
      parts.push_back(
          {SmallVector<int>(plan.getLoopStages(loop)), plan.isLoop(loop)});
  }
  auto feeds = [&](const Part &from, const Part &to) {
    return llvm::any_of(plan.edges, [&](const PlannedEdge &edge) {
      return llvm::is_contained(from.stages, edge.producer) &&
             llvm::is_contained(to.stages, edge.consumer);
    });
  };
  while (!parts.empty()) {
    auto *next = llvm::find_if(parts, [&](const Part &part) {
      return llvm::none_of(parts, [&](const Part &other) {
        return &other != &part && feeds(other, part);
      });
    });
    sorted.push_back(*next);
    parts.erase(next);
  }
  return sorted;
}

void ProgramWriter::createRounds(ArrayRef<int> stages) {
  SmallVector<Part> parts = sortParts(stages);
  llvm::DenseMap<int, int> places; // by stage
  for (auto [place, part] : llvm::enumerate(parts))
    for (int stage : part.stages)
      places[stage] = place;
  for (int stage : stages)
    places.try_emplace(stage, places.size());
  Edges around = findEdges([&](const PlannedEdge &edge) {
    bool isInside =
        places.contains(edge.producer) && places.contains(edge.consumer);
    int loop = plan.getLoop(edge.consumer);
    bool isOfLoop =
        isInside && plan.isLoop(loop) && plan.getLoop(edge.producer) == loop;
    return isInside && !isOfLoop &&
           places.at(edge.consumer) <= places.at(edge.producer);
  });
  createRegion<RoundsOp>(stages, around, [&] {
    for (const Part &part : parts)
      if (part.isLoop)
        createWaves(plan.getLoop(part.stages.front()));
      else
        createLaunch(part.stages.front());
    int64_t turn = 0;
    for (int stage : stages)
      if (plan.graph.getStage(stage).collects())
        createLaunch(stage, turn++);
  });
}

void ProgramWriter::createCycle(int component) {
  ArrayRef<int> stages = plan.getComponentStages(component);
  for (KernelOp kernel : assigns)
    if (llvm::is_contained(stages,
                           plan.edges[*getAssignedSource(kernel)].consumer))
      assignSource(kernel);
  if (llvm::any_of(stages, [&](int stage) {
        return plan.graph.getStage(stage).collects();
      }))
    createRounds(stages);
  else
    createWaves(plan.getLoop(stages.front()));
}

//===----------------------------------------------------------------------===//
// The program
//===----------------------------------------------------------------------===//

LogicalResult ProgramWriter::findKernels() {
  if (plan.order.size() != plan.getComponentCount())
    return pipeline.emitError("expected waits that can end, but stages "
                              "wait for each other");
  llvm::DenseSet<Operation *> found;
  for (auto kernel : pipeline.getOps<KernelOp>()) {
    if (kernel.getPrecedes())
      continue;
    SmallVector<StageOp> stages = getStages(kernel);
    found.insert(stages.begin(), stages.end());
    if (getAssignedSource(kernel))
      assigns.push_back(kernel);
    else if (!stages.empty())
      for (StageOp stage : stages)
        kernels[plan.graph.getNumber(stage)] = kernel;
  }
  for (StageOp stage : plan.graph.stages)
    if (!found.contains(stage))
      return stage.emitError("expected a kernel of stage ") << quote(stage);
  return success();
}

void ProgramWriter::setRoots(ProgramOp program) {
  SmallVector<Attribute> roots;
  for (int component : plan.order)
    for (int stage : plan.getComponentStages(component)) {
      StageOp root = plan.graph.getStage(stage);
      if (root.collects() && !root.getOutputs().empty())
        roots.push_back(FlatSymbolRefAttr::get(root.getSymNameAttr()));
    }
  if (!roots.empty())
    program.setRootsAttr(builder.getArrayAttr(roots));
}

void ProgramWriter::clearState() {
  SmallVector<Attribute> states;
  for (Operation &op : *pipeline.getBodyBlock()) {
    auto buffer = dyn_cast<BufferOp>(op);
    auto image = dyn_cast<ImageOp>(op);
    if ((image && !image.getInternal()) || (buffer && buffer.getPerSource()))
      states.push_back(FlatSymbolRefAttr::get(SymbolTable::getSymbolName(&op)));
  }
  if (!states.empty())
    ClearOp::create(builder, pipeline.getLoc(), builder.getArrayAttr(states));
}

/// What feeds stages from outside, and what they wait for, runs before them.
void ProgramWriter::createInputs(ArrayRef<int> stages) {
  auto createOther = [&](int stage) {
    if (!llvm::is_contained(stages, stage))
      createKernel(kernels.at(stage));
  };
  for (const PlannedEdge &edge : plan.edges)
    if (edge.producer >= 0 && !edge.local &&
        llvm::is_contained(stages, edge.consumer))
      createOther(edge.producer);
  for (int stage : stages)
    for (StageOp awaited : getAwaited(plan.graph.getStage(stage)))
      createOther(plan.graph.getNumber(awaited));
  for (KernelOp kernel : assigns)
    if (llvm::is_contained(stages,
                           plan.edges[*getAssignedSource(kernel)].consumer))
      createKernel(kernel);
}

/// Kernels run as they stand, but after what feeds them: a pass may have
/// opened a cycle, in which they could stand in any order.
void ProgramWriter::createKernel(KernelOp kernel) {
  if (!created.insert(kernel).second)
    return;
  SmallVector<StageOp> stages = getStages(kernel);
  std::optional<int64_t> source = getAssignedSource(kernel);
  if (stages.empty() && !source) { // of a schedule
    LaunchOp::create(builder, kernel.getLoc(), TypeRange(), kernel.getSymName(),
                     Value(), IntegerAttr(), /*clears=*/nullptr);
    return;
  }
  int stage = source ? plan.edges[*source].consumer
                     : plan.graph.getNumber(stages.front());
  int component = plan.getComponent(stage);
  bool isCyclic = plan.isCyclic(component);
  if (source && !isCyclic)
    return assignSource(kernel);
  if (isCyclic && !componentsDone.insert(component).second)
    return;
  SmallVector<int> together;
  if (isCyclic)
    llvm::append_range(together, plan.getComponentStages(component));
  else
    for (StageOp member : stages)
      together.push_back(plan.graph.getNumber(member));
  createInputs(together);
  if (isCyclic)
    createCycle(component);
  else
    createLaunch(stage);
}

LogicalResult ProgramWriter::run() {
  if (failed(findKernels()))
    return failure();
  builder.setInsertionPointToEnd(pipeline.getBodyBlock());
  auto program = ProgramOp::create(builder, pipeline.getLoc(), ArrayAttr());
  builder.createBlock(&program.getBody());
  setRoots(program);
  clearState();
  for (auto stage : pipeline.getOps<StageOp>())
    if (ScheduleOp schedule = stage.getSchedule();
        schedule && !schedule.getBody().empty())
      ScheduleBinsOp::create(builder, schedule.getLoc(), stage.getSymName());
  for (auto kernel : pipeline.getOps<KernelOp>())
    if (!kernel.getPrecedes())
      createKernel(kernel);
  return success();
}

void FormProgramPass::runOnOperation() {
  PipelineOp pipeline = getOperation();
  bool isAuthored = pipeline.getOps<KernelOp>().empty() &&
                    !pipeline.getOps<StageOp>().empty();
  if (isAuthored || getProgram(pipeline))
    return markAllAnalysesPreserved();
  ProgramPlan plan(pipeline);
  if (failed(ProgramWriter(pipeline, plan).run()))
    signalPassFailure();
}
