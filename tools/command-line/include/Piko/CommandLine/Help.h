//===- Help.h - What tools say of themselves --------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A tool's options as a table, from which come `--help`, which fits a screen,
// `--help-all`, the manual page, and what shells complete: the last two by
// utils/make-manuals.py, which reads the table as JSON, `--help-json`.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMMANDLINE_HELP_H
#define PIKO_COMMANDLINE_HELP_H

#include <string>
#include <vector>

namespace piko {

/// A word that an option takes.
struct Choice {
  std::string word, description;
};

struct OptionHelp {
  std::vector<std::string> names = {}; ///< as written; an argument has its own
  std::string value = {};       ///< as it is shown; behind "[=" if optional
  std::string description = {}; ///< without names and values
  std::string brief = {}; ///< one line for --help; none: only --help-all has it
  std::string group = {}; ///< the heading
  std::vector<Choice> choices = {};
  bool takesValue = false, isPositional = false;
};

struct ToolHelp {
  std::string usage; ///< lines, each of which begins with the tool's name
  std::string description, example;
  std::vector<OptionHelp> options = {};
  /// LLVM reads the options; --help-all prints what else there is its way.
  bool isLLVMs = false;

  std::string getName() const { return usage.substr(0, usage.find(' ')); }
};

/// Options with a brief description; all if none has one.
std::string printShortHelp(const ToolHelp &tool);
std::string printLongHelp(const ToolHelp &tool);
std::string printHelpAsJson(const ToolHelp &tool);
/// "NAME VERSION".
std::string printVersion(const std::string &name);

/// For tools whose options LLVM reads, in whose table all have a brief
/// description: answers what asks for help or the version, and returns whether
/// it did. --help-all becomes LLVM's --help.
bool answerHelp(const ToolHelp &tool, int argc, char **argv);

/// The one of `names` that was probably meant; empty if none is near.
std::string findNearest(const std::string &word,
                        const std::vector<std::string> &names);

} // namespace piko

#endif // PIKO_COMMANDLINE_HELP_H
