// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The members of a pipeline's state in a header, of which some are arrays or
// classes of images and buffers: those have names such as `layers[1].color`.

#ifndef PIKO_LIB_DRIVER_STATEMEMBERS_H
#define PIKO_LIB_DRIVER_STATEMEMBERS_H

#include "Header/CppScope.h"

#include "llvm/ADT/StringRef.h"

#include <string>
#include <vector>

namespace piko {

/// A piece of state: the name that the pipeline has for it, and its C++ type.
struct StatePiece {
  std::string name, type;
  bool isConstant = false;
};

/// A member of the class.
struct StateMemberText {
  std::string name;
  std::string declaration;
  /// What is in its parentheses or braces in the constructor's list, for a
  /// piko::rt::Member `in`.
  std::string initializer;
  bool isConstant = false;
};

/// In the order in which the pieces come. Pieces whose names make no arrays and
/// classes, as those of the dialect's text may, become members one by one.
std::vector<StateMemberText>
makeStateMembers(const std::vector<StatePiece> &pieces, CppScope &scope);

} // namespace piko

#endif // PIKO_LIB_DRIVER_STATEMEMBERS_H
