// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Scoreboard.cpp - When a warp's results are there -------------------===//

#include "ptx/Scoreboard.h"

using namespace piko::ptx;

/// The instructions of a GPU that one of PTX becomes, each waiting for the one
/// before: as benchmarks/gpu_model/slots.py measures them with ptxas.
static double stepsOf(Class counted) {
  switch (counted) {
  case Class::Integer64:
    return 2;
  case Class::IntegerDivision:
    return 18;
  case Class::SingleDivision:
    return 11;
  case Class::DoubleDivision:
    return 20;
  case Class::Move: // Half of them are spared.
    return 0.5;
  case Class::Parameter: // An operand of what uses it.
    return 0;
  default:
    return 1;
  }
}

/// From issue to result.
static Time latencyOf(const Instruction &it, const Latencies &of) {
  switch (it.counted) {
  case Class::LoadGlobal:
    return {of.hit, of.miss};
  case Class::LoadGeneric:
    return {of.shared, of.miss};
  case Class::LoadLocal:
    return {of.hit, of.hit};
  case Class::LoadShared:
  case Class::WarpOperation:
  case Class::Barrier:
    return {of.shared, of.shared};
  case Class::Atomic:
    if (it.space == Space::Shared)
      return {of.shared, of.shared};
    return {of.miss, of.miss};
  default:
    double cycles = stepsOf(it.counted) * of.arithmetic;
    return {cycles, cycles};
  }
}

void Scoreboard::reset(const Program &program) {
  now = before = issued = slept = {};
  sleptAt = nowhere;
  ready.assign(program.registerCount, {});
}

void Scoreboard::issue(const Program &program, uint32_t pc,
                       const Latencies &latencies) {
  const Instruction &it = program.code[pc];
  const Dependences &on = program.dependences[pc];
  before = now;
  for (uint32_t i : program.readBy(on))
    now.wait(ready[i]);
  issued = now;
  const Time latency = latencyOf(it, latencies);
  for (uint32_t i : program.writtenBy(on))
    ready[i] = now.after(latency);
  const double steps = stepsOf(it.counted);
  now = now.after({steps, steps});
}

void Scoreboard::load(const Program &program, uint32_t pc, const Latencies &of,
                      bool all, bool part) {
  const Time latency{all ? of.hit : of.miss, part ? of.hit : of.miss};
  for (uint32_t i : program.writtenBy(program.dependences[pc]))
    ready[i] = issued.after(latency);
}

void Scoreboard::sleep(uint32_t pc) {
  if (pc == sleptAt)
    now = slept;
  sleptAt = pc;
  slept = now;
}
