// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ProgramSymbol.h"

#include <cstdio>

/// Letters, digits and '_' stay; "::" and all else become '_', with the code of
/// what is rare.
static std::string mangle(std::string_view name) {
  std::string result;
  for (size_t i = 0; i < name.size(); ++i) {
    char c = name[i];
    bool isLetter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (name.substr(i, 2) == "::") {
      result += '_';
      ++i;
    } else if (isLetter || (c >= '0' && c <= '9') || c == '_') {
      result += c;
    } else {
      char code[8];
      std::snprintf(code, sizeof code, "_%X_",
                    unsigned(static_cast<unsigned char>(c)));
      result += code;
    }
  }
  return result;
}

std::string piko::getProgramSymbol(std::string_view nameSpace,
                                   std::string_view pipeline) {
  std::string prefix = nameSpace.empty() ? "" : mangle(nameSpace) + "_";
  return prefix + mangle(pipeline) + "_program";
}
