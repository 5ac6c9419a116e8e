// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-infer-directives: writes down directives that hold without being said.
// BinIdentity proves them. Its inequalities (LinearFacts) are of loops and how
// their arguments change from iteration to iteration, of conditions on the way,
// minima and maxima, quotients, remainders, shifts and masks, of floats that
// are whole numbers, of truth values, and of how the producer's own bin was
// chosen, for the primitive or for each one of a list that it reads at an index
// in the list. Arithmetic that may wrap around proves nothing: of hi + 1 with
// any hi nothing is known, of min(hi, end - 1) + 1 all.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "Piko/Analysis/BinIdentity.h"
#include "Piko/Analysis/PhaseGraph.h"

namespace piko {
#define GEN_PASS_DEF_INFERDIRECTIVES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct InferDirectivesPass
    : piko::impl::InferDirectivesBase<InferDirectivesPass> {
  void runOnOperation() override;
};
} // namespace

void InferDirectivesPass::runOnOperation() {
  BinIdentity identity;
  SmallVector<AssignToOp> proved;
  for (auto stage : getOperation().getOps<StageOp>()) {
    AssignOp assign = stage.getAssign();
    if (!assign || !stage.getProcess() || hasSource(stage))
      continue;
    Operation *only = getOnlyAssignment(assign);
    if (isa_and_nonnull<AssignPreviousOp>(only))
      continue; // the user said so
    Refusal refusal;
    if (succeeded(identity.prove(stage, refusal))) {
      proved.push_back(cast<AssignToOp>(only));
      only->emitRemark() << "stage '" << getCppName(stage)
                         << "' keeps each primitive in the bin that it was "
                            "emitted from";
      continue;
    }
    InFlightDiagnostic remark = assign.emitRemark()
                                << "the bins of stage '" << getCppName(stage)
                                << "' are not known to be those before";
    remark.attachNote(refusal.at->getLoc()) << refusal.why;
  }
  // Only now, because the proofs use what the phases say.
  for (AssignToOp to : proved) {
    OpBuilder builder(to);
    AssignPreviousOp::create(builder, to.getLoc(), /*inferred=*/true);
    to.erase();
  }
}
