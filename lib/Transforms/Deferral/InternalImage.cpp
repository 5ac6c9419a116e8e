// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Deferral/InternalImage.h"

#include "Support/UnusedName.h"

using namespace mlir;
using namespace piko;

/// A record of numbers, each at a multiple of its size.
static RecordOp createRecord(OpBuilder &builder, Location loc, StringRef name,
                             StringRef what, ArrayRef<Type> types) {
  SmallVector<Attribute> fields;
  int64_t size = 0, align = 1;
  for (auto [number, type] : llvm::enumerate(types)) {
    int64_t bytes = type.getIntOrFloatBitWidth() / 8;
    size = llvm::alignTo(size, bytes);
    std::string field = what.str();
    if (types.size() > 1)
      field += std::to_string(number);
    fields.push_back(
        FieldAttr::get(builder.getContext(), field, type, size, {}, {}));
    size += bytes;
    align = std::max(align, bytes);
  }
  return RecordOp::create(builder, loc, name, builder.getArrayAttr(fields),
                          llvm::alignTo(size, align), align);
}

/// Whether a record has these numbers and no others.
static bool hasTypes(RecordOp record, ArrayRef<Type> types) {
  return llvm::equal(record.getFields(), types, [](Attribute field, Type type) {
    return cast<FieldAttr>(field).getType() == type;
  });
}

ImageOp piko::createInternalImage(ImageOp image, StringRef what,
                                  ArrayRef<Type> types, ArrayAttr clear) {
  PipelineOp pipeline = getPipeline(image);
  auto module = pipeline->getParentOfType<ModuleOp>();
  Location loc = image.getLoc();
  OpBuilder builder(image->getContext());
  builder.setInsertionPointToStart(module.getBody());
  std::string stem = ("piko." + what).str(), record = stem;
  for (int i = 0;; ++i) {
    Operation *known = module.lookupSymbol(record);
    if (!known)
      createRecord(builder, loc, record, what, types);
    if (auto alike = dyn_cast_or_null<RecordOp>(known);
        !known || (alike && hasTypes(alike, types)))
      break;
    record = stem + std::to_string(i);
  }
  builder.setInsertionPointAfter(image);
  return ImageOp::create(
      builder, loc, getUnusedName(pipeline, image.getSymName() + "." + what),
      record, image.getRank(), clear, /*internal=*/true);
}
