// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- FrameDescription.cpp - What the device is told of a frame ----------===//

#include "cuda/frame/FrameDescription.h"
#include "cuda/Accelerator.h"

#include <algorithm>
#include <cstring>

using namespace piko::cuda;
using namespace piko::rt;

FrameDescription::FrameDescription(pikort_pipeline &p, Accelerator &device)
    : p_(p), device_(device), exchange_(device) {}

/// What the device says comes first.
void FrameDescription::takeMemory() {
  auto countOf = [](const auto &list) {
    return static_cast<int64_t>(list.size());
  };
  blockSums_.resize(device_, sizeof(BlockSums));
  exchange_.reset();
  places_ =
      exchange_.take<KernelPlace>(countOf(p_.stages) + countOf(p_.sources));
  received_ = exchange_.take<uint64_t>(countOf(p_.edges) + countOf(p_.sources));
  frame_ = exchange_.take<FrameState>();
  queues_ = exchange_.take<QueueState>(countOf(p_.edges) + countOf(p_.stages));
  loops_ = exchange_.take<LoopState>(countOf(p_.loops));
  cycles_ = exchange_.take<CycleState>(countOf(p_.cycles));
  stackStates_ = exchange_.take<StackState>(countOf(p_.loops));
}

size_t FrameDescription::placeOf(int32_t number, bool isSource) const {
  auto at = static_cast<size_t>(number);
  return isSource ? p_.stages.size() + at : at;
}

// --- Joins -------------------------------------------------------------------

JoinArgs &FrameDescription::describeSource(int32_t source) {
  const Stage &stage = p_.stages[p_.sources[source].stage];
  std::vector<JoinInput> inputs{describeSourceInput(stage, source)};
  inputs[0].producer = nullptr;
  auto &args = exchange_.takeWith<JoinArgs>(inputs);
  args.inputCount = 1;
  args.shape = {p_.records[stage.record].size, 1, 0, 0};
  args.tiles = 1;
  args.splits = true;
  args.unitsAtOnce = device_.residentThreads() / 64;
  return args;
}

JoinInput FrameDescription::describeSourceInput(const Stage &stage,
                                                int32_t source) const {
  const Source &from = p_.sources[source];
  JoinInput input{};
  input.items = from.data;
  input.count = from.count;
  input.keyBase = static_cast<uint64_t>(source) << 32;
  input.strip = onDevice(stripOf(stage));
  input.isSource = true;
  input.stage = -1;
  if (stage.placed())
    input.producer = onDevice(&find(source, true).state);
  input.received =
      onDevice(&received_[p_.edges.size() + static_cast<size_t>(source)]);
  return input;
}

JoinInput FrameDescription::describeEdge(int32_t number) const {
  const Edge &edge = p_.edges[number];
  const Stage &from = p_.stages[edge.producer];
  bool isHosted = from.host >= 0;
  JoinInput input{};
  input.producer =
      onDevice(&find(isHosted ? from.host : edge.producer, false).state);
  input.stage = isHosted ? edge.producer : -1;
  input.port = edge.port;
  input.keyWidth = edge.keyWidth;
  input.permute = edge.gather == PIKOIR_PERMUTE && !isHosted;
  input.collects = from.collects();
  input.root = static_cast<uint32_t>(from.root);
  input.received = onDevice(&received_[number]);
  return input;
}

std::vector<JoinInput>
FrameDescription::describeInputs(const Stage &stage) const {
  std::vector<JoinInput> inputs;
  for (int32_t source : stage.sources)
    inputs.push_back(describeSourceInput(stage, source));
  for (int32_t e : stage.inputs) {
    const Edge &edge = p_.edges[e];
    if (edge.local)
      continue;
    JoinInput &input = inputs.emplace_back(describeEdge(e));
    if (hasQueue(edge)) {
      input.producer = nullptr;
      input.queue = onDevice(&queues_[e]);
      input.isInLoop = edge.insideLoop;
    }
  }
  return inputs;
}

Shape FrameDescription::describeShape(const Stage &stage) const {
  int32_t keyWidth = stage.keyWidth;
  if (stage.loop >= 0)
    keyWidth = std::max(keyWidth, p_.loops[stage.loop].keyWidth);
  return {p_.records[stage.record].size, stage.buckets, stage.placed(),
          keyWidth};
}

std::vector<JoinClear> FrameDescription::describeClears(const Stage &stage) {
  std::vector<JoinClear> clears;
  for (int32_t id : stage.clears) {
    const State &state = p_.states[id];
    clears.push_back(
        {state.view.data, clearRecord(state), p_.records[state.record].size});
  }
  return clears;
}

const uint8_t *FrameDescription::clearRecord(const State &state) {
  const uint8_t *&record = clearRecords_[&state];
  if (record)
    return record;
  int64_t size = p_.records[state.record].size;
  uint8_t *taken = exchange_.take<uint8_t>(size);
  if (state.kind == PIKORT_IMAGE)
    std::copy(state.clear.begin(), state.clear.end(), taken);
  return record = onDevice(taken);
}

JoinArgs &FrameDescription::describeStage(int32_t number) {
  const Stage &stage = p_.stages[number];
  std::vector<JoinInput> inputs =
      loop_.entries.empty() ? describeInputs(stage) : describeWave(number);
  std::vector<JoinClear> clears = describeClears(stage);
  auto &args = exchange_.takeWith<JoinArgs>(inputs, clears);
  args.inputCount = static_cast<int32_t>(inputs.size());
  args.clearCount = static_cast<int32_t>(clears.size());
  if (stage.loop >= 0)
    args.loop = onDevice(&loops_[stage.loop]);
  if (stage.cycle >= 0)
    args.cycle = onDevice(&cycles_[stage.cycle]);
  args.shape = describeShape(stage);
  args.tiles = stage.tiles;
  args.rank = p_.rank;
  args.ranked = stage.loop >= 0;
  for (int32_t e : stage.outputs)
    args.ranked |=
        e >= 0 && !p_.edges[e].local &&
        (p_.edges[e].keyed() || p_.edges[e].gather == PIKOIR_PERMUTE);
  for (size_t d = 0; d < 4; ++d) {
    args.domain[d] = p_.domain[d];
    args.binSize[d] = stage.binSize[d];
    args.grid[d] = stage.grid[d];
  }
  describeSchedule(args, stage);
  return args;
}

static BinCut describeBin(const Stage &stage, const BinSchedule &schedule) {
  bool sharesBin = schedule.kind != PIKOIR_DIRECT_MAP || stage.bins() == 1;
  return {stage.splits() && (stage.takesList() || sharesBin), schedule.everyBin,
          stage.sharesTile ? 0 : schedule.tileSplit, schedule.batch};
}

/// The same for all strips and waves. A bin that is to be the first core's is a
/// unit, as no result depends on who runs it.
const BinCut *FrameDescription::describeBins(const Stage &stage) {
  const BinCut *&cuts = cuts_[&stage];
  if (cuts)
    return cuts;
  std::vector<BinCut> all;
  for (int64_t bin = 0; bin < stage.bins(); ++bin) {
    const BinSchedule &schedule = stage.binSchedules[bin];
    BinCut &cut = all.emplace_back(describeBin(stage, schedule));
    if (schedule.kind == PIKOIR_SERIALIZE && !stage.takesList())
      cut.splits = false;
  }
  return cuts = exchange_.copy(all);
}

void FrameDescription::describeSchedule(JoinArgs &args, const Stage &stage) {
  args.takesList = stage.takesList();
  args.collects = stage.collects();
  args.visitsAll = stage.visitsAll;
  args.unitsAtOnce = device_.residentThreads() / 64;
  BinCut cut = describeBin(stage, stage.schedule);
  args.splits = cut.splits;
  args.everyBin = cut.everyBin;
  args.tileSplit = cut.tileSplit;
  args.batch = cut.batch;
  args.cutting = stage.schedule.kind == PIKOIR_SERIALIZE ? CutNone : CutBuckets;
  if (!stage.binSchedules)
    return;
  args.cutting = CutBins;
  const BinCut *cuts = describeBins(stage);
  args.cuts = onDevice(cuts);
  args.splits = stage.splits() && stage.takesList();
  args.everyBin = std::any_of(cuts, cuts + stage.bins(), [](const BinCut &bin) {
    return bin.everyBin != 0;
  });
}

int64_t FrameDescription::mostItems(const JoinArgs &args) const {
  int64_t most = 0;
  for (const JoinInput &input :
       std::span(args.inputs(), static_cast<size_t>(args.inputCount))) {
    if (input.producer || input.queue)
      return -1;
    most += input.strip ? exchange_.onHost(input.strip)->size : input.count;
  }
  return most;
}

// --- Loops -------------------------------------------------------------------

const pikoir_cuda_step *FrameDescription::entryOf(int32_t stage) const {
  auto found = std::find_if(
      loop_.entries.begin(), loop_.entries.end(),
      [&](const pikoir_cuda_step *entry) { return entry->number == stage; });
  return found == loop_.entries.end() ? nullptr : *found;
}

std::vector<QueuePort> FrameDescription::describePorts(Steps queues) const {
  std::vector<QueuePort> ports;
  for (const pikoir_cuda_step &step : queues) {
    const Edge &edge = p_.edges[step.number];
    if (hasQueue(edge))
      ports.push_back(
          {describeEdge(step.number), describeShape(p_.stages[edge.consumer]),
           onDevice(&queues_[step.number]), step.exit, step.member});
  }
  return ports;
}

/// What a stage takes of such a loop.
std::vector<JoinInput> FrameDescription::describeWave(int32_t number) const {
  const Stage &stage = p_.stages[number];
  std::vector<JoinInput> inputs = describeInputs(stage);
  std::erase_if(inputs, [](const JoinInput &input) { return !input.isInLoop; });
  if (entryOf(number)) {
    JoinInput &entries = inputs.emplace_back();
    entries.queue = onDevice(&entriesOf(number));
    entries.isInLoop = true;
  }
  return inputs;
}

StackArgs &FrameDescription::describeStack() {
  std::vector<StackMember> members;
  std::vector<QueuePort> ports;
  for (const LoopSteps::Member &member : loop_.members) {
    std::vector<QueuePort> ofStage = describePorts(member.queues);
    const Stage &stage = p_.stages[member.stage];
    members.push_back({onDevice(&find(member.stage, false).state),
                       describeShape(stage), stage.tiles,
                       static_cast<int32_t>(ports.size()),
                       static_cast<int32_t>(ofStage.size())});
    ports.insert(ports.end(), ofStage.begin(), ofStage.end());
  }
  auto &args = exchange_.takeWith<StackArgs>(members, ports);
  args.frame = onDevice(frame_);
  args.loop = onDevice(&loops_[loop_.number]);
  args.stack = onDevice(&stackStates_[loop_.number]);
  args.limit = p_.loopLimit;
  args.memberCount = static_cast<int32_t>(members.size());
  args.portCount = static_cast<int32_t>(ports.size());
  return args;
}

// --- Strips ------------------------------------------------------------------

std::vector<StripQueue> FrameDescription::describeLeaving(int32_t group) const {
  std::vector<StripQueue> queues;
  for (size_t e = 0; e < p_.edges.size(); ++e) {
    const Edge &edge = p_.edges[e];
    if (edge.leavesStrips && p_.stages[edge.producer].stripGroup == group)
      queues.push_back({onDevice(&queues_[e]),
                        p_.records[p_.stages[edge.consumer].record].size});
  }
  return queues;
}

/// With those of what comes into loops.
std::vector<QueueState *>
FrameDescription::describeInside(int32_t group) const {
  std::vector<QueueState *> queues = describeWaiting([&](const Edge &edge) {
    return hasQueue(edge) && !edge.leavesStrips &&
           p_.stages[edge.producer].stripGroup == group;
  });
  for (int32_t s : p_.stripGroups[group].stages)
    if (p_.stages[s].loop >= 0)
      queues.push_back(onDevice(&entriesOf(s)));
  return queues;
}
