//===- Conflicts.cpp - Stores that are bound to conflict ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/Conflicts.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/DenseMap.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

namespace {

/// What a value follows from.
struct Sources {
  bool item = false;      ///< The primitive, or the list.
  bool iteration = false; ///< One of a parallel loop.
  bool unknown = false;   ///< Who knows.

  void add(const Sources &other) {
    item |= other.item;
    iteration |= other.iteration;
    unknown |= other.unknown;
  }
  /// The same for all calls and all iterations.
  bool isFixed() const { return !item && !iteration && !unknown; }
};

class ConflictFinder {
public:
  explicit ConflictFinder(StageOp stage) : stage(stage) {}

  void warn(ProcessOp process) {
    process.walk([&](StoreOp store) {
      if (isConflict(store, process))
        report(store);
    });
  }

private:
  const Sources &findSources(Value value);
  Sources findSourcesAnew(Value value);
  bool isConflict(StoreOp store, ProcessOp process);
  bool changesItself(StoreOp store);
  void report(StoreOp store);

  StageOp stage;
  llvm::DenseMap<Value, Sources> known;
};

} // namespace

const Sources &ConflictFinder::findSources(Value value) {
  auto [found, isNew] = known.try_emplace(value, Sources{.unknown = true});
  if (!isNew)
    return found->second;
  Sources sources = findSourcesAnew(value);
  return known[value] = sources;
}

/// Whether nobody in the pipeline changes a piece of state.
static bool isReadOnly(PipelineOp pipeline, StringRef state) {
  if (isa_and_nonnull<ImageOp>(SymbolTable::lookupSymbolIn(pipeline, state)))
    return false;
  return !pipeline
              .walk([&](Operation *op) {
                auto access = op->getAttrOfType<FlatSymbolRefAttr>("state");
                bool isOther =
                    !access || access.getValue() != state || isa<LoadOp>(op);
                return isOther ? WalkResult::advance()
                               : WalkResult::interrupt();
              })
              .wasInterrupted();
}

Sources ConflictFinder::findSourcesAnew(Value value) {
  if (auto argument = dyn_cast<BlockArgument>(value)) {
    Operation *owner = argument.getOwner()->getParentOp();
    if (isa<ProcessOp>(owner))
      return {.item = true};
    if (isa<ParallelLoopOpInterface>(owner))
      return {.iteration = true};
    auto loop = dyn_cast<scf::ForOp>(owner);
    if (!loop || argument != loop.getInductionVar())
      return {.unknown = true};
    Sources sources = findSources(loop.getLowerBound());
    sources.add(findSources(loop.getUpperBound()));
    sources.add(findSources(loop.getStep()));
    return sources;
  }
  Operation *op = value.getDefiningOp();
  Sources sources;
  auto load = dyn_cast<LoadOp>(op);
  bool isPlain =
      load ? isReadOnly(stage->getParentOfType<PipelineOp>(), load.getState())
           : isPure(op) && !isa<BinOp, BinAtOp>(op);
  sources.unknown = op->getNumRegions() > 0 || !isPlain;
  for (Value operand : op->getOperands())
    sources.add(findSources(operand));
  return sources;
}

/// Whether it is made in each call, and in each iteration.
static bool isUnconditional(StoreOp store, ProcessOp process) {
  for (Operation *op = store->getParentOp(); op != process;
       op = op->getParentOp())
    if (!isa<ParallelLoopOpInterface, scf::ForOp>(op))
      return false;
  return true;
}

bool ConflictFinder::isConflict(StoreOp store, ProcessOp process) {
  if (!isUnconditional(store, process))
    return false;
  for (Value index : store.getIndices())
    if (!findSources(index).isFixed())
      return false;
  for (Value element : store.getElements())
    if (!findSources(element).isFixed())
      return false;
  // One call for a bin may be all that there is.
  const Sources &stored = findSources(store.getValue());
  bool inLoop = store->getParentOfType<ParallelLoopOpInterface>() != nullptr;
  return (stored.item && !stage.getTakesList()) ||
         (stored.iteration && inLoop) ||
         ((inLoop || !stage.getTakesList()) && changesItself(store));
}

static bool isSame(OperandRange a, OperandRange b) {
  return llvm::equal(a, b, [](Value one, Value other) {
    Attribute constant, same;
    return one == other ||
           (matchPattern(one, m_Constant(&constant)) &&
            matchPattern(other, m_Constant(&same)) && constant == same);
  });
}

/// Whether what is stored follows from what the element was before.
bool ConflictFinder::changesItself(StoreOp store) {
  llvm::SetVector<Value> values;
  values.insert(store.getValue());
  for (size_t i = 0; i < values.size(); ++i) {
    Operation *op = values[i].getDefiningOp();
    if (!op)
      continue;
    auto load = dyn_cast<LoadOp>(op);
    if (load && load.getStateAttr() == store.getStateAttr() &&
        load.getField() == store.getField() &&
        isSame(load.getIndices(), store.getIndices()) &&
        isSame(load.getElements(), store.getElements()))
      return true;
    values.insert(op->operand_begin(), op->operand_end());
  }
  return false;
}

void ConflictFinder::report(StoreOp store) {
  bool inLoop = findSources(store.getValue()).iteration;
  InFlightDiagnostic warning = emitWarning(store.getLoc());
  warning << "a data race: each " << (inLoop ? "iteration" : "primitive")
          << " writes this element of '" << store.getState()
          << "', and which one is last is not defined";
  warning.attachNote()
      << "let each write an element of its own, or use an integer atomic such "
         "as piko::atomicAdd, or an update of a pixel";
}

void piko::warnAboutConflicts(ModuleOp module) {
  for (auto pipeline : module.getOps<PipelineOp>())
    for (auto stage : pipeline.getOps<StageOp>()) {
      ScheduleOp schedule = stage.getSchedule();
      bool isSerial = schedule && schedule.getKind() == ScheduleKind::Serialize;
      if (ProcessOp process = stage.getProcess(); process && !isSerial)
        ConflictFinder(stage).warn(process);
    }
}
