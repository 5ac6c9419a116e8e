// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- FrameCycles.cpp - What a frame repeats on the device ---------------===//
//
// A loop becomes
//
//   repeat { for each stage: join, kernel, piko_queue; piko_wave } piko_leave
//
// after piko_enter, if primitives come into it at several stages; or, if the
// order of its hops can be seen, which runs one position at a time,
//
//   piko_enter repeat { for each stage: kernel; piko_step } piko_leave
//
// and a cycle whose stages a, b collect, with what does not after each:
//
//   loops and stages  repeat { a  loops and stages  b  loops and stages
//                              piko_round }
//
// Nothing has come for a stage: then its kernel has no units.
//
//===----------------------------------------------------------------------===//

#include "cuda/frame/Frame.h"

#include <algorithm>

using namespace piko::cuda;
using namespace piko::rt;

DeviceFrame::LoopSteps DeviceFrame::loopAt(size_t at) const {
  LoopSteps loop;
  for (loop.number = program_[at].number;
       program_[at].kind != PIKOIR_STEP_END_WAVES; ++at) {
    const pikoir_cuda_step &step = program_[at];
    if (step.kind == PIKOIR_STEP_ENTRY)
      loop.entries.push_back(&step);
    else if (step.kind == PIKOIR_STEP_EXIT)
      loop.exits.push_back(&step);
    else if (step.kind == PIKOIR_STEP_STAGE)
      loop.members.push_back({step.number, queuesAfter(at)});
  }
  return loop;
}

void DeviceFrame::queue(const KernelPlace &place, Steps queues) {
  std::vector<QueuePort> ports = describePorts(queues);
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

void DeviceFrame::repeat(const int32_t &again) {
  steps_.push_back({Step::Kind::Repeat, {}, onDevice(&again)});
}

void DeviceFrame::endRepeat(const int32_t &again) {
  steps_.push_back({Step::Kind::End, {}, onDevice(&again)});
}

void DeviceFrame::beginLoop() {
  if (!loop_.entries.empty())
    enter();
  repeat(loops_[loop_.number].again);
}

void DeviceFrame::endLoop() {
  if (stack_)
    endPosition();
  else
    endWave();
  endRepeat(loops_[loop_.number].again);
  leave();
  stack_ = nullptr;
}

StepArgs &DeviceFrame::takeStep(const std::vector<QueueState *> &waiting) {
  auto &args = exchange_.takeWith<StepArgs>(waiting);
  args.queueCount = static_cast<int32_t>(waiting.size());
  args.frame = onDevice(frame_);
  args.number = nextNumber();
  args.limit = p_.loopLimit;
  return args;
}

void DeviceFrame::enter() {
  std::vector<LoopEntry> entries;
  std::vector<JoinInput> inputs;
  for (const pikoir_cuda_step *entry : loop_.entries) {
    int32_t s = entry->number;
    const Stage &stage = p_.stages[s];
    std::vector<JoinInput> ofStage = describeInputs(stage);
    entries.push_back({onDevice(&find(s, false).state), onDevice(&entriesOf(s)),
                       describeShape(stage), onDevice(stripOf(stage)),
                       static_cast<int32_t>(inputs.size()),
                       static_cast<int32_t>(ofStage.size()), entry->member});
    inputs.insert(inputs.end(), ofStage.begin(), ofStage.end());
  }
  auto &args = exchange_.takeWith<EnterArgs>(entries, inputs);
  args.frame = onDevice(frame_);
  args.loop = onDevice(&loops_[loop_.number]);
  args.number = nextNumber();
  args.keyWidth = p_.loops[loop_.number].keyWidth;
  args.entryCount = static_cast<int32_t>(entries.size());
  args.inputCount = static_cast<int32_t>(inputs.size());
  if (p_.loops[loop_.number].ordered) {
    stack_ = &describeStack();
    args.stack = onDevice(stack_);
  }
  launchOwn("piko_enter", &args);
}

void DeviceFrame::endPosition() {
  stack_->number = nextNumber();
  launchWarp(stepKernel, stack_);
}

void DeviceFrame::endWave() {
  StepArgs &args = takeStep(describeWaiting([&](const Edge &edge) {
    return edge.insideLoop && p_.stages[edge.producer].loop == loop_.number;
  }));
  args.loop = onDevice(&loops_[loop_.number]);
  if (!loop_.entries.empty() && args.limit < INT64_MAX)
    ++args.limit;
  launchOwn("piko_wave", &args);
}

void DeviceFrame::leave() {
  std::vector<ExitGroup> groups;
  for (const pikoir_cuda_step *exit : loop_.exits) {
    const Edge &edge = p_.edges[exit->number];
    groups.push_back({onDevice(&queues_[exit->number]),
                      describeShape(p_.stages[edge.consumer]), edge.keyWidth});
  }
  auto &args = exchange_.takeWith<LeaveArgs>(groups);
  args.groupCount = static_cast<int32_t>(groups.size());
  args.frame = onDevice(frame_);
  args.loop = onDevice(&loops_[loop_.number]);
  args.number = nextNumber();
  args.keyWidth = p_.loops[loop_.number].keyWidth;
  launchOwn("piko_leave", &args);
}

// --- Rounds -----------------------------------------------------------------

void DeviceFrame::endRounds(int32_t cycle) {
  StepArgs &args = takeStep(describeWaiting([&](const Edge &edge) {
    const Stage &to = p_.stages[edge.consumer];
    return hasQueue(edge) && to.cycle == cycle && to.collects();
  }));
  args.cycle = onDevice(&cycles_[cycle]);
  launchOwn("piko_round", &args);
  endRepeat(cycles_[cycle].again);
}
