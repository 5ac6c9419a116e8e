// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Legal and different identifiers.

#include "Header/CppScope.h"

#include "llvm/ADT/StringExtras.h"

using namespace piko;
using llvm::StringRef;

static bool isKeyword(StringRef name) {
  static const llvm::StringSet<> keywords{
      "alignas",       "alignof",     "and",
      "and_eq",        "asm",         "auto",
      "bitand",        "bitor",       "bool",
      "break",         "case",        "catch",
      "char",          "char8_t",     "char16_t",
      "char32_t",      "class",       "compl",
      "concept",       "const",       "consteval",
      "constexpr",     "constinit",   "const_cast",
      "continue",      "co_await",    "co_return",
      "co_yield",      "decltype",    "default",
      "delete",        "do",          "double",
      "dynamic_cast",  "else",        "enum",
      "explicit",      "export",      "extern",
      "false",         "float",       "for",
      "friend",        "goto",        "if",
      "inline",        "int",         "long",
      "mutable",       "namespace",   "new",
      "noexcept",      "not",         "not_eq",
      "nullptr",       "operator",    "or",
      "or_eq",         "private",     "protected",
      "public",        "register",    "reinterpret_cast",
      "requires",      "return",      "short",
      "signed",        "sizeof",      "static",
      "static_assert", "static_cast", "struct",
      "switch",        "template",    "this",
      "thread_local",  "throw",       "true",
      "try",           "typedef",     "typeid",
      "typename",      "union",       "unsigned",
      "using",         "virtual",     "void",
      "volatile",      "wchar_t",     "while",
      "xor",           "xor_eq"};
  return keywords.contains(name);
}

bool piko::isCppIdentifier(StringRef name) {
  return !name.empty() && !llvm::isDigit(name[0]) && !isKeyword(name) &&
         llvm::all_of(name,
                      [](char c) { return llvm::isAlnum(c) || c == '_'; });
}

std::string piko::makeIdentifier(StringRef name) {
  std::string result;
  for (char c : name) {
    bool isPart = llvm::isAlnum(c) || c == '_';
    if (isPart)
      result += c;
    else if (!result.empty() && result.back() != '_')
      result += '_';
  }
  while (name.size() > 1 && !name.ends_with("_") &&
         StringRef(result).ends_with("_"))
    result.pop_back();
  if (result.empty() || llvm::isDigit(result[0]))
    result.insert(0, "_");
  return isKeyword(result) ? result + "_" : result;
}

std::string piko::getUnscopedName(StringRef name) {
  int depth = 0;
  size_t begin = 0;
  for (size_t i = 0; i < name.size(); ++i) {
    depth += name[i] == '<';
    depth -= name[i] == '>';
    if (depth == 0 && name.substr(i).starts_with("::"))
      begin = i + 2;
  }
  return makeIdentifier(name.substr(begin));
}

bool CppScope::isFree(StringRef name) const {
  return isCppIdentifier(name) && !names.contains(name);
}

std::string CppScope::declare(StringRef name) {
  std::string unique = name.str();
  for (int i = 2; !names.insert(unique).second; ++i)
    unique = (name + std::to_string(i)).str();
  return unique;
}
