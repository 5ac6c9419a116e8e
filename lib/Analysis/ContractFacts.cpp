// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ContractFacts.cpp - Numbers of the host's that are indices ---------===//
//
// What the runtime has tested before a kernel runs (piko.contract) holds of
// each number that a phase reads. A read that fails gives 0 and the phase goes
// on: so an index may be 0 where the buffer that it is of has no element, and
// the runtime sees to it that such a buffer can be read there.
//
//===----------------------------------------------------------------------===//

#include "Piko/Analysis/LinearFacts.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Dialect/Piko/IR/PikoFixed.h"

#include "mlir/IR/Matchers.h"
#include "llvm/ADT/DenseSet.h"
#include "llvm/ADT/TypeSwitch.h"

#include <set>

using namespace mlir;
using namespace piko;

/// In checking mode kernels test what hosts have promised.
static bool keepsTests(PipelineOp pipeline) {
  return !pipeline.getOps<CheckRecordOp>().empty();
}

Linear BinFacts::getRoom(StringRef state, int64_t dim) {
  bool isIndexed = llvm::any_of(
      core.pipeline.getOps<ContractOp>(),
      [&](ContractOp contract) { return contract.getTarget() == state; });
  if (!isIndexed || keepsTests(core.pipeline))
    return getExtent(state, dim);
  auto [found, isNew] = rooms.try_emplace(state.str());
  if (isNew) {
    Linear size = getExtent(state, dim);
    found->second = core.system.addVariable();
    LinearFact &known = core.system.getFacts();
    known.addBetween(size, found->second, size + Linear(1));
    known.addAtLeastZero(found->second - Linear(1));
  }
  return found->second;
}

bool BinFacts::isFed(Value prim, unsigned frame) {
  const LinearFacts::Scope &at = core.frames[frame];
  if (frame != 0)
    return prim == at.primitive && at.same && isFed(at.same, 0);
  auto assign = core.at->getParentOfType<AssignOp>();
  return isItem(prim, frame) ||
         (assign && prim == assign.getBody().getArgument(0));
}

/// Whether two contracts say the same of their numbers.
static bool areAlike(ContractOp a, ContractOp b) {
  return a.getTarget() == b.getTarget() && a.getBelow() == b.getBelow() &&
         a.getHasNoSign() == b.getHasNoSign();
}

namespace {

/// Finds where numbers are what a contract says.
class ContractFinder {
public:
  explicit ContractFinder(ContractOp terms)
      : terms(terms), pipeline(getPipeline(terms)) {}

  /// Of a number in a phase of a stage, and whether a value there is a
  /// primitive that has reached it.
  bool holds(Value number, StageOp stage,
             llvm::function_ref<bool(Value)> isFed);

private:
  bool hasContract(llvm::function_ref<bool(ContractOp)> isAbout);
  /// Of the element of a buffer.
  bool holds(LoadOp load);
  /// Of a field, whatever reaches the stage.
  bool holds(StageOp stage, StringRef field);
  bool holdsEmitted(StageOp stage, StringRef field);
  bool holds(const APInt &constant);

  ContractOp terms;
  PipelineOp pipeline;
  // What is looked at: what holds of all that a number may come from, but for
  // itself, holds of it.
  std::set<std::pair<Operation *, std::string>> fields;
  llvm::DenseSet<Value> numbers;
};

} // namespace

bool ContractFinder::hasContract(llvm::function_ref<bool(ContractOp)> isAbout) {
  return llvm::any_of(pipeline.getOps<ContractOp>(), [&](ContractOp other) {
    return areAlike(other, terms) && isAbout(other);
  });
}

bool ContractFinder::holds(LoadOp load) {
  return hasContract([&](ContractOp contract) {
    return contract.getBuffer() == load.getState() &&
           contract.getField() == load.getField();
  });
}

bool ContractFinder::holds(StageOp stage, StringRef field) {
  if (!fields.emplace(stage, field).second)
    return true;
  for (auto [index, source] : llvm::enumerate(pipeline.getOps<SourceOp>())) {
    auto number = int64_t(index);
    auto isAbout = [&](ContractOp contract) {
      return contract.getSource() == number && contract.getField() == field;
    };
    if (source.getStage() == stage.getSymName() && !hasContract(isAbout))
      return false;
  }
  return holdsEmitted(stage, field);
}

/// Whether a value is the primitive that a Process is called with.
static bool isProcessed(Value prim) {
  auto argument = dyn_cast<BlockArgument>(prim);
  return argument && isa<ProcessOp>(argument.getOwner()->getParentOp());
}

bool ContractFinder::holdsEmitted(StageOp stage, StringRef field) {
  RecordOp record = lookupRecord(stage, stage.getInputAttr());
  int64_t first = 0, count = 0;
  for (auto other : record.getFields().getAsRange<FieldAttr>()) {
    count = other.getElementCount();
    if (other.getName() == field)
      break;
    first += count;
  }
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    if (edge.getConsumer() != stage.getSymName())
      continue;
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    WalkResult isOther = producer.walk([&](EmissionOpInterface emit) {
      if (emit.getPort() != edge.getPort())
        return WalkResult::advance();
      SmallVector<Value> emitted = emit.getNumbers();
      for (Value number : ArrayRef(emitted).slice(first, count))
        if (!holds(number, producer, isProcessed))
          return WalkResult::interrupt();
      return WalkResult::advance();
    });
    if (isOther.wasInterrupted())
      return false;
  }
  return true;
}

/// In a buffer that may be empty there is room for one element.
bool ContractFinder::holds(const APInt &constant) {
  return terms.getBelow()
             ? !constant.isNegative() &&
                   constant.getSExtValue() < int64_t(*terms.getBelow())
             : constant.isZero();
}

/// What gives a result, or an argument of a loop; empty if that is not known.
static SmallVector<Value> findOrigins(Value value) {
  auto getYielded = [](Block &block, unsigned i) {
    return block.getTerminator()->getOperand(i);
  };
  if (auto result = dyn_cast<OpResult>(value)) {
    unsigned i = result.getResultNumber();
    return llvm::TypeSwitch<Operation *, SmallVector<Value>>(result.getOwner())
        .Case([&](arith::SelectOp select) {
          return SmallVector<Value>{select.getTrueValue(),
                                    select.getFalseValue()};
        })
        .Case([&](scf::IfOp choice) {
          return SmallVector<Value>{getYielded(*choice.thenBlock(), i),
                                    getYielded(*choice.elseBlock(), i)};
        })
        .Case([&](scf::WhileOp loop) {
          return SmallVector<Value>{loop.getConditionOp().getArgs()[i]};
        })
        .Case([&](scf::ForOp loop) {
          return SmallVector<Value>{loop.getInitArgs()[i],
                                    getYielded(*loop.getBody(), i)};
        })
        .Default([](Operation *) { return SmallVector<Value>(); });
  }
  auto argument = cast<BlockArgument>(value);
  unsigned i = argument.getArgNumber();
  Operation *parent = argument.getOwner()->getParentOp();
  if (auto loop = dyn_cast<scf::ForOp>(parent)) {
    if (i == 0)
      return {};
    return {loop.getInitArgs()[i - 1], getYielded(*loop.getBody(), i - 1)};
  }
  auto loop = dyn_cast<scf::WhileOp>(parent);
  if (!loop)
    return {};
  if (argument.getOwner() == loop.getAfterBody())
    return {loop.getConditionOp().getArgs()[i]};
  return {loop.getInits()[i], getYielded(*loop.getAfterBody(), i)};
}

/// The number that a conversion widens, by its sign if it has one; else null.
static Value findNarrow(Operation *op, bool hasNoSign) {
  bool widens = isa<arith::ExtUIOp, arith::IndexCastUIOp>(op) ||
                (!hasNoSign && isa<arith::ExtSIOp, arith::IndexCastOp>(op));
  if (!widens || op->getOperand(0).getType().isIndex())
    return {};
  return op->getOperand(0);
}

bool ContractFinder::holds(Value number, StageOp stage,
                           llvm::function_ref<bool(Value)> isFed) {
  if (!numbers.insert(number).second)
    return true;
  APInt constant;
  if (matchPattern(number, m_ConstantInt(&constant)))
    return holds(constant);
  Operation *op = number.getDefiningOp();
  if (auto load = dyn_cast_or_null<LoadOp>(op))
    return holds(load);
  if (auto get = dyn_cast_or_null<GetOp>(op))
    return isFed(get.getPrim()) && holds(stage, get.getField());
  if (Value narrow = op ? findNarrow(op, terms.getHasNoSign()) : Value())
    return holds(narrow, stage, isFed);
  SmallVector<Value> origins = findOrigins(number);
  return !origins.empty() && llvm::all_of(origins, [&](Value origin) {
    return holds(origin, stage, isFed);
  });
}

void BinFacts::assumeContract(Value value, unsigned frame, const Linear &number,
                              bool isWidened) {
  if (keepsTests(core.pipeline))
    return;
  SmallVector<ContractOp> known;
  auto isFed = [&](Value prim) { return this->isFed(prim, frame); };
  for (auto contract : core.pipeline.getOps<ContractOp>()) {
    auto isAlike = [&](ContractOp other) { return areAlike(contract, other); };
    if (llvm::any_of(known, isAlike))
      continue;
    known.push_back(contract);
    if (ContractFinder(contract).holds(value, core.stage, isFed))
      assumeBelow(contract, value.getType(), number, isWidened);
  }
}

void BinFacts::assumeBelow(ContractOp contract, Type type, const Linear &number,
                           bool isWidened) {
  Linear limit = contract.getBelow() ? Linear(*contract.getBelow())
                                     : getRoom(*contract.getTarget(), 0);
  // A number without a sign may be negative as it is here.
  constexpr unsigned widest = 64; // which no limit needs
  unsigned width = type.isIndex() ? widest : type.getIntOrFloatBitWidth();
  bool isNegative = contract.getHasNoSign() && !isWidened && width < widest &&
                    (!contract.getBelow() ||
                     int64_t(*contract.getBelow()) > int64_t(1) << (width - 1));
  if (!isNegative)
    core.facts->addBetween(Linear(0), number, limit - Linear(1));
}
