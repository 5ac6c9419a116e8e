// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-pre-schedule: a schedule that says the same of all bins becomes
// directives, which are known before there are bins.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"

namespace piko {
#define GEN_PASS_DEF_PRESCHEDULE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct PreSchedulePass : piko::impl::PreScheduleBase<PreSchedulePass> {
  void runOnOperation() override;
};

/// What a schedule says of a number, as far as it is known, and where it says
/// something that is not.
struct Said {
  std::optional<int64_t> value;
  Operation *unknown = nullptr;

  Said(int64_t value) : value(value) {}
  Said(Value said, Operation *at) : unknown(at) {
    APInt constant;
    if (!said || !matchPattern(said, m_ConstantInt(&constant)))
      return;
    value = constant.getSExtValue();
    unknown = nullptr;
  }

  /// Becomes what holds whether or not `branch` was taken.
  void join(const Said &other, Operation *branch) {
    if (!value || value == other.value)
      return;
    unknown = other.value ? branch : other.unknown;
    value = std::nullopt;
  }
};

/// What a schedule says of a bin; a tile split or a batch of 0 is none.
struct Directives {
  Said kind, tileSplit, batch, everyBin;

  explicit Directives(ScheduleOp schedule)
      : kind(int64_t(schedule.getKind())),
        tileSplit(schedule.getTileSplit().value_or(0)),
        batch(schedule.getBatch().value_or(0)),
        everyBin(schedule.getEveryBin()) {}

  void join(const Directives &other, Operation *branch) {
    kind.join(other.kind, branch);
    tileSplit.join(other.tileSplit, branch);
    batch.join(other.batch, branch);
    everyBin.join(other.everyBin, branch);
  }
};

} // namespace

/// Follows all ways through a block. A loop is a branch that is taken or not:
/// what its body says does not depend on what was said before.
static void follow(Block &block, Directives &said) {
  for (Operation &op : block) {
    if (auto set = dyn_cast<SetScheduleOp>(op)) {
      said.kind = Said(set.getKind(), set);
      said.tileSplit = Said(set.getTileSplit(), set);
    } else if (auto set = dyn_cast<SetBatchOp>(op)) {
      said.batch = Said(set.getSize(), set);
      // An error when the pipeline runs.
      if (said.batch.value && *said.batch.value < 1)
        said.batch = Said(Value(), set);
    } else if (isa<SetEveryBinOp>(op)) {
      said.everyBin = Said(1);
    } else {
      bool isExhaustive = isa<scf::IndexSwitchOp>(op) ||
                          (isa<scf::IfOp>(op) && !op.getRegion(1).empty());
      std::optional<Directives> after;
      if (!isExhaustive)
        after = said;
      for (Region &region : op.getRegions())
        for (Block &inner : region) {
          Directives branch = said;
          follow(inner, branch);
          if (after)
            after->join(branch, &op);
          else
            after = branch;
        }
      said = *after;
    }
  }
}

/// Where a schedule says something that is not known, or null.
static Operation *findUnknown(ScheduleOp schedule, const Directives &said) {
  for (const Said *number :
       {&said.kind, &said.tileSplit, &said.batch, &said.everyBin})
    if (!number->value)
      return number->unknown;
  bool isValid =
      symbolizeScheduleKind(*said.kind.value) && *said.tileSplit.value >= 0;
  return isValid ? nullptr : schedule.getOperation();
}

/// The core follows from the bin's number, or does not matter: no scheduler is
/// asked. Of `load_balance` piko-eliminate-schedules decides.
static void chooseCores(ScheduleOp schedule) {
  if (schedule.getKind() != ScheduleKind::LoadBalance)
    schedule.setResolved(true);
}

void PreSchedulePass::runOnOperation() {
  for (auto stage : getOperation().getOps<StageOp>()) {
    ScheduleOp schedule = stage.getSchedule();
    if (!schedule || schedule.getBody().empty()) {
      if (schedule)
        chooseCores(schedule);
      continue;
    }
    Directives said(schedule);
    follow(schedule.getBody().front(), said);
    if (Operation *unknown = findUnknown(schedule, said)) {
      InFlightDiagnostic remark = schedule.emitRemark()
                                  << "stage '" << getCppName(stage)
                                  << "' is scheduled bin by bin";
      remark.attachNote(unknown->getLoc())
          << "this may be another for another bin";
      continue;
    }
    auto kind = *symbolizeScheduleKind(*said.kind.value);
    schedule.setKind(kind);
    // Without `all` it has no effect.
    auto orNone = [](int64_t number) {
      return number ? std::optional<uint64_t>(number) : std::nullopt;
    };
    schedule.setTileSplit(
        orNone(kind == ScheduleKind::All ? *said.tileSplit.value : 0));
    schedule.setBatch(orNone(*said.batch.value));
    schedule.setEveryBin(*said.everyBin.value != 0);
    schedule.getBody().getBlocks().clear();
    chooseCores(schedule);
  }
}
