//===- Wiring.cpp - What a pipeline's code says once ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Directives are read from simplified IR, where templates, `if constexpr` and
// helper functions are gone: a marker that is called unconditionally with
// constant arguments is a fact about the pipeline.
//
//===----------------------------------------------------------------------===//

#include "Import/Wiring.h"

#include "Parse/Wrappers.h"
#include "Support/Accessors.h"
#include "Support/CallChain.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/ADT/PostOrderIterator.h"
#include "llvm/Analysis/LoopInfo.h"
#include "llvm/Analysis/PostDominators.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::dyn_cast;
using mlir::InFlightDiagnostic;

namespace {

/// Tells which blocks run once, after and beside loops that fill members.
class Once {
public:
  explicit Once(llvm::Function &function)
      : entry(function.getEntryBlock()), begins(function), ends(function),
        loops(begins) {}

  bool contains(const llvm::BasicBlock *block) const {
    return ends.dominates(block, &entry) && !loops.getLoopFor(block);
  }

private:
  llvm::BasicBlock &entry;
  llvm::DominatorTree begins;
  llvm::PostDominatorTree ends;
  llvm::LoopInfo loops;
};

class WiringReader {
public:
  WiringReader(ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context)
      : unit(unit), pipeline(unit.pipeline), memory(memory), context(context) {}

  bool run() {
    if (!readGraph() || !checkGraph())
      return false;
    for (auto [index, stage] : llvm::enumerate(pipeline.stages))
      if (stage.hasSchedule && !readSchedule(index, stage))
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
        diagnostic.attachNote(edge.location) << "it is connected here";
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
          << "stage '" << to.name << "' is declared here";
      return false;
    }
    pipeline.edges.push_back({*producer, static_cast<unsigned>(*port),
                              *consumer, getUserLocation(call, unit, context)});
    return true;
  }

  bool readAllocation(const llvm::CallInst *call) {
    const StateDescription *state = memory.getState(call->getArgOperand(0));
    std::optional<int64_t> source =
        getConstant(call, 1, "the source of a buffer");
    if (!source)
      return false;
    if (!state) {
      fail(call) << "expected a buffer of the pipeline's state";
      return false;
    }
    StateDescription &ours = pipeline.state[state - pipeline.state.data()];
    ours.perSource = source;
    allocations.push_back({&ours, call});
    return true;
  }

  bool checkGraph() {
    if (pipeline.sources.empty()) {
      mlir::emitError(pipeline.location)
          << "expected pipeline '" << pipeline.name << "' to have a source";
      return false;
    }
    int64_t sources = pipeline.sources.size();
    for (auto [state, call] : allocations)
      if (*state->perSource < 0 || *state->perSource >= sources) {
        fail(call) << "expected one of the " << sources
                   << " sources of pipeline '" << pipeline.name
                   << "', but got source " << *state->perSource;
        return false;
      }
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
  // Schedules
  //===--------------------------------------------------------------------===//

  struct Said {
    const llvm::CallInst *call;
    const Marker *marker;
    const Directive *directive;
    bool mayDiffer() const { return directive->varies != Directive::Stage; }
  };

  bool readSchedule(unsigned index, StageDescription &stage) {
    llvm::Function &function = getWrapper(WrapperKind::Schedule, index);
    llvm::SmallVector<Said> directives;
    for (llvm::Instruction &instruction : llvm::instructions(function)) {
      auto *call = dyn_cast<llvm::CallInst>(&instruction);
      if (!call)
        continue;
      const Marker *marker = getMarker(call, unit.markers);
      if (!marker && isEffect(call->getCalledFunction()->getName()))
        return failPhase(call, stage);
      if (marker && !classify(call, *marker, stage, directives))
        return false;
    }
    Once once(function);
    ScheduleDescription &schedule = stage.schedule;
    for (const Said &said : directives)
      schedule.isDynamic |= said.mayDiffer() && !isConstant(said.call, once);
    for (const Said &said : directives) {
      if (said.mayDiffer() && schedule.isDynamic)
        continue; // It stays in the phase's code.
      if (!said.mayDiffer() && !once.contains(said.call->getParent())) {
        fail(said.call)
            << "expected " << said.directive->said
            << " for every bin, because it may not depend on the bin";
        return false;
      }
      if (!readDirective(said.call, *said.marker, schedule))
        return false;
    }
    // It is accepted, and has no effect.
    if (schedule.getPolicy() != SchedulePolicy::All)
      schedule.tileSplit = 0;
    return true;
  }

  /// Whether an accessor changes something.
  static bool isEffect(llvm::StringRef name) {
    return name == accessor::emit || name == accessor::updateBegin ||
           name == accessor::reduceBegin || name == accessor::scanBegin ||
           name.starts_with(accessor::store) ||
           name.starts_with(accessor::atomic) ||
           name.starts_with(accessor::atomicFetch);
  }
  static bool isConstant(const llvm::CallInst *call, const Once &once) {
    return once.contains(call->getParent()) &&
           llvm::all_of(call->args(), [](const llvm::Value *argument) {
             return llvm::isa<llvm::ConstantInt>(argument);
           });
  }
  bool failPhase(const llvm::CallInst *call, const StageDescription &stage) {
    fail(call) << "expected only directives in the schedule phase of stage '"
               << stage.name << "'";
    return false;
  }

  /// Collects directives and reports what is none; false after an error.
  bool classify(const llvm::CallInst *call, const Marker &marker,
                const StageDescription &stage,
                llvm::SmallVectorImpl<Said> &directives) {
    if (const Directive *directive = getDirective(marker.kind)) {
      directives.push_back({call, &marker, directive});
      if (stage.takesList || directive->varies != Directive::ListBin)
        return true;
      fail(call) << "expected " << directive->said
                 << " in a stage whose process takes a list, but that of "
                    "stage '"
                 << stage.name << "' does not";
      return false;
    }
    if (getAssignment(marker.kind))
      return failPhase(call, stage);
    switch (marker.kind) {
    case MarkerKind::loopMore:
    case MarkerKind::sync:
    case MarkerKind::sort:
      return failPhase(call, stage);
    default:
      return true;
    }
  }

  /// A directive that is the same for all bins; false after an error.
  bool readDirective(const llvm::CallInst *call, const Marker &marker,
                     ScheduleDescription &schedule) {
    auto constant = [&](unsigned operand) {
      return llvm::cast<llvm::ConstantInt>(call->getArgOperand(operand))
          ->getSExtValue();
    };
    std::optional<int64_t> number;
    switch (marker.kind) {
    case MarkerKind::schedule:
      schedule.policy = static_cast<SchedulePolicy>(constant(0));
      schedule.tileSplit = constant(1);
      if (schedule.tileSplit >= 0)
        return true;
      fail(call) << "expected a tile split of at least 0, but got "
                 << schedule.tileSplit;
      return false;
    case MarkerKind::endStage:
      if (marker.stages.empty()) {
        fail(call) << "expected endStage of a stage of pipeline '"
                   << pipeline.name << "'";
        return false;
      }
      for (unsigned other : marker.stages)
        if (!llvm::is_contained(schedule.endStage, other))
          schedule.endStage.push_back(other);
      return true;
    case MarkerKind::endBin:
      schedule.endBin = true;
      return true;
    case MarkerKind::batch:
      schedule.batch = constant(0);
      if (schedule.batch >= 1)
        return true;
      fail(call) << "expected a batch of at least 1, but got "
                 << schedule.batch;
      return false;
    case MarkerKind::everyBin:
      schedule.everyBin = true;
      return true;
    case MarkerKind::lanes:
      schedule.lanes = getConstant(call, 0, "what lanes are given");
      schedule.lanesLocation = getUserLocation(call, unit, context);
      if (!schedule.lanes || (*schedule.lanes >= 0 && *schedule.lanes <= 3))
        return schedule.lanes.has_value();
      fail(call) << "expected a value of piko::Lanes, but got "
                 << *schedule.lanes;
      return false;
    case MarkerKind::precision:
      if (!(number = getConstant(call, 0, "a precision")))
        return false;
      schedule.precision = *number;
      if (*number >= 0 && *number <= 2)
        return true;
      fail(call) << "expected a value of piko::Precision, but got " << *number;
      return false;
    default:
      if (!(number = getConstant(call, 0, "an order")))
        return false;
      schedule.unordered = *number != 0;
      return true;
    }
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
};

} // namespace

bool piko::readWiring(ParsedUnit &unit, MemoryMap &memory,
                      mlir::MLIRContext &context) {
  return WiringReader(unit, memory, context).run();
}
