// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records as C++ types.

#ifndef PIKO_LIB_DRIVER_RECORDWRITER_H
#define PIKO_LIB_DRIVER_RECORDWRITER_H

#include "Header/CppScope.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include <map>
#include <set>
#include <string>

namespace piko {

/// Gives records C++ types: those of the source where piko.cpp_types names
/// them, else structs of plain numbers. Where no C++ struct has members at the
/// places of a record, it holds bytes.
class RecordWriter {
public:
  /// Defines what is needed in a class with these names.
  explicit RecordWriter(CppScope &scope) : scope(scope) {}

  /// The type of a record. `use` names one that has no name of its own.
  std::string getType(RecordOp record, const std::string &use);

  /// The structs and enumerations that these types need, and static assertions
  /// of their layout.
  const std::string &getDefinitions() const { return definitions; }
  /// The headers that they need.
  const std::set<std::string> &getIncludes() const { return includes; }

private:
  class Layouter;
  using Offsets = std::vector<std::pair<std::string, int64_t>>;

  /// Each gives the name in the header.
  std::string defineStruct(llvm::StringRef cppName, const std::string &use,
                           const std::string &body, int64_t size, int64_t align,
                           const Offsets &members);
  std::string defineEnum(const CppType &type, const std::string &use);
  void useGlm(llvm::StringRef name, const GlmType &type, int64_t size,
              const Offsets &members);

  CppScope &scope;
  std::string definitions;
  std::set<std::string> includes;
  std::map<mlir::Operation *, std::string> types;
  /// By the source's name and the text, which hand-written modules may give
  /// several of.
  std::map<std::pair<std::string, std::string>, std::string> defined;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_RECORDWRITER_H
