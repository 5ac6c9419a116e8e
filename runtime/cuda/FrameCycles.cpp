// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- FrameCycles.cpp - What a frame repeats on the device ---------------===//
//
// The program is led once through each loop and each round. A loop becomes
//
//   repeat { for each stage: join, kernel, piko_queue; piko_wave } piko_leave
//
// behind piko_enter, if primitives come into it at several stages; or, if the
// order of its hops can be seen, which runs one position at a time,
//
//   piko_enter repeat { for each stage: kernel; piko_step } piko_leave
//
// and a cycle whose stages a, b collect, with what does not behind each:
//
//   loops and stages  repeat { a  loops and stages  b  loops and stages
//                              piko_round }
//
// Nothing has come for a stage: then its kernel has no units.
//
//===----------------------------------------------------------------------===//

#include "cuda/Frame.h"

using namespace piko::cuda;
using namespace piko::rt;

bool Frame::comesFromOutside(const Stage &stage) const {
  return !stage.sources.empty() ||
         std::any_of(stage.inputs.begin(), stage.inputs.end(),
                     [&](int32_t e) { return !p_.edges[e].insideLoop; });
}

bool Frame::hasEntries(const LoopShape &loop) const {
  return std::count_if(loop.stages.begin(), loop.stages.end(), [&](int32_t s) {
           return comesFromOutside(p_.stages[s]);
         }) > 1;
}

/// For each stage that gets what leaves a loop, the first edge to it.
std::vector<int32_t> Frame::exitsOf(const LoopShape &loop) const {
  std::vector<int32_t> exits;
  for (int32_t s : loop.stages)
    for (int32_t e : p_.stages[s].outputs)
      if (e >= 0 && !p_.edges[e].insideLoop &&
          std::none_of(exits.begin(), exits.end(), [&](int32_t other) {
            return p_.edges[other].consumer == p_.edges[e].consumer;
          }))
        exits.push_back(e);
  return exits;
}

/// Among these, or -1 if the edge does not leave a loop.
int32_t Frame::groupOf(const Edge &edge) const {
  int32_t loop = p_.stages[edge.producer].loop;
  if (loop < 0 || edge.insideLoop)
    return -1;
  int32_t group = 0;
  for (int32_t e : exitsOf(p_.loops[loop])) {
    if (p_.edges[e].consumer == edge.consumer)
      break;
    ++group;
  }
  return group;
}

std::vector<int32_t> Frame::collectorsOf(int32_t cycle) const {
  std::vector<int32_t> collectors;
  for (int32_t s : p_.cycles[cycle].stages)
    if (p_.stages[s].collects())
      collectors.push_back(s);
  return collectors;
}

/// The stage of its loop that an edge leads to, or -1.
int32_t Frame::memberOf(const Edge &edge) const {
  if (!edge.insideLoop)
    return -1;
  const std::vector<int32_t> &stages =
      p_.loops[p_.stages[edge.producer].loop].stages;
  return static_cast<int32_t>(
      std::find(stages.begin(), stages.end(), edge.consumer) - stages.begin());
}

std::vector<QueuePort> Frame::describePorts(int32_t kernel) const {
  std::vector<QueuePort> ports;
  for (int32_t e : edgesOf(kernel)) {
    const Edge &edge = p_.edges[e];
    if (hasQueue(edge))
      ports.push_back({describeEdge(e), describeShape(p_.stages[edge.consumer]),
                       onDevice(&queues_[e]), groupOf(edge), memberOf(edge)});
  }
  return ports;
}

void Frame::queue(const Place &place) {
  std::vector<QueuePort> ports = describePorts(place.stage);
  if (ports.empty())
    return;
  auto &args = exchange_.takeWith<QueueArgs>(ports);
  args.portCount = static_cast<int32_t>(ports.size());
  args.frame = onDevice(frame_);
  args.kernel = place.args->kernel;
  args.loop = place.args->loop;
  args.number = nextNumber();
  launchOwn("piko_queue", &args, timed_);
}

// --- Loops ------------------------------------------------------------------

void Frame::repeat(const int32_t &again) {
  steps_.push_back({Step::Kind::Repeat, {}, onDevice(&again)});
}

void Frame::endRepeat(const int32_t &again) {
  steps_.push_back({Step::Kind::End, {}, onDevice(&again)});
}

int32_t Frame::stepLoop(int32_t loop) {
  const std::vector<int32_t> &stages = p_.loops[loop].stages;
  size_t &member = members_[static_cast<size_t>(loop)];
  const int32_t &again = loops_[loop].again;
  bool hasStack = p_.loops[loop].ordered;
  if (member == 0) {
    if (hasStack || hasEntries(p_.loops[loop]))
      enter(loop);
    repeat(again);
  }
  if (member < stages.size())
    return stages[member++];
  if (hasStack)
    endPosition(loop);
  else
    endWave(loop);
  endRepeat(again);
  endLoop(loop);
  member = 0;
  return -1;
}

StepArgs &Frame::takeStep(const std::vector<QueueState *> &waiting) {
  auto &args = exchange_.takeWith<StepArgs>(waiting);
  args.queueCount = static_cast<int32_t>(waiting.size());
  args.frame = onDevice(frame_);
  args.number = nextNumber();
  args.limit = p_.loopLimit;
  return args;
}

/// What a stage takes of such a loop.
std::vector<JoinInput> Frame::describeWave(int32_t number) const {
  const Stage &stage = p_.stages[number];
  std::vector<JoinInput> inputs = describeInputs(stage);
  std::erase_if(inputs, [](const JoinInput &input) { return !input.isInLoop; });
  if (comesFromOutside(stage)) {
    JoinInput &entries = inputs.emplace_back();
    entries.queue = onDevice(&entriesOf(number));
    entries.isInLoop = true;
  }
  return inputs;
}

void Frame::enter(int32_t loop) {
  std::vector<LoopEntry> entries;
  std::vector<JoinInput> inputs;
  const std::vector<int32_t> &stages = p_.loops[loop].stages;
  for (size_t m = 0; m < stages.size(); ++m) {
    int32_t s = stages[m];
    const Stage &stage = p_.stages[s];
    if (!comesFromOutside(stage))
      continue;
    std::vector<JoinInput> ofStage = describeInputs(stage);
    entries.push_back({onDevice(&find(s, false).state), onDevice(&entriesOf(s)),
                       describeShape(stage), onDevice(stripOf(stage)),
                       static_cast<int32_t>(inputs.size()),
                       static_cast<int32_t>(ofStage.size()),
                       static_cast<int32_t>(m)});
    inputs.insert(inputs.end(), ofStage.begin(), ofStage.end());
  }
  auto &args = exchange_.takeWith<EnterArgs>(entries, inputs);
  args.frame = onDevice(frame_);
  args.loop = onDevice(&loops_[loop]);
  args.number = nextNumber();
  args.keyWidth = p_.loops[loop].keyWidth;
  args.entryCount = static_cast<int32_t>(entries.size());
  args.inputCount = static_cast<int32_t>(inputs.size());
  if (p_.loops[loop].ordered) {
    StackArgs *&stack = stacks_[static_cast<size_t>(loop)];
    stack = &describeStack(loop);
    args.stack = onDevice(stack);
  }
  launchOwn("piko_enter", &args);
}

StackArgs &Frame::describeStack(int32_t loop) {
  std::vector<StackMember> members;
  std::vector<QueuePort> ports;
  for (int32_t s : p_.loops[loop].stages) {
    std::vector<QueuePort> ofStage = describePorts(s);
    members.push_back({onDevice(&find(s, false).state),
                       describeShape(p_.stages[s]), p_.stages[s].tiles,
                       static_cast<int32_t>(ports.size()),
                       static_cast<int32_t>(ofStage.size())});
    ports.insert(ports.end(), ofStage.begin(), ofStage.end());
  }
  auto &args = exchange_.takeWith<StackArgs>(members, ports);
  args.frame = onDevice(frame_);
  args.loop = onDevice(&loops_[loop]);
  args.stack = onDevice(&stackStates_[loop]);
  args.limit = p_.loopLimit;
  args.memberCount = static_cast<int32_t>(members.size());
  args.portCount = static_cast<int32_t>(ports.size());
  return args;
}

void Frame::endPosition(int32_t loop) {
  StackArgs &args = *stacks_[static_cast<size_t>(loop)];
  args.number = nextNumber();
  launchWarp(stepKernel, &args);
}

void Frame::endWave(int32_t loop) {
  StepArgs &args = takeStep(describeWaiting([&](const Edge &edge) {
    return edge.insideLoop && p_.stages[edge.producer].loop == loop;
  }));
  args.loop = onDevice(&loops_[loop]);
  if (hasEntries(p_.loops[loop]) && args.limit < INT64_MAX)
    ++args.limit;
  launchOwn("piko_wave", &args);
}

void Frame::endLoop(int32_t loop) {
  std::vector<ExitGroup> groups;
  for (int32_t e : exitsOf(p_.loops[loop]))
    groups.push_back({onDevice(&queues_[e]),
                      describeShape(p_.stages[p_.edges[e].consumer]),
                      p_.edges[e].keyWidth});
  auto &args = exchange_.takeWith<LeaveArgs>(groups);
  args.groupCount = static_cast<int32_t>(groups.size());
  args.frame = onDevice(frame_);
  args.loop = onDevice(&loops_[loop]);
  args.number = nextNumber();
  args.keyWidth = p_.loops[loop].keyWidth;
  launchOwn("piko_leave", &args);
}

// --- Rounds -----------------------------------------------------------------

int32_t Frame::nextTurn(int32_t cycle) {
  std::vector<int32_t> collectors = collectorsOf(cycle);
  size_t &turn = turns_[static_cast<size_t>(cycle)];
  if (collectors.empty())
    return -1;
  const int32_t &again = cycles_[cycle].again;
  if (turn == 0)
    repeat(again);
  if (turn < collectors.size())
    return collectors[turn++];
  endRound(cycle);
  endRepeat(again);
  return -1;
}

void Frame::endRound(int32_t cycle) {
  StepArgs &args = takeStep(describeWaiting([&](const Edge &edge) {
    const Stage &to = p_.stages[edge.consumer];
    return hasQueue(edge) && to.cycle == cycle && to.collects();
  }));
  args.cycle = onDevice(&cycles_[cycle]);
  launchOwn("piko_round", &args);
}
