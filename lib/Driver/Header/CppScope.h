// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Legal and different identifiers.

#ifndef PIKO_LIB_DRIVER_CPPSCOPE_H
#define PIKO_LIB_DRIVER_CPPSCOPE_H

#include "llvm/ADT/StringSet.h"

#include <string>

namespace piko {

bool isCppIdentifier(llvm::StringRef name);

/// Letters, digits and '_' stay; what lies between becomes one '_'. A keyword
/// gets one after it.
std::string makeIdentifier(llvm::StringRef name);

/// The last name of a C++ path, as an identifier: `Pair_int` of
/// `ns::Pair<int>`.
std::string getUnscopedName(llvm::StringRef name);

/// The names of a scope.
class CppScope {
public:
  /// Takes a name that is not for others.
  void reserve(llvm::StringRef name) { names.insert(name); }
  /// Whether it is an identifier that nobody has taken.
  bool isFree(llvm::StringRef name) const;
  /// Takes an identifier, with a number after it if it is taken.
  std::string declare(llvm::StringRef name);

private:
  llvm::StringSet<> names;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_CPPSCOPE_H
