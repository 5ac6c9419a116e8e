// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How Clang is called on a pipeline's C++.

#include "Clang/ClangInvocation.h"

#include "clang/Driver/CreateInvocationFromArgs.h"
#include "llvm/ADT/StringExtras.h"

using namespace piko;

std::vector<std::string>
piko::getClangArguments(llvm::ArrayRef<const char *> flags,
                        const FrontendOptions &options) {
  std::vector<std::string> arguments = {
      "clang++",
      "-std=c++20",
      "-fsyntax-only",
      "-Wno-stack-exhausted", // there is a gibibyte
      "-xc++",
      "-ffp-contract=off",
      "-resource-dir",
      options.resourceDir.empty() ? PIKO_CLANG_RESOURCE_DIR
                                  : options.resourceDir};
  std::string runtime = options.runtimeIncludeDir.empty()
                            ? PIKO_RUNTIME_INCLUDE_DIR
                            : options.runtimeIncludeDir;
  // That one is searched anyway, and after the headers of C++, which include
  // the next one of a name; as -isystem it would come before them.
  if (runtime != "/usr/include")
    arguments.insert(arguments.end(), {"-isystem", runtime});
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  for (const std::string &directory : options.includeDirs)
    arguments.push_back("-I" + directory);
  for (const std::string &macro : options.defines)
    arguments.push_back("-D" + macro);
  return arguments;
}

llvm::StringRef piko::getMacroName(llvm::StringRef define) {
  return define.split('=').first.split('(').first;
}

bool piko::isTuned(const FrontendOptions &options) {
  return llvm::any_of(options.defines, [](llvm::StringRef define) {
    return getMacroName(define) == "PIKO_TUNED";
  });
}

llvm::SmallVector<TunedMacro> piko::readTunedMacro(llvm::StringRef define) {
  llvm::SmallVector<TunedMacro> settings;
  if (getMacroName(define) != "PIKO_TUNED")
    return settings;
  llvm::StringRef text = define.split('=').second.trim('"');
  for (llvm::StringRef part : llvm::split(text, ';'))
    if (auto [name, value] = part.split('='); !name.empty())
      settings.push_back({name, value});
  return settings;
}

std::shared_ptr<clang::CompilerInvocation> piko::createClangInvocation(
    llvm::ArrayRef<const char *> flags, const FrontendOptions &options,
    llvm::StringRef mainName,
    llvm::IntrusiveRefCntPtr<clang::DiagnosticsEngine> diagnostics) {
  std::vector<std::string> arguments = getClangArguments(flags, options);
  arguments.push_back(mainName.str());
  std::vector<const char *> argv;
  for (const std::string &argument : arguments)
    argv.push_back(argument.c_str());
  clang::CreateInvocationOptions createOptions;
  createOptions.Diags = diagnostics;
  std::shared_ptr<clang::CompilerInvocation> invocation =
      clang::createInvocation(argv, createOptions);
  // It points to the first argument, which ends here.
  if (invocation)
    invocation->getCodeGenOpts().Argv0 = "clang";
  return invocation;
}
