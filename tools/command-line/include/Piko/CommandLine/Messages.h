//===- Messages.h - Whose message it is -------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A message begins with where it is: a place in a file, or else the tool.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMMANDLINE_MESSAGES_H
#define PIKO_COMMANDLINE_MESSAGES_H

#include <string>

namespace piko {

/// Of diagnostics that name no place, the lines get the tool's name: "error:
/// ..." becomes "pikoc: error: ...". The last line is ended.
std::string addToolName(const std::string &tool,
                        const std::string &diagnostics);

} // namespace piko

#endif // PIKO_COMMANDLINE_MESSAGES_H
