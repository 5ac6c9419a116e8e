//===- Remedies.cpp - What to write in place of a call of Piko's ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Clang says of a call that fits no overload what each overload expects. What
// the writer of a stage has to know is a rule of the language: a stage takes
// one type, ports are arguments, pixels are written by update and store. Each
// function here knows one such rule, by the words of Clang's error and note.
//
//===----------------------------------------------------------------------===//
#include "Clang/Remedies.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/Twine.h"

using namespace piko;

/// The type that stands in quotes at the beginning of a text, without const.
static llvm::StringRef takeType(llvm::StringRef &text) {
  if (!text.consume_front("'"))
    return "";
  auto [type, rest] = text.split("'");
  text = rest;
  type.consume_front("const ");
  return type;
}

/// The name of a function that a call with no fitting overload is of.
static llvm::StringRef getCalledName(llvm::StringRef error) {
  return error.consume_front("no matching member function for call to '")
             ? error.split('\'').first
             : "";
}

static std::string explainOtherType(llvm::StringRef taken, llvm::StringRef got,
                                    llvm::StringRef stage) {
  if (taken.empty() || got.empty() || taken == got)
    return "";
  return ("expected a '" + taken + "', which stage '" + stage +
          "' takes, but got a '" + got +
          "'; a stage takes one type: make two kinds one struct with a member "
          "that says which")
      .str();
}

/// A primitive that is assigned has another type than the stage takes.
static std::string explainAssignment(llvm::StringRef error,
                                     llvm::StringRef note,
                                     llvm::StringRef stage) {
  // Of one function Clang names the types in the error.
  llvm::StringRef types = error;
  if (note == "passing argument to parameter here" &&
      types.consume_front("reference to type ")) {
    llvm::StringRef taken = takeType(types);
    types = types.split("of type ").second;
    return explainOtherType(taken, takeType(types), stage);
  }
  if (note == "passing argument to parameter here" &&
      types.consume_front("no viable conversion from ")) {
    llvm::StringRef got = takeType(types);
    types = types.split(" to ").second;
    return explainOtherType(takeType(types), got, stage);
  }
  if (!getCalledName(error).starts_with("assignTo") ||
      !note.contains(" for 1st argument"))
    return "";
  types = note.split("no known conversion from ").second;
  llvm::StringRef got = takeType(types);
  types = types.split(" to ").second;
  return explainOtherType(takeType(types), got, stage);
}

/// emit<1>(value).
static std::string explainPort(llvm::StringRef error, llvm::StringRef note) {
  if (getCalledName(error) != "emit" ||
      !note.contains("explicitly-specified argument"))
    return "";
  return "expected the port as an argument: emit(value, port)";
}

/// state().image(p) = value, or an assignment to a part of that or of a
/// primitive.
static std::string explainConst(llvm::StringRef error, llvm::StringRef note) {
  bool isPixel = error.starts_with("cannot assign to return value because "
                                   "function 'operator()' returns a const") &&
                 note.contains("declared here");
  bool isMember = error.starts_with("no viable overloaded '") &&
                  note.contains("'this' argument has type 'const ");
  if (!isPixel && !isMember)
    return "";
  return "expected no assignment to what is const; an image is written by "
         "update(image, cell, f) or image.store(cell, value), and of a "
         "primitive a copy may be changed";
}

std::string piko::explainNote(llvm::StringRef error, llvm::StringRef note,
                              bool isInLanguage, llvm::StringRef stage) {
  if (!isInLanguage)
    return explainConst(error, note);
  for (std::string text : {explainAssignment(error, note, stage),
                           explainPort(error, note), explainConst(error, note)})
    if (!text.empty())
      return text;
  return "";
}

std::string piko::explainError(llvm::StringRef error) {
  constexpr llvm::StringRef allocating[] = {
      "deque",      "forward_list",  "function",      "list",  "map",
      "queue",      "set",           "shared_ptr",    "stack", "string",
      "unique_ptr", "unordered_map", "unordered_set", "vector"};
  if (!error.consume_front("no member named '") ||
      !error.contains("' in namespace 'std'"))
    return "";
  llvm::StringRef name = error.split('\'').first;
  if (!llvm::is_contained(allocating, name))
    return "";
  return ("not supported in Piko: 'std::" + name +
          "', which allocates; use an array of a fixed size, or a buffer of "
          "the state")
      .str();
}
