// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A piko.program as the steps of a device that runs it by itself: what is
// repeated stands there once, between its begin and its end (pikort/grid.h).

#include "PikoToLLVM/Program/ProgramRegions.h"

#include "pikort/grid.h"

using namespace mlir;
using namespace piko;

// A step's kind is the runtime's by number.
static_assert(int(StepKind::Clear) == PIKOIR_STEP_CLEAR &&
              int(StepKind::Source) == PIKOIR_STEP_SOURCE &&
              int(StepKind::Stage) == PIKOIR_STEP_STAGE &&
              int(StepKind::Queue) == PIKOIR_STEP_QUEUE &&
              int(StepKind::Strips) == PIKOIR_STEP_STRIPS &&
              int(StepKind::EndStrips) == PIKOIR_STEP_END_STRIPS &&
              int(StepKind::Waves) == PIKOIR_STEP_WAVES &&
              int(StepKind::Entry) == PIKOIR_STEP_ENTRY &&
              int(StepKind::Exit) == PIKOIR_STEP_EXIT &&
              int(StepKind::EndWaves) == PIKOIR_STEP_END_WAVES &&
              int(StepKind::Rounds) == PIKOIR_STEP_ROUNDS &&
              int(StepKind::EndRounds) == PIKOIR_STEP_END_ROUNDS &&
              int(StepKind::Host) == PIKOIR_STEP_HOST);

namespace {

class StepWriter {
public:
  StepWriter(ProgramOp program, const PipelineNumbers &numbers);

  ArrayAttr run() {
    addStatements(program.getBody().front());
    return ArrayAttr::get(program.getContext(), steps);
  }

private:
  /// By the numbers that the runtime has for them.
  struct Edge {
    int32_t producer, consumer;
    int64_t port;
    bool isLocal;
  };
  /// The region of a kind that a stage's kernel is launched in, or null.
  using Regions = llvm::DenseMap<int32_t, Operation *>;

  void add(StepKind kind, int32_t number, int32_t member = -1,
           int32_t exit = -1, FlatSymbolRefAttr kernel = {}) {
    steps.push_back(StepAttr::get(program.getContext(), kind, number, member,
                                  exit, kernel));
  }
  bool isInside(const Edge &edge) const {
    Operation *loop = loops.lookup(edge.producer);
    return loop && loop == loops.lookup(edge.consumer);
  }
  bool isQueued(const Edge &edge) const {
    return cycles.contains(edge.producer) ||
           strips.lookup(edge.producer) != strips.lookup(edge.consumer);
  }
  bool comesFromOutside(int32_t stage) const;
  /// For each stage that gets what leaves a loop, the first edge to it.
  SmallVector<int32_t> findExits(Operation *loop) const;
  int32_t findMember(Operation *loop, int32_t stage) const;
  int32_t findExit(const Edge &edge) const;

  void addStatements(Block &statements);
  void addLaunch(LaunchOp launch);
  void addQueues(KernelOp kernel);
  void addWaves(WavesOp waves);
  void addRounds(RoundsOp rounds);
  /// What runs before each of the kernels that collect, and after them.
  void addSpread(RoundsOp rounds);

  ProgramOp program;
  const PipelineNumbers &numbers;
  SmallVector<Edge> edges;
  llvm::DenseSet<int32_t> fed; ///< Stages that sources feed.
  Regions loops, cycles, strips;
  SmallVector<Attribute> steps;
};

} // namespace

StepWriter::StepWriter(ProgramOp program, const PipelineNumbers &numbers)
    : program(program), numbers(numbers) {
  auto numberOf = [&](FlatSymbolRefAttr stage) {
    return numbers.stages.lookup(stage.getAttr());
  };
  PipelineOp pipeline = numbers.pipeline;
  for (auto edge : pipeline.getOps<EdgeOp>())
    edges.push_back({numberOf(edge.getProducerAttr()),
                     numberOf(edge.getConsumerAttr()), int64_t(edge.getPort()),
                     edge.getLocal()});
  for (auto source : pipeline.getOps<SourceOp>())
    fed.insert(numberOf(source.getStageAttr()));
  program.walk([&](Operation *op) {
    for (int32_t stage : isa<WavesOp, RoundsOp, StripsOp>(op)
                             ? findStages(op, numbers).takeVector()
                             : SmallVector<int32_t, 8>()) {
      if (isa<WavesOp>(op))
        loops[stage] = op;
      if (isa<WavesOp, RoundsOp>(op))
        cycles[stage] = op;
      if (isa<StripsOp>(op))
        strips[stage] = op;
    }
  });
}

bool StepWriter::comesFromOutside(int32_t stage) const {
  return fed.contains(stage) || llvm::any_of(edges, [&](const Edge &edge) {
           return edge.consumer == stage && !isInside(edge);
         });
}

SmallVector<int32_t> StepWriter::findExits(Operation *loop) const {
  SmallVector<int32_t> exits;
  for (int32_t stage : findStages(loop, numbers)) {
    SmallVector<int32_t> leaving;
    for (auto [number, edge] : llvm::enumerate(edges))
      if (edge.producer == stage && !isInside(edge))
        leaving.push_back(int32_t(number));
    llvm::sort(leaving, [&](int32_t a, int32_t b) {
      return edges[a].port < edges[b].port;
    });
    for (int32_t number : leaving)
      if (llvm::none_of(exits, [&](int32_t other) {
            return edges[other].consumer == edges[number].consumer;
          }))
        exits.push_back(number);
  }
  return exits;
}

int32_t StepWriter::findMember(Operation *loop, int32_t stage) const {
  auto stages = findStages(loop, numbers);
  return int32_t(llvm::find(stages, stage) - stages.begin());
}

int32_t StepWriter::findExit(const Edge &edge) const {
  SmallVector<int32_t> exits = findExits(loops.lookup(edge.producer));
  return int32_t(llvm::find_if(exits,
                               [&](int32_t exit) {
                                 return edges[exit].consumer == edge.consumer;
                               }) -
                 exits.begin());
}

void StepWriter::addStatements(Block &statements) {
  for (Operation &op : statements) {
    if (auto clear = dyn_cast<ClearOp>(op)) {
      for (auto state : clear.getStates().getAsRange<FlatSymbolRefAttr>())
        add(StepKind::Clear, numbers.states.lookup(state.getAttr()));
    } else if (auto launch = dyn_cast<LaunchOp>(op)) {
      addLaunch(launch);
    } else if (auto region = dyn_cast<StripsOp>(op)) {
      add(StepKind::Strips, getNumber(region));
      addStatements(region.getBody().front());
      add(StepKind::EndStrips, getNumber(region));
    } else if (auto waves = dyn_cast<WavesOp>(op)) {
      addWaves(waves);
    } else if (auto rounds = dyn_cast<RoundsOp>(op)) {
      addRounds(rounds);
    }
  }
}

void StepWriter::addLaunch(LaunchOp launch) {
  KernelOp kernel = launch.getKernelOp();
  auto name =
      FlatSymbolRefAttr::get(launch.getContext(), getFunctionName(kernel));
  auto bins = kernel.getOps<OpenBinsOp>();
  // What decides how bins run has none.
  if (bins.empty())
    return add(StepKind::Host, 0, -1, -1, name);
  if (auto source = (*bins.begin()).getSource())
    return add(StepKind::Source, int32_t(*source), -1, -1, name);
  add(StepKind::Stage, findStages(launch, numbers).front(), -1, -1, name);
  addQueues(kernel);
}

void StepWriter::addQueues(KernelOp kernel) {
  llvm::DenseSet<int32_t> stages;
  for (StageOp stage : getStages(kernel))
    stages.insert(numbers.stages.lookup(stage.getSymNameAttr()));
  for (auto [number, edge] : llvm::enumerate(edges)) {
    if (!stages.contains(edge.producer) || edge.isLocal || !isQueued(edge))
      continue;
    Operation *loop = loops.lookup(edge.producer);
    bool isInLoop = isInside(edge);
    add(StepKind::Queue, int32_t(number),
        isInLoop ? findMember(loop, edge.consumer) : -1,
        loop && !isInLoop ? findExit(edge) : -1);
  }
}

/// In a loop that takes one position at a time the first one comes in, too.
void StepWriter::addWaves(WavesOp waves) {
  add(StepKind::Waves, getNumber(waves));
  auto stages = findStages(waves, numbers);
  int64_t entries = llvm::count_if(
      stages, [&](int32_t stage) { return comesFromOutside(stage); });
  bool isOrdered = llvm::any_of(stages, [&](int32_t stage) {
    PipelineOp pipeline = numbers.pipeline;
    StringAttr name = (numbers.stages.begin() + stage)->first;
    return cast<StageOp>(SymbolTable::lookupSymbolIn(pipeline, name))
        .getOrdered();
  });
  for (auto [member, stage] : llvm::enumerate(stages))
    if ((entries > 1 || isOrdered) && comesFromOutside(stage))
      add(StepKind::Entry, stage, int32_t(member));
  for (auto [exit, edge] : llvm::enumerate(findExits(waves)))
    add(StepKind::Exit, edge, -1, int32_t(exit));
  for (auto launch : waves.getOps<LaunchOp>())
    addLaunch(launch);
  add(StepKind::EndWaves, getNumber(waves));
}

void StepWriter::addSpread(RoundsOp rounds) {
  for (Operation &statement : rounds.getBody().front()) {
    if (auto waves = dyn_cast<WavesOp>(statement))
      addWaves(waves);
    else if (auto launch = dyn_cast<LaunchOp>(statement);
             launch && !launch.getTurn())
      addLaunch(launch);
  }
}

void StepWriter::addRounds(RoundsOp rounds) {
  addSpread(rounds);
  SmallVector<LaunchOp> turns;
  for (auto launch : rounds.getOps<LaunchOp>())
    if (launch.getTurn())
      turns.push_back(launch);
  if (turns.empty())
    return;
  int32_t number = getNumber(rounds, /*asCycle=*/true);
  add(StepKind::Rounds, number);
  for (LaunchOp turn : turns) {
    addLaunch(turn);
    addSpread(rounds);
  }
  add(StepKind::EndRounds, number);
}

ArrayAttr piko::describeSteps(ProgramOp program,
                              const PipelineNumbers &numbers) {
  return StepWriter(program, numbers).run();
}
