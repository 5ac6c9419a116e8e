// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Diagnostics as a user reads them.

#ifndef PIKO_DRIVER_DIAGNOSTICS_H
#define PIKO_DRIVER_DIAGNOSTICS_H

#include "mlir/IR/Diagnostics.h"
#include "llvm/Support/SourceMgr.h"

namespace piko {

/// Prints the diagnostics of a context while it lives, as Clang does: file,
/// line and column, the message, the line of text with a mark, notes below.
/// Remarks are printed only if asked for.
class DiagnosticPrinter : mlir::SourceMgrDiagnosticHandler {
public:
  DiagnosticPrinter(mlir::MLIRContext &context, llvm::raw_ostream &stream,
                    bool remarks = false)
      : SourceMgrDiagnosticHandler(sources, &context, stream) {
    setHandler([this, remarks](mlir::Diagnostic &diagnostic) {
      if (remarks ||
          diagnostic.getSeverity() != mlir::DiagnosticSeverity::Remark)
        emitDiagnostic(diagnostic);
    });
    context.printOpOnDiagnostic(false);
  }

  /// Lines of a file that is not on disk are shown from this.
  void addText(llvm::StringRef file, llvm::StringRef text) {
    sources.AddNewSourceBuffer(llvm::MemoryBuffer::getMemBufferCopy(text, file),
                               llvm::SMLoc());
  }

private:
  llvm::SourceMgr sources;
};

} // namespace piko

#endif // PIKO_DRIVER_DIAGNOSTICS_H
