// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Counts.cpp - Counts of kernels -------------------------------------===//

#include "Counts.h"

#include <cstdio>
#include <utility>

using namespace piko::testdriver;
namespace ptx = piko::ptx;
using piko::ptx::Class;
using Counts = PikoTestDriverCounts;

namespace {

struct Member {
  const char *name;
  uint64_t Counts::*of;
};

} // namespace

/// The members, by their names.
static constexpr Member members[] = {
    {"launches", &Counts::launches},
    {"blocks", &Counts::blocks},
    {"threads", &Counts::threads},
    {"warps", &Counts::warps},
    {"warpInstructions", &Counts::warpInstructions},
    {"laneInstructions", &Counts::laneInstructions},
    {"longestWarps", &Counts::longestWarps},
    {"lastBlocks", &Counts::lastBlocks},
    {"leastSpan", &Counts::leastSpan},
    {"mostSpan", &Counts::mostSpan},
    {"integer", &Counts::integer},
    {"integer64", &Counts::integer64},
    {"float32", &Counts::float32},
    {"float64", &Counts::float64},
    {"special", &Counts::special},
    {"integerDivision", &Counts::integerDivision},
    {"float32Division", &Counts::float32Division},
    {"float64Division", &Counts::float64Division},
    {"convert", &Counts::convert},
    {"move", &Counts::move},
    {"control", &Counts::control},
    {"loadGlobal", &Counts::loadGlobal},
    {"storeGlobal", &Counts::storeGlobal},
    {"loadShared", &Counts::loadShared},
    {"storeShared", &Counts::storeShared},
    {"loadLocal", &Counts::loadLocal},
    {"storeLocal", &Counts::storeLocal},
    {"loadGeneric", &Counts::loadGeneric},
    {"storeGeneric", &Counts::storeGeneric},
    {"parameter", &Counts::parameter},
    {"atomic", &Counts::atomic},
    {"barrier", &Counts::barrier},
    {"warpOperation", &Counts::warpOperation},
    {"globalBytes", &Counts::globalBytes},
    {"globalSectors", &Counts::globalSectors},
    {"distinctSectors", &Counts::distinctSectors}};
static_assert(std::size(members) * sizeof(uint64_t) == sizeof(Counts));

static uint64_t Counts::*memberOf(Class of) {
  switch (of) {
  case Class::Integer:
    return &Counts::integer;
  case Class::Integer64:
    return &Counts::integer64;
  case Class::Single:
    return &Counts::float32;
  case Class::Double:
    return &Counts::float64;
  case Class::Special:
    return &Counts::special;
  case Class::IntegerDivision:
    return &Counts::integerDivision;
  case Class::SingleDivision:
    return &Counts::float32Division;
  case Class::DoubleDivision:
    return &Counts::float64Division;
  case Class::Convert:
    return &Counts::convert;
  case Class::Move:
    return &Counts::move;
  case Class::Control:
    return &Counts::control;
  case Class::LoadGlobal:
    return &Counts::loadGlobal;
  case Class::StoreGlobal:
    return &Counts::storeGlobal;
  case Class::LoadShared:
    return &Counts::loadShared;
  case Class::StoreShared:
    return &Counts::storeShared;
  case Class::LoadLocal:
    return &Counts::loadLocal;
  case Class::StoreLocal:
    return &Counts::storeLocal;
  case Class::LoadGeneric:
    return &Counts::loadGeneric;
  case Class::StoreGeneric:
    return &Counts::storeGeneric;
  case Class::Parameter:
    return &Counts::parameter;
  case Class::Atomic:
    return &Counts::atomic;
  case Class::Barrier:
    return &Counts::barrier;
  case Class::WarpOperation:
    break;
  }
  return &Counts::warpOperation;
}

void piko::testdriver::addCounts(const ptx::Launch &launch, Counts &counts) {
  const auto &blocks = launch.blocks, &threads = launch.threads;
  uint64_t blockCount = uint64_t(blocks[0]) * blocks[1] * blocks[2];
  uint64_t ofBlock = uint64_t(threads[0]) * threads[1] * threads[2];
  ++counts.launches;
  counts.blocks += blockCount;
  counts.threads += blockCount * ofBlock;
  counts.warps += blockCount * ((ofBlock + ptx::warpSize - 1) / ptx::warpSize);
  counts.longestWarps += launch.longestWarp;
  counts.lastBlocks += launch.lastBlock;
  counts.leastSpan += static_cast<uint64_t>(launch.span.least);
  counts.mostSpan += static_cast<uint64_t>(launch.span.most);
  counts.distinctSectors += launch.footprint.sectors();
  for (size_t pc = 0; pc < launch.sites.size(); ++pc) {
    const ptx::Site &site = launch.sites[pc];
    counts.warpInstructions += site.warps;
    counts.laneInstructions += site.lanes;
    counts.globalBytes += site.bytes;
    counts.globalSectors += site.sectors;
    counts.*memberOf(launch.program.code[pc].counted) += site.warps;
  }
}

void piko::testdriver::addCounts(const Counts &more, Counts &sum) {
  for (const Member &member : members)
    sum.*member.of += more.*member.of;
}

std::string piko::testdriver::describeCounts(const Counts &counts) {
  double lanes = counts.warpInstructions
                     ? 100.0 * static_cast<double>(counts.laneInstructions) /
                           (32.0 * static_cast<double>(counts.warpInstructions))
                     : 0.0;
  char part[32];
  std::snprintf(part, sizeof(part), "%.1f", lanes);
  return std::to_string(counts.launches) + " launches, " +
         std::to_string(counts.warpInstructions) + " warp instructions, " +
         part + " % of lanes, " + std::to_string(counts.globalBytes) +
         " bytes of global memory in " + std::to_string(counts.globalSectors) +
         " sectors" +
         (counts.mostSpan
              ? ", a span of " + std::to_string(counts.leastSpan) + " to " +
                    std::to_string(counts.mostSpan) + " cycles"
              : "");
}

std::string piko::testdriver::toJSON(const Counts &counts) {
  std::string text;
  for (const Member &member : members)
    text += std::string(text.empty() ? "{" : ", ") + "\"" + member.name +
            "\": " + std::to_string(counts.*member.of);
  return text + "}";
}

std::string piko::testdriver::toJSON(const PikoTestDriverHostCounts &counts) {
  std::string text;
  auto add = [&](const char *name, uint64_t count) {
    text += std::string(text.empty() ? "{" : ", ") + "\"" + name +
            "\": " + std::to_string(count);
  };
  add("launches", counts.launches);
  add("copies", counts.copies);
  add("fills", counts.fills);
  add("graphLaunches", counts.graphLaunches);
  add("graphKernels", counts.graphKernels);
  add("waits", counts.waits);
  add("bytesToDevice", counts.bytesToDevice);
  add("bytesFromDevice", counts.bytesFromDevice);
  add("bytesOnDevice", counts.bytesOnDevice);
  add("graphSectors", counts.graphSectors);
  return text + "}";
}
