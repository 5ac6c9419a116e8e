//===- ClangDiagnostics.cpp - Clang's diagnostics as MLIR's ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "ClangDiagnostics.h"

#include "Wrappers.h"

#include "mlir/IR/BuiltinAttributes.h"
#include "clang/Basic/DiagnosticIDs.h"
#include "clang/Basic/DiagnosticSema.h"
#include "llvm/ADT/SmallString.h"

using namespace piko;

mlir::Location piko::convertLocation(clang::SourceLocation location,
                                     const clang::SourceManager &sources,
                                     mlir::MLIRContext &context) {
  clang::PresumedLoc presumed =
      location.isValid()
          ? sources.getPresumedLoc(sources.getExpansionLoc(location))
          : clang::PresumedLoc();
  if (presumed.isInvalid())
    return mlir::UnknownLoc::get(&context);
  return mlir::FileLineColLoc::get(&context, presumed.getFilename(),
                                   presumed.getLine(), presumed.getColumn());
}

void ClangDiagnosticForwarder::flush() {
  if (pending)
    context.getDiagEngine().emit(std::move(*pending));
  pending.reset();
}

/// What Piko says instead of what Clang says about constructs that Piko, not
/// the C++ dialect that it happens to ask Clang for, does not have.
static llvm::StringRef getReplacement(unsigned id) {
  switch (id) {
  case clang::diag::err_exceptions_disabled:
    return "not supported in Piko: exceptions";
  case clang::diag::err_no_dynamic_cast_with_fno_rtti:
  case clang::diag::err_no_typeid_with_fno_rtti:
    return "not supported in Piko: run-time type information";
  default:
    return "";
  }
}

/// How the phase is declared that a wrapper calls at a place; nothing
/// elsewhere.
static llvm::StringRef getPhase(const clang::Diagnostic &info) {
  if (!info.hasSourceManager() || !info.getLocation().isValid())
    return "";
  clang::SourceManager &sources = info.getSourceManager();
  auto [file, offset] = sources.getDecomposedExpansionLoc(info.getLocation());
  if (sources.getBufferOrFake(file).getBufferIdentifier() != wrappersName)
    return "";
  llvm::StringRef line =
      sources.getBufferData(file).substr(offset).split('\n').first;
  return line.split(wrapperComment).second;
}

void ClangDiagnosticForwarder::HandleDiagnostic(
    clang::DiagnosticsEngine::Level level, const clang::Diagnostic &info) {
  DiagnosticConsumer::HandleDiagnostic(level, info);
  if (level == clang::DiagnosticsEngine::Ignored ||
      level == clang::DiagnosticsEngine::Remark)
    return;
  llvm::SmallString<128> text(getReplacement(info.getID()));
  if (text.empty())
    info.FormatDiagnostic(text);
  mlir::Location location =
      info.hasSourceManager()
          ? convertLocation(info.getLocation(), info.getSourceManager(),
                            context)
          : mlir::UnknownLoc::get(&context);
  if (level == clang::DiagnosticsEngine::Note) {
    if (pending && !phase.empty()) {
      // The first note has the user's place.
      std::string error = pending->str();
      pending.emplace(location, pending->getSeverity());
      *pending << "expected " << phase;
      pending->attachNote(location) << error;
      phase.clear();
    } else if (pending) {
      pending->attachNote(location) << text.str();
    }
    return;
  }
  flush();
  pending.emplace(location, level == clang::DiagnosticsEngine::Warning
                                ? mlir::DiagnosticSeverity::Warning
                                : mlir::DiagnosticSeverity::Error);
  *pending << text.str();
  phase = getPhase(info);
}
