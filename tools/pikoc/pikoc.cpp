// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The compiler's command: reads a pipeline from C++ or, at any level, from
// .mlir and writes an object with its header, any level on the way, or a
// report.

#include "Dependencies.h"
#include "Options.h"

#include "Piko/CommandLine/LLVMTool.h"
#include "Piko/CommandLine/Messages.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Inspect.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/InitLLVM.h"

#include <csignal>
#include <cstdio>

using namespace piko;
using pikoc::Emit;

static int fail(const std::string &message) {
  llvm::errs() << addToolName("pikoc", "error: " + message + "\n");
  return 1;
}

static std::string printPipes(const std::vector<std::string> &names) {
  std::string text;
  for (const std::string &name : names)
    text += name + "\n";
  return text;
}

static std::string printTunables(const std::vector<Tunable> &list) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  for (const Tunable &tunable : list) {
    if (tunable.line > 0)
      stream << tunable.file << ":" << tunable.line << ":" << tunable.column
             << ": ";
    stream << tunable.name << " = " << llvm::join(tunable.values, " | ")
           << "\n";
  }
  return text;
}

/// What there is a text of, and no object.
static TextKind getTextKind(const pikoc::Options &options) {
  if (options.explain)
    return TextKind::Report;
  static constexpr TextKind kinds[] = {TextKind::Authored, TextKind::Kernels,
                                       TextKind::Machine,  TextKind::Target,
                                       TextKind::LLVM,     TextKind::LLVMIR,
                                       TextKind::Assembly, TextKind::LLVMIR,
                                       TextKind::GPU,      TextKind::PTX};
  return kinds[static_cast<int>(options.getEmit())];
}

/// What a level looks like, the file's pipelines, or a report; nothing after an
/// error.
static std::optional<std::string> inspect(const pikoc::Options &options,
                                          const std::string &pipe,
                                          std::string &diagnostics) {
  if (options.listPipes) {
    auto names = listPipelines(options.getSource(pipe), diagnostics);
    return names ? std::optional(printPipes(*names)) : std::nullopt;
  }
  if (options.listTunables) {
    auto tunables =
        listTunables(options.getSource(pipe, /*isTuned=*/false), diagnostics);
    return tunables ? std::optional(printTunables(*tunables)) : std::nullopt;
  }
  return writeText({.source = options.getSource(pipe),
                    .kind = getTextKind(options),
                    .target = options.getTarget(pipe),
                    .remarks = options.remarks},
                   diagnostics);
}

/// The text that is asked for of one pipeline, or of the file; nothing after an
/// error.
static std::optional<std::string> writeAsked(const pikoc::Options &options,
                                             const std::string &pipe) {
  std::string diagnostics;
  std::optional<std::string> text;
  {
    Progress progress("compiling " + options.file);
    text = inspect(options, pipe, diagnostics);
  }
  llvm::errs() << addToolName("pikoc", diagnostics);
  return text;
}

/// The texts of all pipelines that are named; nothing after an error.
static std::optional<std::string> writeTexts(const pikoc::Options &options) {
  Emit emit = options.getEmit();
  bool isMLIR = !options.explain && emit != Emit::LLVMIR &&
                emit != Emit::Assembly && emit != Emit::PTX;
  std::string texts;
  for (const std::string &pipe : options.pipes) {
    std::optional<std::string> text = writeAsked(options, pipe);
    if (!text)
      return std::nullopt;
    if (!texts.empty())
      texts += isMLIR ? "\n// -----\n\n" : "\n";
    texts += *text;
  }
  return texts;
}

/// The object and what belongs to it; false after an error.
static bool writeObject(const pikoc::Options &options,
                        support::OutputFiles &outputs) {
  const std::string &pipe = options.pipes[0];
  ObjectOptions objectOptions{.source = options.getSource(pipe),
                              .target = options.getTarget(pipe),
                              .nameSpace = options.nameSpace,
                              .remarks = options.remarks};
  std::string diagnostics;
  if (options.setting.stripSize > 0)
    diagnostics = "warning: --tuned: the host sets strips of " +
                  std::to_string(options.setting.stripSize) + " primitives\n";
  std::optional<CompiledObject> object;
  {
    Progress progress("compiling " + options.file);
    object = compileObject(objectOptions, diagnostics);
  }
  llvm::errs() << addToolName("pikoc", diagnostics);
  if (!object)
    return false;
  if (!options.header.empty() && object->header.empty()) {
    fail("--header: expected the machine level or one above it, because below "
         "it nothing says what the pipeline takes");
    return false;
  }
  if (!options.tuned.empty())
    object->files.push_back(options.tuned);
  std::vector<std::string> targets = {options.output};
  auto done = outputs.add(options.output, object->code);
  if (done && !options.header.empty()) {
    targets.push_back(options.header);
    done = outputs.add(options.header, object->header);
  }
  if (done && !options.depfile.empty())
    done =
        outputs.add(options.depfile, writeDependencies(targets, object->files));
  if (!done)
    fail(done.error().message);
  return bool(done);
}

/// LLVM's own options, which are the process's; false after an error.
static bool setLLVMOptions(const std::vector<std::string> &options) {
  std::vector<const char *> words = {"pikoc"};
  for (const std::string &option : options)
    words.push_back(option.c_str());
  return words.size() == 1 || LLVMTool("pikoc").parseOptions(
                                  static_cast<int>(words.size()), words.data());
}

/// Returns the exit status.
static int compile(const std::vector<std::string> &words) {
  auto options = pikoc::parseOptions(words);
  if (!options)
    return fail(options.error().message);
  support::OutputFiles outputs;
  if (!options->help.empty()) {
    std::fputs(options->help.c_str(), stdout);
    auto done = support::finishOutput();
    return done ? 0 : fail(done.error().message);
  }
  if (!setLLVMOptions(options->llvm))
    return 1;
  if (options->getEmit() == Emit::Object && !options->isListing()) {
    if (!writeObject(*options, outputs))
      return 1;
  } else {
    std::optional<std::string> text = writeTexts(*options);
    if (!text)
      return 1;
    if (auto done = outputs.add(options->output, *text); !done)
      return fail(done.error().message);
  }
  if (auto done = outputs.keep(); !done)
    return fail(done.error().message);
  return 0;
}

int main(int argc, char **argv) {
  llvm::InitLLVM init(argc, argv);
  piko::support::reportOutOfMemory("pikoc");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  std::vector<std::string> words(argv + 1, argv + argc);
  return runMainOnDeepStack([&] { return compile(words); });
}
