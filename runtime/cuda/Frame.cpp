// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Frame.cpp - A pipeline's frame as one submission -------------------===//

#include "cuda/Frame.h"
#include "cuda/Accelerator.h"

#include <algorithm>
#include <cstring>

using namespace piko::cuda;
using namespace piko::rt;

/// In front of what grids take of the log: see gpu/Log.cpp.
static constexpr int64_t headRoom = 64, spareRoom = int64_t(1) << 26;

// --- What runs without the host ---------------------------------------------

bool Frame::isPossible() const {
  if (needsHost_ || !device_.canWaitInGrids() ||
      p_.executor->reportsInOrder() || p_.unitReport || p_.memory.limit() > 0 ||
      p_.memory.budget() > 0)
    return false;
  return std::none_of(
      p_.stages.begin(), p_.stages.end(),
      [&](const Stage &stage) { return isStacked(stage) && stage.hosts; });
}

template <class T> static void makeZero(const Array<T> &array) {
  std::memset(static_cast<void *>(array.data()), 0,
              static_cast<size_t>(array.size()) * sizeof(T));
}

bool Frame::begin() {
  if (!isPossible()) {
    clearLog();
    return false;
  }
  if (!hasMemory_)
    takeMemory();
  makeZero(places_);
  makeZero(queues_);
  makeZero(loops_);
  makeZero(cycles_);
  makeZero(received_);
  for (LoopState &loop : std::span(loops_.data(), p_.loops.size()))
    loop.again = 1;
  for (CycleState &cycle : std::span(cycles_.data(), p_.cycles.size()))
    cycle.again = 1;
  arguments_.reset();
  strips_.assign(p_.stripGroups.size(), {});
  steps_.clear();
  joined_ = nullptr;
  members_.assign(p_.loops.size(), 0);
  stacks_.assign(p_.loops.size(), nullptr);
  cuts_.clear();
  turns_.assign(p_.cycles.size(), 0);
  isCleared_.assign(p_.states.size(), false);
  isRecording_ = true;
  return true;
}

void Frame::takeMemory() {
  int64_t clearBytes = 0;
  for (const State &state : p_.states) {
    clearOffsets_[&state] = clearBytes;
    clearBytes += (p_.records[state.record].size + 15) / 16 * 16;
  }
  frame_ = Array<FrameState>(p_.memory, 1, Use::State);
  clearRecords_ = Array<uint8_t>(p_.memory, clearBytes + 1, Use::State);
  std::memset(clearRecords_.data(), 0, static_cast<size_t>(clearBytes));
  for (const State &state : p_.states)
    if (state.kind == PIKORT_IMAGE)
      std::copy(state.clear.begin(), state.clear.end(),
                clearRecords_.data() + clearOffsets_[&state]);
  auto countOf = [](const auto &list) {
    return static_cast<int64_t>(list.size());
  };
  places_ = Array<Place>(p_.memory, countOf(p_.stages) + countOf(p_.sources),
                         Use::State);
  queues_ = Array<QueueState>(p_.memory, countOf(p_.edges) + countOf(p_.stages),
                              Use::State);
  loops_ = Array<LoopState>(p_.memory, countOf(p_.loops) + 1, Use::State);
  cycles_ = Array<CycleState>(p_.memory, countOf(p_.cycles) + 1, Use::State);
  stackStates_ =
      Array<StackState>(p_.memory, countOf(p_.loops) + 1, Use::State);
  received_ = Array<uint64_t>(
      p_.memory, countOf(p_.edges) + countOf(p_.sources) + 1, Use::State);
  hasMemory_ = true;
}

uint8_t *Frame::Arguments::takeRoom(Memory &memory, int64_t bytes) {
  constexpr int64_t together = int64_t(16) << 10;
  if (block_ < blocks_.size() && used_ + bytes > blocks_[block_].size())
    ++block_, used_ = 0;
  if (block_ == blocks_.size() || bytes > blocks_[block_].size())
    blocks_.emplace(blocks_.begin() + static_cast<ptrdiff_t>(block_), memory,
                    std::max(together, bytes), Use::State);
  used_ += bytes;
  return blocks_[block_].data() + used_ - bytes;
}

size_t Frame::placeOf(int32_t number, bool isSource) const {
  auto at = static_cast<size_t>(number);
  return isSource ? p_.stages.size() + at : at;
}

// --- What joins are told ----------------------------------------------------

JoinArgs &Frame::describeSource(int32_t source) {
  const Stage &stage = p_.stages[p_.sources[source].stage];
  std::vector<JoinInput> inputs{describeSourceInput(stage, source)};
  inputs[0].producer = nullptr;
  auto &args = arguments_.take<JoinArgs>(p_.memory, inputs);
  args.inputCount = 1;
  args.shape = {p_.records[stage.record].size, 1, 0, 0};
  args.tiles = 1;
  args.splits = true;
  args.unitsAtOnce = device_.residentThreads() / 64;
  return args;
}

JoinInput Frame::describeSourceInput(const Stage &stage, int32_t source) const {
  const Source &from = p_.sources[source];
  JoinInput input{};
  input.items = from.data;
  input.count = from.count;
  input.keyBase = static_cast<uint64_t>(source) << 32;
  input.strip = stripOf(stage);
  input.isSource = true;
  input.stage = -1;
  if (stage.placed())
    input.producer = &find(source, true).state;
  input.received = &received_[static_cast<int64_t>(p_.edges.size()) + source];
  return input;
}

JoinInput Frame::describeEdge(int32_t number) const {
  const Edge &edge = p_.edges[number];
  const Stage &from = p_.stages[edge.producer];
  bool isHosted = from.host >= 0;
  JoinInput input{};
  input.producer = &find(isHosted ? from.host : edge.producer, false).state;
  input.stage = isHosted ? edge.producer : -1;
  input.port = edge.port;
  input.keyWidth = edge.keyWidth;
  input.permute = edge.gather == PIKOIR_PERMUTE && !isHosted;
  input.collects = from.collects();
  input.root = static_cast<uint32_t>(from.root);
  input.received = &received_[number];
  return input;
}

std::vector<JoinInput> Frame::describeInputs(const Stage &stage) const {
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
      input.queue = &queues_[e];
      input.isInLoop = edge.insideLoop;
    }
  }
  return inputs;
}

Shape Frame::describeShape(const Stage &stage) const {
  int32_t keyWidth = stage.keyWidth;
  if (stage.loop >= 0)
    keyWidth = std::max(keyWidth, p_.loops[stage.loop].keyWidth);
  return {p_.records[stage.record].size, stage.cells, stage.placed(), keyWidth};
}

std::vector<JoinClear> Frame::describeClears(const Stage &stage) {
  std::vector<JoinClear> clears;
  for (int32_t id : stage.clears) {
    const State &state = p_.states[id];
    clears.push_back({state.owned.data(), clearRecord(state),
                      p_.records[state.record].size});
  }
  return clears;
}

const uint8_t *Frame::clearRecord(const State &state) {
  return clearRecords_.data() + clearOffsets_[&state];
}

JoinArgs &Frame::describeStage(int32_t number) {
  const Stage &stage = p_.stages[number];
  bool isEntered = stage.loop >= 0 && hasEntries(p_.loops[stage.loop]);
  std::vector<JoinInput> inputs =
      isEntered ? describeWave(number) : describeInputs(stage);
  std::vector<JoinClear> clears = describeClears(stage);
  auto &args = arguments_.take<JoinArgs>(p_.memory, inputs, clears);
  args.inputCount = static_cast<int32_t>(inputs.size());
  args.clearCount = static_cast<int32_t>(clears.size());
  if (stage.loop >= 0)
    args.loop = &loops_[stage.loop];
  if (stage.cycle >= 0)
    args.cycle = &cycles_[stage.cycle];
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
const BinCut *Frame::describeBins(const Stage &stage) {
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
  return cuts = arguments_.copy(p_.memory, all);
}

void Frame::describeSchedule(JoinArgs &args, const Stage &stage) {
  args.takesList = stage.takesList();
  args.collects = stage.collects();
  args.visitsAll = stage.visitsAll;
  args.unitsAtOnce = device_.residentThreads() / 64;
  BinCut cut = describeBin(stage, stage.schedule);
  args.splits = cut.splits;
  args.everyBin = cut.everyBin;
  args.tileSplit = cut.tileSplit;
  args.batch = cut.batch;
  args.cutting = stage.schedule.kind == PIKOIR_SERIALIZE ? CutNone : CutCells;
  if (!stage.binSchedules)
    return;
  args.cutting = CutBins;
  args.cuts = describeBins(stage);
  args.splits = stage.splits() && stage.takesList();
  args.everyBin =
      std::any_of(args.cuts, args.cuts + stage.bins(),
                  [](const BinCut &bin) { return bin.everyBin != 0; });
}

std::vector<int32_t> Frame::edgesOf(int32_t kernel) const {
  std::vector<int32_t> edges;
  for (size_t e = 0; e < p_.edges.size(); ++e) {
    const Edge &edge = p_.edges[e];
    if (!edge.local &&
        (edge.producer == kernel || p_.stages[edge.producer].host == kernel))
      edges.push_back(static_cast<int32_t>(e));
  }
  return edges;
}

// --- What the program asks for ----------------------------------------------

void Frame::launchOwn(const char *kernel, const void *args, int32_t timed) {
  steps_.push_back({Step::Kind::Grid,
                    {kernel,
                     device_.joinBlocks(),
                     joinThreads,
                     {reinterpret_cast<int64_t>(args)},
                     /*isJoin=*/true},
                    /*again=*/nullptr,
                    timed});
}

void Frame::launchWarp(const char *kernel, const void *args) {
  steps_.push_back({Step::Kind::Grid,
                    {kernel,
                     /*blocks=*/1,
                     /*threads=*/32,
                     {reinterpret_cast<int64_t>(args)},
                     /*isJoin=*/false}});
}

int32_t Frame::kernelOf(int32_t number, bool isSource) const {
  int32_t kernel = 0;
  for (size_t s = 0; s < p_.stages.size(); ++s) {
    for (int32_t source : p_.stages[s].sources)
      if (p_.stages[s].placed()) {
        if (isSource && source == number)
          return kernel;
        ++kernel;
      }
    if (!isSource && static_cast<int32_t>(s) == number)
      return kernel;
    ++kernel;
  }
  return -1;
}

const pikoir_input *Frame::join(int32_t number, bool isSource) {
  Place &place = find(number, isSource);
  place.stage = isSource ? -1 : number;
  joined_ = &place;
  timed_ = kernelOf(number, isSource);
  const Stage &stage = p_.stages[isSource ? p_.sources[number].stage : number];
  if (place.args && (isSource || stage.cycle < 0))
    needsHost_ = true;
  if (!isSource && isStacked(stage))
    return &place.state.input;
  JoinArgs &args = isSource ? describeSource(number) : describeStage(number);
  args.strip = stripOf(stage);
  args.frame = frame_.data();
  args.kernel = &place.state;
  args.number = nextNumber();
  place.args = &args;
  launchOwn("piko_join", &args, timed_);
  if (!isSource)
    for (int32_t id : p_.stages[number].clears)
      isCleared_[static_cast<size_t>(id)] = true;
  return &place.state.input;
}

void Frame::launch(GridLaunch grid) {
  steps_.push_back({Step::Kind::Grid, std::move(grid), nullptr, timed_});
  if (joined_ && joined_->stage >= 0 && !isStacked(p_.stages[joined_->stage]))
    queue(*joined_);
}

pikoir_log *Frame::log(int32_t number, bool isSource) {
  return &find(number, isSource).state.log;
}

int64_t Frame::mostItems(const JoinArgs &args) const {
  int64_t most = 0;
  for (const JoinInput &input :
       std::span(args.inputs(), static_cast<size_t>(args.inputCount))) {
    if (input.producer || input.queue)
      return -1;
    most += input.strip ? input.strip->size : input.count;
  }
  return most;
}

int64_t Frame::blocks(int32_t number, bool isSource, int64_t threads) const {
  if (!isSource && isStacked(p_.stages[number]))
    return 1;
  const JoinArgs &args = *find(number, isSource).args;
  int64_t blocks = device_.residentThreads() / threads;
  int64_t most = mostItems(args);
  if (args.splits && args.tileSplit == 0 && !args.shape.placed && most >= 0)
    blocks = std::min(blocks, (most + 63) / 64);
  return std::max<int64_t>(blocks, 1);
}

void Frame::clear(int32_t id) {
  const State &state = p_.states[id];
  int64_t size = p_.records[state.record].size;
  isCleared_[static_cast<size_t>(id)] = true;
  steps_.push_back({Step::Kind::Grid,
                    {"piko_fill",
                     device_.joinBlocks(),
                     joinThreads,
                     {reinterpret_cast<int64_t>(state.owned.data()),
                      state.owned.size() / size,
                      reinterpret_cast<int64_t>(clearRecord(state)), size},
                     /*isJoin=*/false}});
}

// --- The submission ---------------------------------------------------------

bool Frame::submit() {
  isRecording_ = false;
  std::span<uint8_t> room;
  if (!needsHost_)
    room = device_.logSpace();
  if (room.empty()) {
    clearLog();
    return false;
  }
  auto begin = reinterpret_cast<int64_t>(room.data());
  logBegin_ = room.data() + headRoom + spareRoom;
  FrameState &frame = frame_[0];
  frame = {};
  frame.progress = device_.progress();
  frame.mostAlone = device_.mostAlone();
  frame.log.spare = begin + headRoom;
  frame.log.cursor = begin + headRoom + spareRoom;
  frame.log.limit = begin + static_cast<int64_t>(room.size());
  device_.enqueue(steps_, used_);
  return true;
}

bool Frame::isDone() const { return device_.isDone(); }

Frame::Outcome Frame::await() {
  device_.await(steps_);
  const FrameState &frame = frame_[0];
  const KernelState *last = frame.latest;
  int64_t end =
      std::max(last ? last->log.cursor : frame.log.cursor, frame.highest);
  auto begin = reinterpret_cast<int64_t>(logBegin_);
  used_ = {logBegin_,
           static_cast<size_t>(std::min(end, frame.log.limit) - begin)};
  p_.memory.noteOthers(static_cast<int64_t>(used_.size()));
  bool failed = frame.failed != 0 || end > frame.log.limit ||
                (last && last->log.errors != 0);
  if (!failed) {
    noteStatistics();
    return Outcome::Done;
  }
  clearLog();
  return keepsState() ? Outcome::Spoilt : Outcome::Repeat;
}

void Frame::clearLog() {
  if (!used_.empty())
    device_.clearLog(std::exchange(used_, {}));
}

bool Frame::keepsState() const {
  for (size_t i = 0; i < p_.states.size(); ++i) {
    const State &state = p_.states[i];
    bool changes = state.kind == PIKORT_IMAGE || state.written;
    bool stays = state.owned || state.onDevice;
    if (stays && changes && !isCleared_[i])
      return true;
  }
  return false;
}

void Frame::end() noexcept { isRecording_ = false; }

void Frame::noteStatistics() {
  for (size_t s = 0; s < p_.stages.size(); ++s) {
    const Place &place = find(static_cast<int32_t>(s), false);
    p_.stageStats[s].in += place.state.in;
    p_.stageStats[s].placed += place.state.placed;
  }
  for (size_t e = 0; e < p_.edges.size(); ++e)
    p_.stageStats[p_.edges[e].producer].out +=
        static_cast<int64_t>(received_[static_cast<int64_t>(e)]);
}
