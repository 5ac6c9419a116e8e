// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The members of a pipeline's state in a header.

#include "Header/StateMembers.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/FormatVariadic.h"

#include <optional>

using namespace piko;
using llvm::StringRef;

namespace {

/// A piece, or what holds some: an array, whose parts have no names, or a
/// class.
struct Part {
  std::string name;
  const StatePiece *piece = nullptr;
  bool isArray = false;
  std::vector<Part> parts = {};
};

} // namespace

/// `.name` or `[number]` before a path; nothing if it begins otherwise.
static std::optional<std::string> takeStep(StringRef &path) {
  bool isIndex = path.consume_front("[");
  if (!isIndex && !path.consume_front("."))
    return std::nullopt;
  StringRef step = path.take_until(
      [&](char c) { return isIndex ? c == ']' : c == '.' || c == '['; });
  path = path.drop_front(step.size());
  bool isGood = isIndex ? path.consume_front("]") && !step.empty() &&
                              llvm::all_of(step, llvm::isDigit)
                        : isCppIdentifier(step);
  if (!isGood)
    return std::nullopt;
  return (isIndex ? "[" : "") + step.str();
}

/// Puts a piece below a part; false if something else is there.
static bool insert(Part &part, StringRef path, const StatePiece &piece) {
  if (path.empty()) {
    bool isFree = !part.piece && part.parts.empty();
    part.piece = &piece;
    return isFree;
  }
  std::optional<std::string> step = takeStep(path);
  if (!step || part.piece)
    return false;
  bool isIndex = StringRef(*step).starts_with("[");
  if (!part.parts.empty() && part.isArray != isIndex)
    return false;
  part.isArray = isIndex;
  std::string name = isIndex ? step->substr(1) : *step;
  auto found = llvm::find_if(
      part.parts, [&](const Part &other) { return other.name == name; });
  if (found != part.parts.end())
    return insert(*found, path, piece);
  // The elements of an array come one after the other.
  if (isIndex && name != std::to_string(part.parts.size()))
    return false;
  part.parts.push_back({name});
  return insert(part.parts.back(), path, piece);
}

/// Whether the elements of each array are of one type.
static bool areAlike(const Part &a, const Part &b) {
  if (a.piece || b.piece)
    return a.piece && b.piece && a.piece->type == b.piece->type;
  return a.isArray == b.isArray && a.parts.size() == b.parts.size() &&
         llvm::all_of_zip(a.parts, b.parts, [&](const Part &x, const Part &y) {
           return (a.isArray || x.name == y.name) && areAlike(x, y);
         });
}

static bool hasAlikeElements(const Part &part) {
  return llvm::all_of(part.parts, [&](const Part &inner) {
    return (!part.isArray || areAlike(inner, part.parts.front())) &&
           hasAlikeElements(inner);
  });
}

/// "type name[2]" of a part; `classes` gets what must be defined before it.
static std::string declare(const Part &part, StringRef name, CppScope &scope,
                           std::string &classes) {
  std::string dimensions;
  const Part *element = &part;
  for (; !element->piece && element->isArray; element = &element->parts.front())
    dimensions += "[" + std::to_string(element->parts.size()) + "]";
  std::string type;
  if (element->piece) {
    type = element->piece->type;
  } else {
    std::string members, title = name.str();
    title[0] = llvm::toUpper(title[0]);
    for (const Part &member : element->parts)
      members +=
          "      " + declare(member, member.name, scope, classes) + ";\n";
    type = scope.declare(title + "Parts");
    classes += "    struct " + type + " {\n" + members + "    };\n";
  }
  return type + " " + name.str() + dimensions;
}

static std::string initialize(const Part &part) {
  if (part.piece)
    return llvm::formatv("{0}(in(\"{1}\"))", part.piece->type,
                         part.piece->name);
  std::string list;
  for (const Part &inner : part.parts)
    list += (list.empty() ? "" : ", ") + initialize(inner);
  return "{" + list + "}";
}

/// The member that all pieces of one first name make, if they make one. A
/// constant is a member of the state itself, which hands it over.
static std::optional<Part> makePart(llvm::ArrayRef<const StatePiece *> pieces,
                                    StringRef name) {
  Part part{name.str()};
  for (const StatePiece *piece : pieces)
    if (piece->isConstant ||
        !insert(part, StringRef(piece->name).drop_front(name.size()), *piece))
      return std::nullopt;
  return hasAlikeElements(part) ? std::optional(part) : std::nullopt;
}

static StateMemberText makeMember(const StatePiece &piece, CppScope &scope) {
  std::string name = scope.declare(makeIdentifier(piece.name));
  return {name, "    " + piece.type + " " + name + ";\n",
          llvm::formatv("(in(\"{0}\"))", piece.name), piece.isConstant};
}

std::vector<StateMemberText>
piko::makeStateMembers(const std::vector<StatePiece> &pieces, CppScope &scope) {
  std::vector<StateMemberText> members;
  for (size_t begin = 0, end; begin < pieces.size(); begin = end) {
    StringRef name = StringRef(pieces[begin].name).take_until([](char c) {
      return c == '.' || c == '[';
    });
    std::vector<const StatePiece *> group;
    for (end = begin; end < pieces.size(); ++end) {
      StringRef other = pieces[end].name;
      if (!other.consume_front(name) ||
          (!other.empty() && other[0] != '.' && other[0] != '['))
        break;
      group.push_back(&pieces[end]);
    }
    bool isPath = name.size() < pieces[begin].name.size();
    std::optional<Part> part;
    if (isPath && isCppIdentifier(name) && scope.isFree(name))
      part = makePart(group, name);
    if (!part) {
      for (const StatePiece *piece : group)
        members.push_back(makeMember(*piece, scope));
      continue;
    }
    scope.reserve(name);
    std::string classes, declaration = declare(*part, name, scope, classes);
    members.push_back({name.str(), classes + "    " + declaration + ";\n",
                       initialize(*part), false});
  }
  return members;
}
