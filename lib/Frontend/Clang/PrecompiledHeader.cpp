// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko.h as Clang knows it when it has read it.

#include "Clang/PrecompiledHeader.h"

#include "Piko/Frontend/BufferTail.h"

#include "Clang/ClangInvocation.h"
#include "clang/Basic/LangOptions.h"
#include "clang/Frontend/CompilerInstance.h"
#include "clang/Frontend/FrontendActions.h"
#include "clang/Lex/Lexer.h"
#include "clang/Serialization/ASTWriter.h"
#include "clang/Tooling/Inclusions/StandardLibrary.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/Path.h"

using namespace piko;

static constexpr llvm::StringLiteral includerName = "<piko-header>";

/// All names that the preprocessor met, a line each, and an empty line.
static std::string listNames(const clang::IdentifierTable &table) {
  std::vector<llvm::StringRef> names;
  for (const auto &entry : table)
    if (!entry.getKey().empty())
      names.push_back(entry.getKey());
  llvm::sort(names);
  return "\n" + llvm::join(names, "\n") + "\n\n";
}

namespace {

/// Parses what comes, and keeps what the parser then knows.
class HeaderAction : public clang::ASTFrontendAction {
public:
  std::shared_ptr<clang::PCHBuffer> buffer =
      std::make_shared<clang::PCHBuffer>();
  std::string names;

private:
  clang::TranslationUnitKind getTranslationUnitKind() override {
    return clang::TU_Prefix;
  }
  std::unique_ptr<clang::ASTConsumer>
  CreateASTConsumer(clang::CompilerInstance &compiler,
                    llvm::StringRef) override {
    // The store knows by their text whether files have changed.
    return std::make_unique<clang::PCHGenerator>(
        compiler.getPreprocessor(), compiler.getModuleCache(), includerName,
        /*isysroot=*/"", buffer, compiler.getCodeGenOpts(),
        compiler.getFrontendOpts().ModuleFileExtensions,
        /*AllowASTWithErrors=*/false, /*IncludeTimestamps=*/false);
  }
  void EndSourceFileAction() override {
    names =
        listNames(getCompilerInstance().getPreprocessor().getIdentifierTable());
  }
};

} // namespace

/// Whether a directive includes a header of the C++ library. These mean the
/// same in any order.
static bool includesStandardHeader(llvm::StringRef line) {
  return line.consume_front("include") && (line = line.ltrim()).size() > 2 &&
         line.ends_with(">") && !line.ends_with(".h>") &&
         clang::tooling::stdlib::Header::named(line);
}

/// The line of the first directive, if nothing but comments, `#pragma once` and
/// headers of the C++ library are before it.
static llvm::StringRef getFirstDirective(llvm::StringRef text) {
  clang::LangOptions language;
  language.LineComment = true;
  std::string terminated = text.str();
  clang::Lexer lexer(clang::SourceLocation(), language, terminated.data(),
                     terminated.data(), terminated.data() + terminated.size());
  clang::Token token;
  lexer.LexFromRawLexer(token);
  if (token.isNot(clang::tok::hash))
    return "";
  llvm::StringRef rest =
      text.drop_front(lexer.getBufferLocation() - terminated.data());
  auto [line, after] = rest.split('\n');
  line = line.trim();
  return line == "pragma once" || includesStandardHeader(line)
             ? getFirstDirective(after)
             : line;
}

/// Whether piko.h is the first that the preprocessor sees, perhaps in a header
/// that lies beside the file, or whose whole path the file says.
static bool beginsWithHeader(llvm::StringRef path, llvm::vfs::FileSystem &files,
                             unsigned depth = 0) {
  auto text = files.getBufferForFile(path);
  if (!text || depth > 8)
    return false;
  llvm::StringRef name = getFirstDirective((*text)->getBuffer());
  if (!name.consume_front("include"))
    return false;
  name = name.ltrim();
  if (name == "<piko.h>")
    return true;
  if (!name.consume_front("\"") || !name.consume_back("\"") ||
      name.contains('"'))
    return false;
  llvm::SmallString<128> beside;
  if (llvm::sys::path::is_relative(name))
    beside = llvm::sys::path::parent_path(path);
  llvm::sys::path::append(beside, name);
  return beginsWithHeader(beside, files, depth + 1);
}

/// The names, and after them the header.
static std::optional<std::string> makeHeader(const FrontendOptions &options,
                                             const HeaderStore::Files &files,
                                             InvocationMaker invoke) {
  clang::IgnoringDiagConsumer ignored; // the file's own parse shows them
  clang::DiagnosticOptions diagnosticOptions;
  std::shared_ptr<clang::CompilerInvocation> invocation =
      invoke(options, clang::CompilerInstance::createDiagnostics(
                          *files, diagnosticOptions, &ignored,
                          /*ShouldOwnClient=*/false));
  if (!invocation)
    return std::nullopt;
  // Or each file instantiates anew what the header itself uses.
  clang::LangOptions &language = invocation->getLangOpts();
  language.PCHInstantiateTemplates = true;
  language.BuildingPCHWithObjectFile = language.ModulesCodegen;
  std::unique_ptr<llvm::MemoryBuffer> text =
      llvm::MemoryBuffer::getMemBuffer("#include <piko.h>\n", includerName);
  invocation->getFrontendOpts().Inputs = {clang::FrontendInputFile(
      text->getMemBufferRef(), clang::InputKind(clang::Language::CXX))};
  clang::CompilerInstance compiler(invocation);
  compiler.setVirtualFileSystem(files);
  compiler.setVerboseOutputStream(llvm::nulls());
  compiler.createDiagnostics(&ignored, /*ShouldOwnClient=*/false);
  HeaderAction action;
  if (!compiler.ExecuteAction(action) || !action.buffer->IsComplete)
    return std::nullopt;
  return action.names +
         std::string(action.buffer->Data.begin(), action.buffer->Data.end());
}

static bool isTold(llvm::StringRef define) {
  return getMacroName(define) == "PIKO_TUNED";
}

static bool isPikos(llvm::StringRef define) {
  return define.starts_with("PIKO_");
}

FrontendOptions piko::getHeaderOptions(const FrontendOptions &options) {
  FrontendOptions shared = options;
  llvm::erase_if(shared.defines, [](llvm::StringRef define) {
    return !isPikos(define) || isTold(define);
  });
  return shared;
}

static std::vector<std::string> getOthers(const FrontendOptions &options) {
  std::vector<std::string> others = options.defines;
  llvm::erase_if(others, isPikos);
  return others;
}

/// A header does not depend on macros whose names do not occur in it.
static bool mentions(llvm::StringRef names,
                     llvm::ArrayRef<std::string> defines) {
  return llvm::any_of(defines, [&](llvm::StringRef define) {
    return names.contains(("\n" + getMacroName(define) + "\n").str());
  });
}

std::string piko::getTextAfterHeader(const FrontendOptions &options) {
  if (!isTuned(options))
    return "";
  return "template <> inline constexpr const char "
         "*piko::detail::tunedText<void> = PIKO_TUNED;\n";
}

std::unique_ptr<llvm::MemoryBuffer>
piko::getPrecompiledHeader(llvm::StringRef file, const FrontendOptions &options,
                           llvm::ArrayRef<const char *> flags,
                           const HeaderStore::Files &files,
                           InvocationMaker invoke) {
  if (!options.headers || !beginsWithHeader(file, *files))
    return nullptr;
  FrontendOptions shared = getHeaderOptions(options);
  std::unique_ptr<llvm::MemoryBuffer> header =
      options.headers->get(getClangArguments(flags, shared), files,
                           [&](const HeaderStore::Files &recorded) {
                             return makeHeader(shared, recorded, invoke);
                           });
  if (!header)
    return nullptr;
  size_t end = header->getBuffer().find("\n\n") + 1;
  if (mentions(header->getBuffer().take_front(end), getOthers(options)))
    return nullptr;
  return dropFront(std::move(header), end + 1);
}
