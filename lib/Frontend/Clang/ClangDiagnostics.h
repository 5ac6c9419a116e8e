//===- ClangDiagnostics.h - Clang's diagnostics as MLIR's -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_CLANGDIAGNOSTICS_H
#define PIKO_LIB_FRONTEND_PARSE_CLANGDIAGNOSTICS_H

#include "mlir/IR/Diagnostics.h"
#include "clang/Basic/Diagnostic.h"
#include "clang/Basic/SourceManager.h"

#include <optional>
#include <set>
#include <string>

namespace clang {
class Sema;
} // namespace clang

namespace piko {

/// The place in the user's text that a Clang location stands for.
mlir::Location convertLocation(clang::SourceLocation location,
                               const clang::SourceManager &sources,
                               mlir::MLIRContext &context);

/// Forwards what Clang reports to the diagnostic engine of a context; notes
/// are attached to what they explain.
class ClangDiagnosticForwarder : public clang::DiagnosticConsumer {
public:
  explicit ClangDiagnosticForwarder(mlir::MLIRContext &context)
      : context(context) {}
  ~ClangDiagnosticForwarder() override { flush(); }

  void HandleDiagnostic(clang::DiagnosticsEngine::Level level,
                        const clang::Diagnostic &info) override;
  /// Where the parser is says what a name that it does not know is about.
  void setSema(const clang::Sema *parser) { sema = parser; }
  /// Reports the diagnostic that was waiting for its notes.
  void flush();

private:
  /// Where a note is about a tunable that has no such value, puts our text in
  /// the place of the error, once.
  bool rewriteTunable(const clang::Diagnostic &info, llvm::StringRef note);
  /// Where a note says which rule of the language an error in a stage's text is
  /// about, puts our text in the place of the error.
  bool rewriteError(const clang::Diagnostic &info, llvm::StringRef note);

  mlir::MLIRContext &context;
  const clang::Sema *sema = nullptr;
  std::optional<mlir::Diagnostic> pending;
  /// Whether that has a text of ours, to which Clang's notes do not belong.
  bool isExplained = false;
  /// Whether that is about a call in the user's text, which a note will name.
  bool isMisplaced = false;
  /// The texts of ours about tunables, each of which Clang may have several
  /// errors for.
  std::set<std::string> tunables;
  /// Whether the diagnostic may follow from that, so that it is not said.
  bool followsTunable = false;
  /// If it is about a wrapper's call of a phase: how the phase is declared.
  std::string phase;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_CLANGDIAGNOSTICS_H
