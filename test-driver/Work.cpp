// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Work.cpp - What streams do -----------------------------------------===//

#include "Counts.h"
#include "State.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>
#include <utility>

using namespace piko::testdriver;
using namespace piko::cuda;
namespace ptx = piko::ptx;
using piko::ptx::FaultKind;

namespace {

CUresult errorOf(FaultKind kind) {
  switch (kind) {
  case FaultKind::IllegalAddress:
    return CUDA_ERROR_ILLEGAL_ADDRESS;
  case FaultKind::MisalignedAddress:
    return CUDA_ERROR_MISALIGNED_ADDRESS;
  case FaultKind::IllegalInstruction:
    return CUDA_ERROR_ILLEGAL_INSTRUCTION;
  case FaultKind::Deadlock:
    return CUDA_ERROR_LAUNCH_TIMEOUT;
  case FaultKind::Trap:
    break;
  }
  return CUDA_ERROR_LAUNCH_FAILED;
}

/// Another one each time: on a device no frame is like the one before.
uint64_t seedOfLaunch() {
  uint64_t launch = state().launches++;
  return state().seed ? state().seed + launch * 0x9e3779b97f4a7c15 : 0;
}

/// The lines of PTX that a launch has spent most in, with the warp instructions
/// of each, and how many lanes have been active, in the order of the text.
std::string describeLines(const ptx::Launch &launch) {
  constexpr size_t most = 40;
  struct Spent {
    uint64_t warps = 0, lanes = 0;
  };
  std::map<uint32_t, Spent> spent; // by line
  for (size_t pc = 0; pc < launch.sites.size(); ++pc) {
    Spent &line = spent[launch.program.code[pc].line];
    line.warps += launch.sites[pc].warps;
    line.lanes += launch.sites[pc].lanes;
  }
  std::vector<uint64_t> sorted;
  for (const auto &[line, it] : spent)
    sorted.push_back(it.warps);
  std::sort(sorted.rbegin(), sorted.rend());
  uint64_t least = most < sorted.size() ? sorted[most] + 1 : 1;
  std::string text;
  for (const auto &[line, it] : spent) {
    if (it.warps < least)
      continue;
    char numbers[64];
    std::snprintf(numbers, sizeof(numbers), "  %12llu %4.0f%% %6u: ",
                  static_cast<unsigned long long>(it.warps),
                  100.0 * static_cast<double>(it.lanes) /
                      (ptx::warpSize * static_cast<double>(it.warps)),
                  line);
    text += numbers + std::string(ptx::lineOf(launch.source, line)) + '\n';
  }
  return text;
}

void runKernel(const Call &call, const Kernel &kernel,
               ptx::Conditions *conditions) {
  Context &context = call.context();
  const Function &function = context.functions.find(kernel.function)->second;
  ptx::Launch launch{
      function.program,  context.memory,     function.module->source,
      kernel.blocks,     kernel.threads,     kernel.sharedBytes,
      kernel.parameters, kernel.cooperative, seedOfLaunch()};
  launch.apart = state().modes.apart;
  launch.buffered = state().modes.buffered;
  launch.conditions = conditions;
  if (state().latencies)
    launch.latencies = &*state().latencies;
  const auto &threads = kernel.threads, &blocks = kernel.blocks;
  const auto processors = static_cast<uint64_t>(state().multiprocessors);
  const auto room = static_cast<uint64_t>(std::max(
      1, residentBlocks(function.program,
                        static_cast<int>(threads[0] * threads[1] * threads[2]),
                        kernel.sharedBytes)));
  launch.resident = processors * room;
  const uint64_t count = uint64_t(blocks[0]) * blocks[1] * blocks[2];
  launch.together = std::min(room, (count + processors - 1) / processors);
  try {
    ptx::run(launch);
  } catch (const ptx::Fault &fault) {
    // As a launch that runs while the host goes on.
    context.failed = call.fail(errorOf(fault.kind), fault.text);
  }
  const std::string &name = function.program.name;
  addCounts(launch, state().counts[name]);
  if (state().graphFootprint)
    state().graphFootprint->add(launch.footprint);
  bool withLines = state().countsGoTo == "lines";
  if (withLines || state().countsGoTo == "launches") {
    PikoTestDriverCounts counts{};
    addCounts(launch, counts);
    std::fprintf(stderr, "%s: %s\n%s", name.c_str(),
                 describeCounts(counts).c_str(),
                 withLines ? describeLines(launch).c_str() : "");
  }
}

/// Where a part of the device's memory is in the host.
uint8_t *placeOf(const Context &context, uint64_t address) {
  const Allocation *it = context.memory.at(address);
  return it->memory + (address - it->begin);
}

void runCopy(const Context &context, const Copy &copy) {
  auto *to = copy.direction == Direction::FromDevice
                 ? reinterpret_cast<uint8_t *>(copy.to)
                 : placeOf(context, copy.to);
  const auto *from = copy.direction == Direction::ToDevice
                         ? reinterpret_cast<const uint8_t *>(copy.from)
                         : placeOf(context, copy.from);
  std::memmove(to, from, copy.bytes);
}

void count(const Work &work, PikoTestDriverHostCounts &counts) {
  if (const auto *copy = std::get_if<Copy>(&work))
    (copy->direction == Direction::ToDevice     ? counts.bytesToDevice
     : copy->direction == Direction::FromDevice ? counts.bytesFromDevice
                                                : counts.bytesOnDevice) +=
        copy->bytes;
  ++(std::holds_alternative<Kernel>(work) ? counts.launches
     : std::holds_alternative<Copy>(work) ? counts.copies
                                          : counts.fills);
}

} // namespace

std::string piko::testdriver::checkMemory(const Context &context,
                                          uint64_t address, uint64_t bytes) {
  const Allocation *it = context.memory.at(address);
  if (it && bytes <= it->begin + it->bytes - address)
    return {};
  std::string known = context.memory.describe(address);
  return std::to_string(bytes) + " bytes are not all in an allocation" +
         (known.empty() ? "" : ", " + known);
}

std::string piko::testdriver::checkMemory(const Context &context,
                                          const Work &work) {
  if (const auto *fill = std::get_if<Fill>(&work))
    return checkMemory(context, fill->address, fill->bytes);
  const auto *copy = std::get_if<Copy>(&work);
  if (!copy)
    return {};
  if ((copy->direction == Direction::FromDevice && !copy->to) ||
      (copy->direction == Direction::ToDevice && !copy->from))
    return "null";
  std::string wrong;
  if (copy->direction != Direction::FromDevice)
    wrong = checkMemory(context, copy->to, copy->bytes);
  if (wrong.empty() && copy->direction != Direction::ToDevice)
    wrong = checkMemory(context, copy->from, copy->bytes);
  return wrong;
}

void piko::testdriver::run(const Call &call, const Work &work,
                           ptx::Conditions *conditions) {
  if (const auto *kernel = std::get_if<Kernel>(&work))
    runKernel(call, *kernel, conditions);
  else if (const auto *copy = std::get_if<Copy>(&work))
    runCopy(call.context(), *copy);
  else if (const auto *fill = std::get_if<Fill>(&work))
    std::memset(placeOf(call.context(), fill->address), fill->value,
                fill->bytes);
}

/// Whether memory of the host is none that the driver has made, which it copies
/// to or from before the call returns.
static bool isPageable(const Context &context, uint64_t address) {
  return !context.memory.at(address);
}

/// A stream that is not waited for does it later; a copy's error is the
/// context's then.
static CUresult runOrDelay(const Call &call, CUstream stream, Work work) {
  if (!state().delays) {
    run(call, work);
    return CUDA_SUCCESS;
  }
  Later &later = call.context().laterOf(stream);
  auto *copy = std::get_if<Copy>(&work);
  if (copy && copy->direction == Direction::FromDevice &&
      isPageable(call.context(), copy->to)) {
    if (CUresult error = call.finish(later))
      return error;
    run(call, work);
    return CUDA_SUCCESS;
  }
  std::shared_ptr<std::vector<uint8_t>> staged;
  if (copy && copy->direction == Direction::ToDevice &&
      isPageable(call.context(), copy->from)) {
    const auto *from = reinterpret_cast<const uint8_t *>(copy->from);
    staged = std::make_shared<std::vector<uint8_t>>(from, from + copy->bytes);
    copy->from = reinterpret_cast<uint64_t>(staged->data());
  }
  later.push_back(
      [work = std::move(work), staged](const Call &at) { run(at, work); });
  return CUDA_SUCCESS;
}

CUresult piko::testdriver::submit(const Call &call, CUstream stream,
                                  Work work) {
  if (CUresult error = call.checkStream(stream))
    return error;
  if (std::string wrong = checkMemory(call.context(), work); !wrong.empty())
    return call.fail(CUDA_ERROR_INVALID_VALUE, wrong);
  if (Capture *capture = call.context().captureOf(stream)) {
    Graph &graph = call.context().graphs[capture->graph];
    if (capture->last != graph.last())
      return call.fail(CUDA_ERROR_NOT_SUPPORTED,
                       "nodes that do not follow each other");
    capture->last = graph.add(std::move(work));
    return CUDA_SUCCESS;
  }
  count(work, state().hostCounts);
  return runOrDelay(call, stream, std::move(work));
}
