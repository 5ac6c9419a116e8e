// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tells LLVM which accesses of generated code never touch the same memory
// (TBAA). The tree of nodes:
//
//   piko
//     STATE.FIELD    each number of a piece of state by itself
//     dirty          which parts of private copies have changed
//     failure        what pikoir_fail keeps
//     runtime        what calls for emissions may touch
//       RECORD.FIELD   numbers of primitives, read or emitted
//       writer         pikoir_writer, its ports and its lists of buckets
//       input          pikoir_input and what it leads to, but for primitives
//
// An access may alias one with the same node, with a node above or with one
// below. What has no tag may alias everything.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_ALIASTAGS_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_ALIASTAGS_H

#include "mlir/Dialect/LLVMIR/LLVMDialect.h"

namespace piko {

class AliasTags {
public:
  explicit AliasTags(mlir::MLIRContext *context) : context(context) {}

  /// Of a field of a buffer or an image; of a constant, which nothing changes
  /// while a kernel runs.
  mlir::ArrayAttr state(mlir::StringRef name, mlir::StringRef field,
                        bool isConstant) const;
  mlir::ArrayAttr primitive(mlir::StringRef record,
                            mlir::StringRef field) const;
  /// Of what holds several fields of a record.
  mlir::ArrayAttr record() const;
  mlir::ArrayAttr dirty() const;
  mlir::ArrayAttr writer() const;
  mlir::ArrayAttr input() const;
  /// Of a call of the runtime; null where nothing is known about it.
  mlir::ArrayAttr call(mlir::StringRef function) const;

private:
  mlir::LLVM::TBAANodeAttr root() const;
  mlir::LLVM::TBAATypeDescriptorAttr
  node(const llvm::Twine &name, mlir::LLVM::TBAANodeAttr parent) const;
  mlir::LLVM::TBAATypeDescriptorAttr runtime() const;
  mlir::ArrayAttr tag(mlir::LLVM::TBAATypeDescriptorAttr node,
                      bool isConstant = false) const;

  mlir::MLIRContext *context;
};

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_ALIASTAGS_H
