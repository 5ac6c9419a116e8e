//===- Messages.cpp - Whose message it is ---------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/Messages.h"

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
