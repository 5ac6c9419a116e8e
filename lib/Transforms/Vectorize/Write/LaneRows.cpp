// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reads of rows with ends: where an index is clamped to an image, or wraps
// around in it, most vectors are in its middle, and read one element after the
// other.

#include "Vectorize/Write/LaneMemory.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

/// Sums wrap around alike in the test and in the index: no lane that is active
/// has an index out of bounds.
void LaneMemory::writeLimited(LoadOp load, Value limited) {
  Value number = get(limited);
  auto type = cast<VectorType>(number.getType());
  Value steps = vector::StepOp::create(builder, loc,
                                       getVectorType(builder.getIndexType()));
  if (!type.getElementType().isIndex())
    steps = arith::IndexCastOp::create(builder, loc, type, steps);
  Value first = vector::ExtractOp::create(builder, loc, number, 0);
  Value row = arith::AddIOp::create(builder, loc, splat(first), steps);
  Value differ = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                       number, row);
  auto choice =
      scf::IfOp::create(builder, loc, getVectorType(load.getType()),
                        any(both(active, differ)), /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  auto read = [&](Block *block, bool isRow) {
    builder.setInsertionPointToStart(block);
    SmallVector<Value> places = getPlaces(load.getIndices()), elements;
    if (isRow)
      for (Value &place : places)
        if (isa<VectorType>(place.getType()))
          place = vector::ExtractOp::create(builder, loc, place, 0);
    for (Value element : load.getElements())
      elements.push_back(getUniform(element));
    Value values = GatherOp::create(builder, loc, getVectorType(load.getType()),
                                    load.getStateAttr(), places,
                                    load.getFieldAttr(), elements, active,
                                    isRow ? builder.getUnitAttr() : UnitAttr());
    scf::YieldOp::create(builder, loc, values);
  };
  read(choice.thenBlock(), /*isRow=*/false);
  read(choice.elseBlock(), /*isRow=*/true);
  vectors.map(load.getResult(), choice.getResult(0));
}
