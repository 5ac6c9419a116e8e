// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Analysis/PhaseGraph.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

SmallVector<EdgeOp> piko::getEdgesInto(StageOp stage) {
  return llvm::to_vector(llvm::make_filter_range(
      getPipeline(stage).getOps<EdgeOp>(),
      [&](EdgeOp edge) { return edge.getConsumer() == stage.getSymName(); }));
}

SmallVector<EdgeOp> piko::getEdgesFrom(StageOp stage) {
  return llvm::to_vector(llvm::make_filter_range(
      getPipeline(stage).getOps<EdgeOp>(),
      [&](EdgeOp edge) { return edge.getProducer() == stage.getSymName(); }));
}

bool piko::hasSource(StageOp stage) {
  return llvm::any_of(
      getPipeline(stage).getOps<SourceOp>(),
      [&](SourceOp source) { return source.getStage() == stage.getSymName(); });
}

SmallVector<EmissionOpInterface> piko::getEmits(StageOp stage, int64_t port) {
  SmallVector<EmissionOpInterface> emits;
  stage.walk([&](EmissionOpInterface emit) {
    if (emit.getPort() == port)
      emits.push_back(emit);
  });
  return emits;
}

EmitOp piko::asEmit(EmissionOpInterface emission) {
  if (auto emit = dyn_cast<EmitOp>(*emission))
    return emit;
  OpBuilder builder(emission);
  Value prim = emission.getPrim();
  auto emit =
      EmitOp::create(builder, emission.getLoc(), prim ? prim.getType() : Type(),
                     emission.getPort(), emission.getNumbers());
  if (prim)
    prim.replaceAllUsesWith(emit.getPrim());
  emission.erase();
  return emit;
}

int64_t piko::getElementIndex(RecordOp record, StringRef name) {
  int64_t place = 0;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    if (field.getName() == name)
      return place;
    place += field.getElementCount();
  }
  llvm_unreachable("the verifier knows the field");
}

void piko::noteOrigin(Operation *op, StageOp stage, bool inAssign) {
  auto name = StringAttr::get(stage.getContext(), getCppName(stage));
  llvm::TypeSwitch<Operation *>(op)
      .Case<LoadOp>([&](LoadOp load) {
        // Reading a constant does not fail.
        if (load.getOf() || load.getIndices().empty())
          return;
        load.setOfAttr(name);
        load.setAssign(inAssign);
      })
      .Case<DivideOp>([&](DivideOp divide) {
        if (divide.getOf())
          return;
        divide.setOfAttr(name);
        divide.setAssign(inAssign);
      })
      .Case<StoreOp, AtomicOp, UpdateOp>([&](auto access) {
        if (!access.getOf())
          access.setOfAttr(name);
      });
}
