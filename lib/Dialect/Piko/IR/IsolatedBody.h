// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Bodies that have names of their own: one does not see those of another, even
// before it is known where a value is defined.

#ifndef PIKO_LIB_DIALECT_PIKO_IR_ISOLATEDBODY_H
#define PIKO_LIB_DIALECT_PIKO_IR_ISOLATEDBODY_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

inline mlir::ParseResult parseIsolatedBody(mlir::OpAsmParser &parser,
                                           mlir::Region &body) {
  if (parser.parseRegion(body, /*arguments=*/{}, /*enableNameShadowing=*/true))
    return mlir::failure();
  if (body.empty())
    body.emplaceBlock();
  return mlir::success();
}

inline void printIsolatedBody(mlir::OpAsmPrinter &printer, mlir::Operation *,
                              mlir::Region &body) {
  printer.printRegion(body);
}

/// The same, where a piko.return at the end need not be said.
inline mlir::ParseResult parsePhaseBody(mlir::OpAsmParser &parser,
                                        mlir::Region &body) {
  mlir::Location loc = parser.getEncodedSourceLoc(parser.getNameLoc());
  if (parser.parseRegion(body, /*arguments=*/{}, /*enableNameShadowing=*/true))
    return mlir::failure();
  ProcessOp::ensureTerminator(body, parser.getBuilder(), loc);
  return mlir::success();
}

inline void printPhaseBody(mlir::OpAsmPrinter &printer, mlir::Operation *,
                           mlir::Region &body) {
  mlir::Operation *end = body.front().getTerminator();
  printer.printRegion(body, /*printEntryBlockArgs=*/true,
                      /*printBlockTerminators=*/!end->getAttrs().empty());
}

} // namespace piko

#endif // PIKO_LIB_DIALECT_PIKO_IR_ISOLATEDBODY_H
