// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What make and ninja are told of the files that were read.

#include "Dependencies.h"

using namespace llvm;
using namespace piko;

/// A name as make and ninja read it.
static std::string quote(StringRef name) {
  std::string quoted;
  for (char c : name) {
    if (c == ' ' || c == '#')
      quoted += '\\';
    if (c == '$')
      quoted += '$';
    quoted += c;
  }
  return quoted;
}

std::string piko::writeDependencies(ArrayRef<std::string> targets,
                                    ArrayRef<std::string> files) {
  std::string text;
  for (const std::string &target : targets)
    text += (text.empty() ? "" : " ") + quote(target);
  text += ":";
  for (const std::string &file : files)
    text += " \\\n  " + quote(file);
  return text + "\n";
}
