//===- ClangDiagnostics.cpp - Clang's diagnostics as MLIR's ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Clang/ClangDiagnostics.h"

#include "Parse/PipeSearch.h"
#include "Parse/Wrappers.h"
#include "mlir/IR/BuiltinAttributes.h"
#include "Clang/Remedies.h"
#include "clang/Basic/DiagnosticIDs.h"
#include "clang/Basic/DiagnosticSema.h"
#include "clang/Sema/Sema.h"
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
  if (pending && !followsTunable)
    context.getDiagEngine().emit(std::move(*pending));
  pending.reset();
}

/// The stage whose text the parser is in; null if it is in another's.
static const clang::CXXRecordDecl *findStage(const clang::Sema &sema) {
  for (const clang::DeclContext *scope = sema.CurContext; scope;
       scope = scope->getParent())
    if (const auto *type = llvm::dyn_cast<clang::CXXRecordDecl>(scope))
      if (isStage(type))
        return type;
  return nullptr;
}

/// What Piko says where Clang only knows that there is no `state`.
static std::string explainState(unsigned id, llvm::StringRef text,
                                const clang::Sema *sema) {
  bool isUnknown = id == clang::diag::err_undeclared_var_use ||
                   id == clang::diag::err_undeclared_var_use_suggest;
  if (!isUnknown || !sema ||
      !text.starts_with("use of undeclared identifier 'state'"))
    return "";
  const clang::CXXRecordDecl *stage = findStage(*sema);
  if (!stage)
    return "";
  if (stage->hasAnyDependentBases())
    return "expected this->state() in a template, whose bases are not known";
  return "expected stage '" + stage->getNameAsString() +
         "' to derive from piko::Uses<State>, where State is the state of its "
         "pipeline, because it calls state()";
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

/// Whether a place is in what stands in Piko's headers for the language.
static bool isInLanguage(const clang::Diagnostic &info) {
  if (!info.hasSourceManager() || !info.getLocation().isValid())
    return false;
  const clang::SourceManager &sources = info.getSourceManager();
  llvm::StringRef file =
      sources.getFilename(sources.getExpansionLoc(info.getLocation()));
  return file.contains("/piko/compiled/") || file.ends_with("/piko/stage.h");
}

/// What a failed assertion in these headers says; empty for another error.
static std::string explainAssertion(const clang::Diagnostic &info,
                                    llvm::StringRef text) {
  if (info.getID() != clang::diag::err_static_assert_failed &&
      info.getID() != clang::diag::err_static_assert_requirement_failed)
    return "";
  return isInLanguage(info) ? text.split(": ").second.str() : "";
}

/// What the call of piko::tunable that a note names expected of PIKO_TUNED;
/// empty for another note.
static std::string explainTunable(llvm::StringRef note) {
  if (!note.consume_front("in call to 'tunable<"))
    return "";
  auto [name, values] = note.split("(&\"").second.split("\"[0], ");
  if (!values.consume_back(")'"))
    return "";
  if (name.empty() || name.find_first_of("=; \"\\") != name.npos)
    return ("expected a tunable's name to have no '=', ';', quote or space, "
            "but "
            "got '" +
            name + "'")
        .str();
  return ("PIKO_TUNED: expected one of " + values + " for tunable '" + name +
          "'")
      .str();
}

bool ClangDiagnosticForwarder::rewriteTunable(const clang::Diagnostic &info,
                                              llvm::StringRef note) {
  std::string better = pending ? explainTunable(note) : "";
  if (better.empty())
    return false;
  mlir::Location location =
      convertLocation(info.getLocation(), info.getSourceManager(), context);
  pending.reset();
  isExplained = true;
  if (!tunables.insert(better).second)
    return true;
  pending.emplace(location, mlir::DiagnosticSeverity::Error);
  *pending << better;
  followsTunable = false;
  return true;
}

bool ClangDiagnosticForwarder::rewriteError(const clang::Diagnostic &info,
                                            llvm::StringRef note) {
  const clang::CXXRecordDecl *stage =
      pending && sema && phase.empty() ? findStage(*sema) : nullptr;
  if (!stage)
    return false;
  std::string better = explainNote(pending->str(), note, isInLanguage(info),
                                   stage->getNameAsString());
  if (better.empty())
    return false;
  pending.emplace(pending->getLocation(), pending->getSeverity());
  *pending << better;
  return isExplained = true;
}

void ClangDiagnosticForwarder::HandleDiagnostic(
    clang::DiagnosticsEngine::Level level, const clang::Diagnostic &info) {
  DiagnosticConsumer::HandleDiagnostic(level, info);
  if (level == clang::DiagnosticsEngine::Ignored ||
      level == clang::DiagnosticsEngine::Remark)
    return;
  llvm::SmallString<128> text;
  info.FormatDiagnostic(text);
  if (level == clang::DiagnosticsEngine::Note && rewriteTunable(info, text))
    return;
  if (level != clang::DiagnosticsEngine::Note) {
    isExplained = isMisplaced = false;
  } else if (isMisplaced && pending && !isInLanguage(info)) {
    // The first note outside of the headers is at what the user wrote.
    std::string error = pending->str();
    pending.emplace(
        convertLocation(info.getLocation(), info.getSourceManager(), context),
        pending->getSeverity());
    *pending << error;
    isMisplaced = false;
    return;
  } else if (isExplained || rewriteError(info, text)) {
    return;
  }
  if (level == clang::DiagnosticsEngine::Error && sema && findStage(*sema))
    if (std::string better = explainError(text); !better.empty()) {
      text = better;
      isExplained = true;
    }
  if (std::string better = explainState(info.getID(), text, sema);
      !better.empty()) {
    text = better;
    isExplained = true;
  }
  if (std::string assertion = explainAssertion(info, text);
      !assertion.empty()) {
    text = assertion;
    isExplained = isMisplaced = true;
  }
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
  followsTunable =
      level >= clang::DiagnosticsEngine::Error && !tunables.empty();
  phase = getPhase(info);
}
