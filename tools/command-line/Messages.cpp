//===- Messages.cpp - Whose message it is ---------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/Messages.h"

#include "Piko/CommandLine/Help.h"

#include <cctype>
#include <sstream>
#include <string_view>

std::string piko::addToolName(const std::string &tool,
                              const std::string &diagnostics) {
  std::string text;
  std::istringstream lines(diagnostics);
  for (std::string line; std::getline(lines, line); text += line + "\n") {
    constexpr std::string_view nowhere = "<unknown>:0: "; // as MLIR writes it
    if (line.starts_with(nowhere))
      line.erase(0, nowhere.size());
    for (const char *kind : {"error: ", "warning: ", "remark: "})
      if (line.starts_with(kind))
        text += tool + ": ";
  }
  return text;
}

/// Lower case, in one sentence without its end.
static std::string tidy(std::string text) {
  while (!text.empty() &&
         std::string_view(" .!").find(text.back()) != std::string_view::npos)
    text.pop_back();
  if (text.size() > 1 && !std::isupper(static_cast<unsigned char>(text[1])))
    text[0] = char(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string piko::rewordProblem(const std::string &tool,
                                const std::string &said,
                                const std::vector<std::string> &options) {
  std::string line = said.substr(0, said.find('\n'));
  if (line.starts_with(tool + ": "))
    line.erase(0, tool.size() + 2);
  constexpr std::string_view unknown = "Unknown command line argument '";
  if (line.starts_with(unknown)) {
    std::string word =
        line.substr(unknown.size(), line.find("'.") - unknown.size());
    std::string nearest = findNearest(word.substr(0, word.find('=')), options);
    return "unknown option '" + word + "'; " +
           (nearest.empty() ? "see --help" : "did you mean '" + nearest + "'?");
  }
  // "for the --a option: ...", "for the -a option: ..."
  constexpr std::string_view of = "for the ", option = " option: ";
  if (size_t end = line.find(option);
      line.starts_with(of) && end != std::string::npos)
    return line.substr(of.size(), end - of.size()) + ": " +
           tidy(line.substr(end + option.size()));
  return tidy(line);
}
