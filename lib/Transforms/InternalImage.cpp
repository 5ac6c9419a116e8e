// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "InternalImage.h"

using namespace mlir;
using namespace piko;

ImageOp piko::createInternalImage(ImageOp image, StringRef what,
                                  IntegerType type, ArrayAttr clear) {
  PipelineOp pipeline = getPipeline(image);
  auto module = pipeline->getParentOfType<ModuleOp>();
  Location loc = image.getLoc();
  std::string recordName = ("piko." + what).str();
  OpBuilder builder(image->getContext());
  if (!module.lookupSymbol(recordName)) {
    builder.setInsertionPointToStart(module.getBody());
    int64_t bytes = type.getWidth() / 8;
    auto field = FieldAttr::get(builder.getContext(), what, type, 0, {}, {});
    RecordOp::create(builder, loc, recordName, builder.getArrayAttr({field}),
                     bytes, bytes);
  }
  builder.setInsertionPointAfter(image);
  std::string stem = (image.getSymName() + "." + what).str(), name = stem;
  for (int i = 0; SymbolTable::lookupSymbolIn(pipeline, name); ++i)
    name = stem + std::to_string(i);
  return ImageOp::create(builder, loc, name, recordName, image.getRank(), clear,
                         /*internal=*/true);
}
