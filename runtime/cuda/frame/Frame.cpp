// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Frame.cpp - A pipeline's frame as one submission -------------------===//

#include "cuda/frame/Frame.h"
#include "cuda/Accelerator.h"

#include <algorithm>
#include <cstring>

using namespace piko::cuda;
using namespace piko::rt;

/// Before what grids take of the log: see gpu/Log.cpp.
static constexpr int64_t headRoom = 64, spareRoom = int64_t(1) << 26;

// --- What runs without the host ---------------------------------------------

bool DeviceFrame::isPossible() const {
  if (needsHost_ || !device_.canWaitInGrids() ||
      p_.executor->reportsInOrder() || p_.unitReport || p_.memory.limit() > 0 ||
      p_.memory.budget() > 0)
    return false;
  return std::none_of(
      p_.stages.begin(), p_.stages.end(),
      [&](const Stage &stage) { return isStacked(stage) && stage.hosts; });
}

void DeviceFrame::reset() {
  takeMemory();
  for (LoopState &loop : std::span(loops_, p_.loops.size()))
    loop.again = 1;
  for (CycleState &cycle : std::span(cycles_, p_.cycles.size()))
    cycle.again = 1;
  clearRecords_.clear();
  strips_.assign(p_.stripGroups.size(), {});
  steps_.clear();
  loop_ = {};
  stack_ = nullptr;
  cuts_.clear();
  isCleared_.assign(p_.states.size(), false);
}

// --- What a program does ----------------------------------------------------

void DeviceFrame::launchOwn(const char *kernel, const void *args,
                            int32_t timed) {
  steps_.push_back({Step::Kind::Grid,
                    {kernel,
                     device_.joinBlocks(kernel),
                     joinThreads,
                     {reinterpret_cast<int64_t>(onDevice(args))},
                     /*isJoin=*/true},
                    /*again=*/nullptr,
                    timed});
}

void DeviceFrame::launchWarp(const char *kernel, const void *args) {
  steps_.push_back({Step::Kind::Grid,
                    {kernel,
                     /*blocks=*/1,
                     /*threads=*/32,
                     {reinterpret_cast<int64_t>(onDevice(args))},
                     /*isJoin=*/false}});
}

int32_t DeviceFrame::kernelOf(int32_t number, bool isSource) const {
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

void DeviceFrame::record(Steps program, std::span<const int64_t> stripSizes) {
  reset();
  program_ = program;
  for (size_t at = 0; at < program.size() && p_.status == PIKORT_OK; ++at)
    recordStep(at, stripSizes);
}

void DeviceFrame::recordStep(size_t at, std::span<const int64_t> stripSizes) {
  const pikoir_cuda_step &step = program_[at];
  int32_t number = step.number;
  switch (step.kind) {
  case PIKOIR_STEP_CLEAR:
    return clear(number);
  case PIKOIR_STEP_SOURCE:
  case PIKOIR_STEP_STAGE:
    return recordKernel(step, queuesAfter(at));
  case PIKOIR_STEP_HOST:
    step.host(&p_); // which notes its errors
    return;
  case PIKOIR_STEP_STRIPS:
    return beginStrips(number, stripSizes[static_cast<size_t>(number)]);
  case PIKOIR_STEP_END_STRIPS:
    return endStrips(number);
  case PIKOIR_STEP_WAVES:
    loop_ = loopAt(at);
    return beginLoop();
  case PIKOIR_STEP_END_WAVES:
    endLoop();
    loop_ = {};
    return;
  case PIKOIR_STEP_ROUNDS:
    return repeat(cycles_[number].again);
  case PIKOIR_STEP_END_ROUNDS:
    return endRounds(number);
  default: // of a kernel or a loop, which has read it
    return;
  }
}

Steps DeviceFrame::queuesAfter(size_t at) const {
  size_t end = ++at;
  while (end < program_.size() && program_[end].kind == PIKOIR_STEP_QUEUE)
    ++end;
  return program_.subspan(at, end - at);
}

void DeviceFrame::recordKernel(const pikoir_cuda_step &step, Steps queues) {
  bool isSource = step.kind == PIKOIR_STEP_SOURCE;
  KernelPlace &place = join(step.number, isSource);
  for (const pikoir_cuda_grid *grid = step.grids; grid->kernel; ++grid)
    launch(*grid, place, step.number);
  if (!isSource && !isStacked(p_.stages[step.number]))
    queue(place, queues);
}

DeviceFrame::KernelPlace &DeviceFrame::join(int32_t number, bool isSource) {
  KernelPlace &place = find(number, isSource);
  place.stage = isSource ? -1 : number;
  timed_ = kernelOf(number, isSource);
  const Stage &stage = p_.stages[isSource ? p_.sources[number].stage : number];
  if (place.args && (isSource || stage.cycle < 0))
    needsHost_ = true;
  if (!isSource && isStacked(stage))
    return place;
  JoinArgs &args = isSource ? describeSource(number) : describeStage(number);
  args.strip = onDevice(stripOf(stage));
  args.frame = onDevice(frame_);
  args.kernel = onDevice(&place.state);
  args.number = nextNumber();
  place.args = &args;
  launchOwn("piko_join", &args, timed_);
  if (!isSource)
    for (int32_t id : p_.stages[number].clears)
      isCleared_[static_cast<size_t>(id)] = true;
  return place;
}

void DeviceFrame::showConstants(GridLaunch &grid) const {
  for (const State &state : p_.states)
    if (state.kind == PIKORT_CONSTANT && state.hosts)
      std::replace(grid.arguments.begin(), grid.arguments.end(),
                   reinterpret_cast<int64_t>(state.view.data),
                   reinterpret_cast<int64_t>(state.twin.data()));
}

void DeviceFrame::launch(const pikoir_cuda_grid &grid, KernelPlace &place,
                         int32_t number) {
  std::vector<int64_t> words(static_cast<size_t>(grid.count));
  grid.arguments(&p_, onDevice(&place.state.input), onDevice(&place.state.log),
                 words.data());
  // More would be a second wave, which is seldom full, and find less to do.
  int64_t count = std::min(blocks(number, place.stage < 0, grid.threads),
                           device_.residentBlocks(grid.kernel, grid.threads));
  GridLaunch launch{grid.kernel, count, grid.threads, std::move(words), false};
  showConstants(launch);
  steps_.push_back({Step::Kind::Grid, std::move(launch), nullptr, timed_});
}

int64_t DeviceFrame::blocks(int32_t number, bool isSource,
                            int64_t threads) const {
  if (!isSource && isStacked(p_.stages[number]))
    return 1;
  const JoinArgs &args = *find(number, isSource).args;
  int64_t blocks = device_.residentThreads() / threads;
  int64_t most = mostItems(args);
  if (args.splits && args.tileSplit == 0 && !args.shape.placed && most >= 0)
    blocks = std::min(blocks, (most + 63) / 64);
  return std::max<int64_t>(blocks, 1);
}

void DeviceFrame::clear(int32_t id) {
  const State &state = p_.states[id];
  int64_t size = p_.records[state.record].size;
  isCleared_[static_cast<size_t>(id)] = true;
  steps_.push_back(
      {Step::Kind::Grid,
       {"piko_fill",
        device_.joinBlocks("piko_fill"),
        joinThreads,
        {reinterpret_cast<int64_t>(state.view.data), state.owned.size() / size,
         reinterpret_cast<int64_t>(clearRecord(state)), size},
        /*isJoin=*/false}});
}

// --- The submission ---------------------------------------------------------

bool DeviceFrame::submit() {
  std::span<uint8_t> room;
  if (!needsHost_)
    room = device_.logSpace();
  if (room.empty())
    return false;
  auto begin = reinterpret_cast<int64_t>(room.data());
  logBegin_ = begin + headRoom + spareRoom;
  frame_->progress = device_.progress();
  frame_->mostAlone = device_.mostAlone();
  frame_->blockSums =
      reinterpret_cast<uint64_t (*)[mostJoinBlocks]>(blockSums_.data());
  frame_->log.spare = begin + headRoom;
  frame_->log.cursor = logBegin_;
  frame_->log.limit = begin + static_cast<int64_t>(room.size());
  for (size_t i = 0; i < p_.states.size(); ++i)
    if (State &state = p_.states[i];
        state.owned && state.hosts && !isCleared_[i])
      bringToDevice(p_, state);
  device_.enqueue(steps_, exchange_, frame_ + 1);
  return true;
}

bool DeviceFrame::isDone() const { return device_.isDone(); }

DeviceFrame::Outcome DeviceFrame::await() {
  device_.await(steps_);
  const KernelState *last = exchange_.onHost(frame_->latest);
  int64_t end =
      std::max(last ? last->log.cursor : frame_->log.cursor, frame_->highest);
  int64_t limit = frame_->log.limit;
  p_.memory.noteOthers(std::min(end, limit) - logBegin_);
  bool failed =
      frame_->failed != 0 || end > limit || (last && last->log.errors != 0);
  if (end > limit)
    device_.growLog();
  if (failed)
    return keepsState() ? Outcome::Spoilt : Outcome::Repeat;
  noteStatistics();
  return Outcome::Done;
}

bool DeviceFrame::keepsState() const {
  for (size_t i = 0; i < p_.states.size(); ++i) {
    const State &state = p_.states[i];
    bool changes = state.kind == PIKORT_IMAGE || state.written;
    bool stays = state.owned || state.onDevice;
    if (stays && changes && !isCleared_[i])
      return true;
  }
  return false;
}

void DeviceFrame::noteStatistics() {
  for (size_t s = 0; s < p_.stages.size(); ++s) {
    const KernelPlace &place = find(static_cast<int32_t>(s), false);
    p_.stageStats[s].in += place.state.in;
    p_.stageStats[s].placed += place.state.placed;
  }
  for (size_t e = 0; e < p_.edges.size(); ++e)
    p_.stageStats[p_.edges[e].producer].out +=
        static_cast<int64_t>(received_[e]);
}
