// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-test-early: moves work under the test that decides whether it is
// needed.

#include "Support/StateAccess.h"

#include "Piko/Transforms/Passes.h"

namespace piko {
#define GEN_PASS_DEF_TESTEARLY
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct TestEarlyPass : piko::impl::TestEarlyBase<TestEarlyPass> {
  void runOnOperation() override;
};

/// Moves work in one process phase.
class Sinker {
public:
  explicit Sinker(ProcessOp process);
  int64_t run() { return sinkIn(process.getBody().front()); }

private:
  int64_t sinkIn(Block &block);
  bool isMovable(Operation *op);
  Region *getOnlyBranch(Operation *op);

  ProcessOp process;
  llvm::DenseSet<StringAttr> written; ///< State that the phase writes.
};

} // namespace

Sinker::Sinker(ProcessOp process)
    : process(process), written(getWrittenState(process)) {}

/// Whether an operation, with all that is in it, only computes: from its
/// operands, and from state that the phase leaves as it is.
bool Sinker::isMovable(Operation *op) {
  if (op->hasTrait<OpTrait::IsTerminator>() || op->getNumResults() == 0 ||
      isa<ParallelLoopOpInterface>(op))
    return false;
  return !op->walk([&](Operation *inner) {
              if (auto load = dyn_cast<LoadOp>(inner))
                return written.contains(load.getStateAttr().getAttr())
                           ? WalkResult::interrupt()
                           : WalkResult::advance();
              bool isFree =
                  isa<scf::IfOp, scf::IndexSwitchOp, scf::WhileOp, scf::ForOp>(
                      inner) ||
                  isMemoryEffectFree(inner);
              return isFree ? WalkResult::advance() : WalkResult::interrupt();
            }).wasInterrupted();
}

/// The one region of a later branch in which all uses are, or null.
Region *Sinker::getOnlyBranch(Operation *op) {
  Region *only = nullptr;
  for (Operation *user : op->getUsers()) {
    Operation *branch = op->getBlock()->findAncestorOpInBlock(*user);
    if (branch == user || !isa<scf::IfOp, scf::IndexSwitchOp>(branch))
      return nullptr;
    for (Region &region : branch->getRegions())
      if (region.isAncestor(user->getParentRegion())) {
        if (only && only != &region)
          return nullptr;
        only = &region;
      }
  }
  return only;
}

int64_t Sinker::sinkIn(Block &block) {
  int64_t moved = 0;
  // From the end, so that users have moved before what they use.
  for (Operation &op :
       llvm::make_early_inc_range(llvm::reverse(block.getOperations()))) {
    Region *branch = isMovable(&op) ? getOnlyBranch(&op) : nullptr;
    if (!branch)
      continue;
    op.moveBefore(&branch->front(), branch->front().begin());
    ++moved;
  }
  for (Operation &op : block)
    for (Region &region : op.getRegions())
      for (Block &inner : region)
        moved += sinkIn(inner);
  return moved;
}

void TestEarlyPass::runOnOperation() {
  getOperation().walk([&](ProcessOp process) {
    if (int64_t count = Sinker(process).run())
      process.emitRemark() << count
                           << " operations run only where they are needed";
  });
}
