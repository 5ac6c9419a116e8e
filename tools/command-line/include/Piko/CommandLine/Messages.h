//===- Messages.h - Whose message it is -------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A message begins with where it is: a place in a file, or else the tool.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMMANDLINE_MESSAGES_H
#define PIKO_COMMANDLINE_MESSAGES_H

#include <string>
#include <vector>

namespace piko {

/// Of diagnostics that name no place, the lines get the tool's name: "error:
/// ..." becomes "pikoc: error: ...". The last line is ended.
std::string addToolName(const std::string &tool,
                        const std::string &diagnostics);

/// What LLVM's command line says of words that it does not take, as tools say
/// it: "TOOL: Unknown command line argument '--a'.  Try: 'TOOL --help'" becomes
/// "unknown option '--a'; did you mean '--b'?". `options` are all that there
/// are, with dashes.
std::string rewordProblem(const std::string &tool, const std::string &said,
                          const std::vector<std::string> &options);

} // namespace piko

#endif // PIKO_COMMANDLINE_MESSAGES_H
