// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Control.cpp - Branches, calls and returns of PTX -------------------===//

#include "ptx/Lanes.h"
#include "ptx/Machine.h"
#include "ptx/text/Decoder.h"

#include <cstring>

using namespace piko::ptx;

namespace {

/// it.variant says whether all lanes must agree.
void branch(Warp &warp, const Instruction &it) {
  if (it.variant && !warp.isWhole())
    warp.fault(FaultKind::IllegalInstruction,
               "lanes of a warp part at a branch that says they do not",
               static_cast<uint32_t>(std::countr_zero(warp.active)));
  warp.branch(it.target, it.reconverge);
}

void branchByIndex(Warp &warp, const Instruction &it) {
  const std::vector<uint32_t> &targets = warp.program->branchTables[it.extra];
  std::array<Warp::Part, warpSize> parts;
  size_t count = 0;
  forEachLane(warp.active, [&](uint32_t lane) {
    uint32_t index = warp.lanes<uint32_t>(it.a)[lane];
    if (index >= targets.size())
      warp.fault(FaultKind::IllegalInstruction,
                 "branch to target " + std::to_string(index) + " of " +
                     std::to_string(targets.size()),
                 lane);
    size_t part = 0;
    while (part < count && parts[part].target != targets[index])
      ++part;
    if (part == count)
      parts[count++] = {0, targets[index]};
    parts[part].mask |= 1u << lane;
  });
  warp.part(std::span(parts.data(), count), it.reconverge);
}

void copy(Warp &warp, const Instruction &it) {
  const uint32_t stride = warp.program->callBytes;
  forEachLane(warp.active, [&](uint32_t lane) {
    uint8_t *memory = warp.calls + uint64_t(lane) * stride;
    for (const Copies::Copy &one : warp.program->calls[it.extra].list)
      std::memcpy(memory + one.to, memory + one.from, one.size);
  });
}

void call(Warp &warp, const Instruction &it) {
  copy(warp, it);
  warp.call(it.target);
}

/// it.extra: copies from where the handle and the value are.
void setCondition(Warp &warp, const Instruction &it) {
  const auto &from = warp.program->calls[it.extra].list;
  forEachLane(warp.active, [&](uint32_t lane) {
    const uint8_t *memory =
        warp.calls + uint64_t(lane) * warp.program->callBytes;
    uint64_t handle = 0;
    uint32_t value = 0;
    std::memcpy(&handle, memory + from[0].from, sizeof(handle));
    std::memcpy(&value, memory + from[1].from, sizeof(value));
    Conditions *conditions = warp.block.launch.conditions;
    if (!conditions || !conditions->set(handle, value))
      warp.fault(FaultKind::IllegalAddress,
                 "no condition of the graph that runs", lane);
  });
}

void returnLanes(Warp &warp, const Instruction &) { warp.returnLanes(); }
void exitLanes(Warp &warp, const Instruction &) { warp.exitLanes(); }

void trap(Warp &warp, const Instruction &) {
  warp.fault(FaultKind::Trap, "trap",
             static_cast<uint32_t>(std::countr_zero(warp.active)));
}

bool decodeBranch(Decoding &d) {
  d.it.variant = d.take("uni");
  if (d.base() == "bra") {
    d.finish(1);
    d.it.run = branch;
    d.it.flow = Flow::Branch;
    d.branchLabel = d.argument(0).name;
    return true;
  }
  if (!d.take("idx"))
    d.fail("expected brx.idx");
  d.finish(2);
  if (d.it.guarded)
    d.fail("expected no guard");
  d.it.run = branchByIndex;
  d.it.flow = Flow::Table;
  d.it.a = d.value(0, Type{Kind::Unsigned, 32});
  d.branchTable = d.argument(1).name;
  return true;
}

/// Where an argument of a call is.
uint32_t placeOf(Decoding &d, const Argument &argument) {
  Space space = Space::Generic;
  uint64_t address = argument.kind == Argument::Symbol
                         ? d.scope.addressOf(argument.name, space)
                         : 0;
  if (space != Space::Param || address < callStart)
    d.fail("expected a variable in parameter memory");
  return static_cast<uint32_t>(address - callStart);
}

/// A function of the driver, which no module defines.
bool decodeSetConditional(Decoding &d, const Argument *given) {
  if (!given || given->parts.size() != 2)
    d.fail("expected 2 parameters of 'cudaGraphSetConditional'");
  d.it.run = setCondition;
  d.it.extra =
      d.scope.addCopies({{{placeOf(d, given->parts[0]), 0, sizeof(uint64_t)},
                          {placeOf(d, given->parts[1]), 0, sizeof(uint32_t)}}});
  return true;
}

/// Between variables of the caller and the callee's parameters or results.
Copies copiesOf(Decoding &d, const Argument *given,
                const FunctionSyntax &callee,
                const std::vector<Variable> &declared, bool fromCallee) {
  Copies copies;
  if ((given ? given->parts.size() : 0) != declared.size())
    d.fail("expected " + std::to_string(declared.size()) +
           " parameters or results of '" + callee.name + "'");
  for (size_t i = 0; i < declared.size(); ++i) {
    const uint32_t own = placeOf(d, given->parts[i]);
    Parameter other = d.scope.parameterOf(callee, declared[i]);
    copies.list.push_back(fromCallee
                              ? Copies::Copy{other.offset, own, other.size}
                              : Copies::Copy{own, other.offset, other.size});
  }
  return copies;
}

bool decodeCall(Decoding &d) {
  d.take("uni");
  const std::vector<Argument> &arguments = d.statement.arguments;
  d.finish(arguments.size());
  const Argument *results = nullptr, *parameters = nullptr;
  size_t next = 0;
  if (next < arguments.size() && arguments[next].kind == Argument::List)
    results = &arguments[next++];
  if (d.argument(next).kind != Argument::Symbol)
    d.fail("expected the name of a function");
  const std::string &callee = d.argument(next++).name;
  if (next < arguments.size() && arguments[next].kind == Argument::List)
    parameters = &arguments[next++];
  if (next != arguments.size())
    d.fail("expected a call of a function by its name");
  if (callee == "cudaGraphSetConditional")
    return decodeSetConditional(d, parameters);
  d.callee = callee;
  const FunctionSyntax &function = d.scope.functionOf(callee);
  d.it.run = call;
  d.it.extra = d.scope.addCopies(
      copiesOf(d, parameters, function, function.parameters, false));
  d.after = d.it;
  d.after.run = copy;
  d.after.extra =
      d.scope.addCopies(copiesOf(d, results, function, function.results, true));
  return true;
}

bool decodeEnd(Decoding &d) {
  d.take("uni");
  d.finish(0);
  d.it.run = d.base() == "ret"    ? returnLanes
             : d.base() == "exit" ? exitLanes
                                  : trap;
  d.it.flow = d.base() == "trap" ? Flow::Trap : Flow::End;
  return true;
}

} // namespace

Instruction piko::ptx::implicitReturn(uint32_t line) {
  Instruction it;
  it.run = returnLanes;
  it.flow = Flow::End;
  it.counted = Class::Control;
  it.line = line;
  return it;
}

bool piko::ptx::decodeControl(Decoding &d) {
  std::string_view base = d.base();
  d.it.counted = Class::Control;
  if (base == "bra" || base == "brx")
    return decodeBranch(d);
  if (base == "call")
    return decodeCall(d);
  return (base == "ret" || base == "exit" || base == "trap") && decodeEnd(d);
}
