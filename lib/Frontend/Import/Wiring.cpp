//===- Wiring.cpp - What a pipeline's code says once ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// It is read from simplified IR, where templates, `if constexpr` and helper
// functions are gone: a marker that is called unconditionally with constant
// arguments is a fact about the pipeline.
//
//===----------------------------------------------------------------------===//

#include "Import/Wiring.h"

#include "Import/Directives.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/ADT/PostOrderIterator.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::dyn_cast;
using mlir::InFlightDiagnostic;

namespace {

class WiringReader {
public:
  WiringReader(ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context)
      : unit(unit), pipeline(unit.pipeline), memory(memory), context(context) {}

  bool run() {
    if (!readGraph() || !checkGraph())
      return false;
    for (auto [index, stage] : llvm::enumerate(pipeline.stages))
      if (stage.hasSchedule &&
          !readDirectives(getWrapper(WrapperKind::Schedule, index), stage, unit,
                          context))
        return false;
    for (auto [index, state] : llvm::enumerate(pipeline.state))
      if (state.hasClear() && !state.isEvaluated && !readClear(index, state))
        return false;
    return true;
  }

private:
  llvm::Function &getWrapper(WrapperKind kind, unsigned index) {
    return unit.wrappers.get(*unit.module, kind, index);
  }
  InFlightDiagnostic fail(const llvm::CallInst *call) {
    return emitUserError(call, unit, context);
  }

  /// The constant that a marker is given; reports where it is not one.
  std::optional<int64_t> getConstant(const llvm::CallInst *call,
                                     unsigned operand, llvm::StringRef what) {
    if (auto *number =
            dyn_cast<llvm::ConstantInt>(call->getArgOperand(operand)))
      return number->getSExtValue();
    fail(call) << "expected " << what << " to be a constant";
    return std::nullopt;
  }

  //===--------------------------------------------------------------------===//
  // The graph
  //===--------------------------------------------------------------------===//

  std::optional<unsigned> getStage(const llvm::CallInst *call,
                                   unsigned operand) {
    Address address = getAddress(call->getArgOperand(operand), memory.data);
    if (llvm::isa<llvm::AllocaInst>(address.base) && address.terms.empty())
      for (auto [index, stage] : llvm::enumerate(pipeline.stages))
        if (stage.offset == address.offset)
          return index;
    fail(call) << "expected a stage that is a member of pipeline '"
               << pipeline.name << "'";
    return std::nullopt;
  }

  bool readGraph() {
    llvm::Function &function = getWrapper(WrapperKind::Wire, 0);
    Once once(function);
    std::vector<llvm::CallInst *> calls;
    llvm::ReversePostOrderTraversal<llvm::Function *> order(&function);
    for (llvm::BasicBlock *block : order)
      for (llvm::Instruction &instruction : *block)
        if (auto *call = dyn_cast<llvm::CallInst>(&instruction))
          calls.push_back(call);
    for (llvm::CallInst *call : calls) {
      const Marker *marker = getMarker(call, unit.markers);
      if (!marker || marker->kind == MarkerKind::state)
        continue;
      if (!once.contains(call->getParent())) {
        fail(call) << "expected a pipeline's constructor to connect its stages "
                      "unconditionally";
        return false;
      }
      bool ok = true;
      switch (marker->kind) {
      case MarkerKind::source:
        ok = readSource(call);
        break;
      case MarkerKind::connect:
        ok = readEdge(call);
        break;
      case MarkerKind::allocateForSource:
        ok = readAllocation(call);
        break;
      case MarkerKind::expectIndex:
        ok = readContract(call, *marker);
        break;
      default:
        fail(call) << "expected a pipeline's constructor to connect its stages "
                      "and nothing else";
        ok = false;
        break;
      }
      if (!ok)
        return false;
    }
    return true;
  }

  bool readSource(const llvm::CallInst *call) {
    std::optional<unsigned> stage = getStage(call, 0);
    if (!stage)
      return false;
    pipeline.sources.push_back({*stage, getUserLocation(call, unit, context)});
    return true;
  }

  bool readEdge(const llvm::CallInst *call) {
    std::optional<unsigned> producer = getStage(call, 0);
    std::optional<int64_t> port = getConstant(call, 1, "the port of an edge");
    std::optional<unsigned> consumer = getStage(call, 2);
    if (!producer || !port || !consumer)
      return false;
    const StageDescription &from = pipeline.stages[*producer];
    const StageDescription &to = pipeline.stages[*consumer];
    int64_t ports = from.outputs.size();
    if (*port < 0 || *port >= ports) {
      fail(call) << "expected one of the " << ports << " ports of stage '"
                 << from.name << "', but got port " << *port;
      return false;
    }
    for (const EdgeDescription &edge : pipeline.edges)
      if (edge.producer == *producer && edge.port == *port) {
        InFlightDiagnostic diagnostic = fail(call);
        diagnostic << "port " << *port << " of stage '" << from.name
                   << "' is connected twice";
        diagnostic.attachNote(edge.location)
            << "it is connected here, and a port has one edge";
        llvm::StringRef type = pipeline.records[from.outputs[*port]].name;
        diagnostic.attachNote(from.location)
            << "for two edges give the stage a port more, '" << type << "', '"
            << type << "' behind its input in piko::Stage<...>, and emit to "
            << "both: emit(value, 0), emit(value, 1)";
        return false;
      }
    if (from.outputs[*port] != to.input) {
      InFlightDiagnostic diagnostic = fail(call);
      diagnostic << "expected an edge between equal types, but port " << *port
                 << " of stage '" << from.name << "' emits '"
                 << pipeline.records[from.outputs[*port]].name
                 << "' and stage '" << to.name << "' takes '"
                 << pipeline.records[to.input].name << "'";
      diagnostic.attachNote(to.location)
          << "stage '" << to.name
          << "' is declared here; a stage takes one type, the first in "
             "piko::Stage<...>, and those behind it are its ports'";
      return false;
    }
    pipeline.edges.push_back({*producer, static_cast<unsigned>(*port),
                              *consumer, getUserLocation(call, unit, context)});
    return true;
  }

  /// A buffer of the state, by its number; reports where it is none.
  std::optional<unsigned> getBuffer(const llvm::CallInst *call,
                                    unsigned operand) {
    const StateDescription *state =
        memory.getState(call->getArgOperand(operand));
    if (state)
      return state - pipeline.state.data();
    fail(call) << "expected a buffer of the pipeline's state";
    return std::nullopt;
  }

  bool readAllocation(const llvm::CallInst *call) {
    std::optional<int64_t> source =
        getConstant(call, 1, "the source of a buffer");
    std::optional<unsigned> buffer = source ? getBuffer(call, 0) : std::nullopt;
    if (!buffer)
      return false;
    StateDescription &ours = pipeline.state[*buffer];
    ours.perSource = source;
    allocations.push_back({&ours, call});
    return true;
  }

  bool readContract(const llvm::CallInst *call, const Marker &marker) {
    std::optional<int64_t> source = getConstant(call, 0,
                                                "the source of a "
                                                "field");
    std::optional<int64_t> offset = getConstant(call, 2, "a field"),
                           size = getConstant(call, 3, "a field"),
                           below = getConstant(call, 5,
                                               "what an index is "
                                               "below");
    if (!source || !offset || !size || !below)
      return false;
    ContractDescription contract{std::nullopt,
                                 std::nullopt,
                                 {},
                                 marker.isSigned,
                                 std::nullopt,
                                 *below,
                                 getUserLocation(call, unit, context)};
    if (llvm::isa<llvm::ConstantPointerNull>(call->getArgOperand(1)))
      contract.source = source;
    else if (contract.buffer = getBuffer(call, 1); !contract.buffer)
      return false;
    if (!llvm::isa<llvm::ConstantPointerNull>(call->getArgOperand(4))) {
      if (contract.target = getBuffer(call, 4); !contract.target)
        return false;
    } else if (*below < 1) {
      fail(call) << "expected an index to be below a number of at least 1, but "
                    "got "
                 << *below;
      return false;
    }
    for (const LeafField &field : pipeline.records[marker.record].fields)
      if (field.offset >= *offset && field.offset < *offset + *size)
        contract.fields.push_back(field.name);
    contracts.push_back({pipeline.contracts.size(), marker.record, call});
    pipeline.contracts.push_back(std::move(contract));
    return true;
  }

  /// Sources are known, and which buffers are allocated for them.
  bool checkContract(const ContractDescription &contract, unsigned record,
                     const llvm::CallInst *call) {
    if (contract.buffer) {
      const StateDescription &buffer = pipeline.state[*contract.buffer];
      if (buffer.perSource)
        fail(call) << "expected indices that the host binds, but '"
                   << buffer.name << "' is allocated for a source";
      return !buffer.perSource;
    }
    if (!checkSource(*contract.source, call))
      return false;
    unsigned taken =
        pipeline.stages[pipeline.sources[*contract.source].stage].input;
    if (taken != record)
      fail(call) << "expected a field of '" << pipeline.records[taken].name
                 << "', which source " << *contract.source
                 << " has, but got one of '" << pipeline.records[record].name
                 << "'";
    return taken == record;
  }

  bool checkSource(int64_t source, const llvm::CallInst *call) {
    int64_t sources = pipeline.sources.size();
    bool isOne = source >= 0 && source < sources;
    if (!isOne)
      fail(call) << "expected one of the " << sources
                 << " sources of pipeline '" << pipeline.name
                 << "', but got source " << source;
    return isOne;
  }

  bool checkGraph() {
    if (pipeline.sources.empty()) {
      mlir::emitError(pipeline.location)
          << "expected pipeline '" << pipeline.name << "' to have a source";
      return false;
    }
    for (auto [state, call] : allocations)
      if (!checkSource(*state->perSource, call))
        return false;
    for (auto [number, record, call] : contracts)
      if (!checkContract(pipeline.contracts[number], record, call))
        return false;
    bool ok = true;
    for (auto [index, stage] : llvm::enumerate(pipeline.stages))
      for (unsigned port = 0; port < stage.outputs.size(); ++port)
        if (llvm::none_of(pipeline.edges, [&](const EdgeDescription &edge) {
              return edge.producer == index && edge.port == port;
            })) {
          mlir::emitError(stage.location) << "port " << port << " of stage '"
                                          << stage.name << "' is not connected";
          ok = false;
        }
    return ok;
  }

  //===--------------------------------------------------------------------===//
  // Clear values
  //===--------------------------------------------------------------------===//

  bool readClear(unsigned index, StateDescription &state) {
    llvm::Function &function = getWrapper(WrapperKind::Clear, index);
    for (llvm::Instruction &instruction : llvm::instructions(function)) {
      auto *call = dyn_cast<llvm::CallInst>(&instruction);
      if (!call || !call->getCalledFunction() ||
          call->getCalledFunction()->getName() != accessor::clear)
        continue;
      for (llvm::Value *value : call->args()) {
        if (auto *number = dyn_cast<llvm::ConstantInt>(value))
          state.clear.push_back(number->getZExtValue());
        else if (auto *number = dyn_cast<llvm::ConstantFP>(value))
          state.clear.push_back(
              number->getValueAPF().bitcastToAPInt().getZExtValue());
        else if (llvm::isa<llvm::UndefValue>(value))
          state.clear.push_back(0);
        else {
          InFlightDiagnostic error = mlir::emitError(state.location);
          error << "expected the initial value of '" << state.name
                << "' to be known when the pipeline is compiled";
          if (state.whyUnknown)
            error.attachNote(state.whyUnknown->first)
                << state.whyUnknown->second;
          return false;
        }
      }
    }
    return true;
  }

  ParsedUnit &unit;
  PipelineDescription &pipeline;
  MemoryMap &memory;
  mlir::MLIRContext &context;
  std::vector<std::pair<StateDescription *, const llvm::CallInst *>>
      allocations;
  /// By number, with the record that the field is of.
  std::vector<std::tuple<size_t, unsigned, const llvm::CallInst *>> contracts;
};

} // namespace

bool piko::readWiring(ParsedUnit &unit, MemoryMap &memory,
                      mlir::MLIRContext &context) {
  return WiringReader(unit, memory, context).run();
}
