// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records as C++ types.
//
// A record lists its numbers by their paths: `lights.color.x` is four floats,
// 32 bytes apart. Paths that begin alike become a member that is a class. Which
// dimensions of an array belong to which member on the path is said by
// piko.cpp_types; where it is not, they go to the innermost where the bytes
// come out right.

#include "Header/RecordWriter.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/FormatVariadic.h"
#include "llvm/Support/MathExtras.h"

#include <optional>

using namespace piko;
using llvm::ArrayRef;
using llvm::StringRef;

namespace {

struct Leaf {
  llvm::SmallVector<StringRef, 4> path; ///< What is left of it.
  mlir::Type type;
  int64_t offset;
  llvm::SmallVector<int64_t, 2> counts, strides; ///< What is left of them.

  int64_t getElementSize() const { return type.getIntOrFloatBitWidth() / 8; }
};

/// The members of a struct, laid out as a C++ compiler does.
struct Layout {
  std::string text = {}, lastType = {};
  int64_t size = 0, align = 1;
  std::vector<std::pair<std::string, int64_t>> members = {};
};

/// A type without its place. A struct that has no name is its own text.
struct MemberType {
  std::string name;
  int64_t size, align;
  llvm::SmallVector<int64_t, 2> extents = {};
  StringRef tag = ""; ///< Of a type that the header defines.

  bool isPlain() const { return extents.empty() && name.back() != '}'; }
};

} // namespace

/// Members of the class, and of structs in it.
static const char *const classIndent = "  ";
static const char *const structIndent = "    ";

static StringRef getStorageType(mlir::Type type) {
  switch (type.getIntOrFloatBitWidth()) {
  case 8:
    return "int8_t";
  case 16:
    return "int16_t";
  case 32:
    return type.isF32() ? "float" : "int32_t";
  default:
    return type.isF64() ? "double" : "int64_t";
  }
}

static std::string joinPath(StringRef path, StringRef name) {
  return path.empty() ? name.str() : (path + "." + name).str();
}

static std::string writeExtents(ArrayRef<int64_t> counts) {
  std::string text;
  for (int64_t count : counts)
    text += llvm::formatv("[{0}]", count).str();
  return text;
}

/// Whether dimensions are those of an array of elements of that size.
static bool isDense(ArrayRef<int64_t> counts, ArrayRef<int64_t> strides,
                    int64_t size) {
  for (size_t d = counts.size(); d-- > 0;) {
    if (strides[d] != size)
      return false;
    size *= counts[d];
  }
  return true;
}

/// Bytes up to an offset.
static void pad(Layout &layout, int64_t offset, StringRef indent) {
  layout.text += llvm::formatv("{0}unsigned char padding{1}_[{2}];\n", indent,
                               layout.size, offset - layout.size)
                     .str();
  layout.size = offset;
  layout.lastType.clear();
}

//===----------------------------------------------------------------------===//
// The layout of one record
//===----------------------------------------------------------------------===//

class RecordWriter::Layouter {
public:
  Layouter(RecordWriter &writer, RecordOp record, const std::string &use)
      : writer(writer), record(record), use(use) {}

  std::string run();

private:
  std::optional<MemberType> getNumber(const Leaf &leaf,
                                      const std::string &path);
  std::optional<MemberType> getClass(ArrayRef<Leaf> leaves,
                                     const std::string &path,
                                     const CppType &type, int64_t stride,
                                     const std::string &indent);
  std::optional<MemberType> getStdArray(ArrayRef<Leaf> leaves,
                                        const std::string &path);
  std::optional<MemberType> getMember(ArrayRef<Leaf> leaves,
                                      const std::string &path,
                                      const std::string &indent);
  std::optional<MemberType> getElements(ArrayRef<Leaf> leaves, size_t dims,
                                        const std::string &path,
                                        const CppType &type,
                                        const std::string &indent);
  bool place(Layout &layout, const MemberType &member, StringRef name,
             int64_t offset, int64_t maxAlign, const std::string &indent);
  std::optional<Layout> layOut(ArrayRef<Leaf> leaves, const std::string &path,
                               int64_t maxAlign, const std::string &indent);

  RecordWriter &writer;
  RecordOp record;
  const std::string &use;
};

/// A number or an array of numbers.
std::optional<MemberType>
RecordWriter::Layouter::getNumber(const Leaf &leaf, const std::string &path) {
  int64_t size = leaf.getElementSize();
  if (!isDense(leaf.counts, leaf.strides, size))
    return std::nullopt;
  MemberType number{getStorageType(leaf.type).str(),
                    size * llvm::product_of(leaf.counts), size, leaf.counts};
  std::optional<CppType> type = lookupCppType(record, path);
  if (!type)
    return number;
  number.name = type->name.str();
  if (!type->underlying.empty()) {
    number.name = writer.defineEnum(*type, use);
    number.tag = "enum";
  }
  return number;
}

/// What lies in a std::array is an array, its one member.
std::optional<MemberType>
RecordWriter::Layouter::getStdArray(ArrayRef<Leaf> leaves,
                                    const std::string &path) {
  StringRef name = leaves[0].path[0];
  for (const Leaf &leaf : leaves)
    if (leaf.path[0] != name)
      return std::nullopt;
  std::optional<MemberType> inner =
      getMember(leaves, joinPath(path, name), structIndent);
  if (!inner || inner->extents.empty() || inner->name.back() == '}')
    return std::nullopt;
  writer.includes.insert("array");
  inner->name = llvm::formatv(
      "std::array<{0}{1}, {2}>", inner->name,
      writeExtents(ArrayRef(inner->extents).drop_front()), inner->extents[0]);
  inner->extents.clear();
  inner->tag = "";
  return inner;
}

/// A class; its size may be enlarged to the stride of an array, if there is
/// one.
std::optional<MemberType>
RecordWriter::Layouter::getClass(ArrayRef<Leaf> leaves, const std::string &path,
                                 const CppType &type, int64_t stride,
                                 const std::string &indent) {
  if (type.name == "std::array")
    return getStdArray(leaves, path);
  bool isNamed = type.name != "struct";
  std::string inner = isNamed ? structIndent : indent + "  ";
  std::optional<Layout> layout = layOut(leaves, path, type.align, inner);
  if (!layout || (type.align && layout->align > type.align))
    return std::nullopt;
  int64_t align = std::max(layout->align, type.align);
  int64_t size = llvm::alignTo(layout->size, align);
  int64_t wanted = std::max({size, type.size, stride});
  if ((type.size && wanted != type.size) || wanted % align != 0)
    return std::nullopt;
  if (std::optional<GlmType> glm = parseGlmType(type.name)) {
    if (!type.size && size != wanted)
      return std::nullopt;
    writer.useGlm(type.name, *glm, wanted, layout->members);
    return MemberType{type.name.str(), wanted, align};
  }
  if (size < wanted)
    pad(*layout, wanted, inner);
  if (isNamed)
    return MemberType{writer.defineStruct(type.name, use, layout->text, wanted,
                                          align, layout->members),
                      wanted,
                      align,
                      {},
                      "struct"};
  std::string head = align > layout->align
                         ? llvm::formatv("struct alignas({0}) {{\n", align)
                         : std::string("struct {\n");
  return MemberType{head + layout->text + indent + "}", wanted, align};
}

/// A class or, over its leaves' first `dims` dimensions, an array of them.
std::optional<MemberType> RecordWriter::Layouter::getElements(
    ArrayRef<Leaf> leaves, size_t dims, const std::string &path,
    const CppType &type, const std::string &indent) {
  const Leaf &first = leaves.front();
  auto counts = ArrayRef(first.counts).take_front(dims);
  auto strides = ArrayRef(first.strides).take_front(dims);
  std::vector<Leaf> inner(leaves.begin(), leaves.end());
  for (Leaf &leaf : inner) {
    if (leaf.path.size() < 2 || leaf.counts.size() < dims ||
        ArrayRef(leaf.counts).take_front(dims) != counts ||
        ArrayRef(leaf.strides).take_front(dims) != strides)
      return std::nullopt;
    leaf.path.erase(leaf.path.begin());
    leaf.counts.erase(leaf.counts.begin(), leaf.counts.begin() + dims);
    leaf.strides.erase(leaf.strides.begin(), leaf.strides.begin() + dims);
  }
  int64_t stride = dims ? strides.back() : 0;
  std::optional<MemberType> element =
      getClass(inner, path, type, stride, indent);
  if (!element || !isDense(counts, strides, element->size))
    return std::nullopt;
  element->extents.assign(counts.begin(), counts.end());
  element->size *= llvm::product_of(counts);
  return element;
}

std::optional<MemberType> RecordWriter::Layouter::getMember(
    ArrayRef<Leaf> leaves, const std::string &path, const std::string &indent) {
  if (leaves.size() == 1 && leaves[0].path.size() == 1)
    return getNumber(leaves[0], path);
  if (std::optional<CppType> type = lookupCppType(record, path))
    return getElements(leaves, type->extents.size(), path, *type, indent);
  for (size_t dims = 0; dims <= leaves[0].counts.size(); ++dims)
    if (auto member =
            getElements(leaves, dims, path, CppType{"struct"}, indent))
      return member;
  return std::nullopt;
}

/// Puts a member at its offset; after a number of the same type, on its line.
bool RecordWriter::Layouter::place(Layout &layout, const MemberType &member,
                                   StringRef name, int64_t offset,
                                   int64_t maxAlign,
                                   const std::string &indent) {
  if (offset < layout.size || offset % member.align != 0)
    return false;
  int64_t align = member.align;
  while (int64_t(llvm::alignTo(layout.size, align)) < offset &&
         align * 2 <= maxAlign)
    align *= 2;
  if (int64_t(llvm::alignTo(layout.size, align)) != offset) {
    pad(layout, offset, indent);
    align = member.align;
  }
  bool isPlain = member.isPlain() && align == member.align;
  if (isPlain && member.name == layout.lastType) {
    layout.text.resize(layout.text.size() - 2); // ";\n"
    layout.text += ", " + name.str() + ";\n";
  } else {
    layout.text += indent;
    if (align != member.align)
      layout.text += llvm::formatv("alignas({0}) ", align);
    if (member.name == name) // which would hide the type
      layout.text += (member.tag + " ").str();
    layout.text +=
        member.name + " " + name.str() + writeExtents(member.extents) + ";\n";
    layout.lastType = isPlain ? member.name : "";
  }
  layout.size = offset + member.size;
  layout.align = std::max(layout.align, align);
  layout.members.emplace_back(name.str(), offset);
  return true;
}

/// The members of a class that begins with its first number.
std::optional<Layout>
RecordWriter::Layouter::layOut(ArrayRef<Leaf> leaves, const std::string &path,
                               int64_t maxAlign, const std::string &indent) {
  Layout layout;
  int64_t base = path.empty() ? 0 : leaves[0].offset;
  while (!leaves.empty()) {
    StringRef name = leaves[0].path[0];
    auto together = leaves.take_while(
        [&](const Leaf &leaf) { return leaf.path[0] == name; });
    leaves = leaves.drop_front(together.size());
    std::optional<MemberType> member =
        getMember(together, joinPath(path, name), indent);
    bool isKnown = llvm::any_of(
        layout.members, [&](const auto &other) { return other.first == name; });
    if (!member || isKnown || !isCppIdentifier(name) ||
        !place(layout, *member, name, together[0].offset - base, maxAlign,
               indent))
      return std::nullopt;
  }
  return layout;
}

std::string RecordWriter::Layouter::run() {
  std::vector<Leaf> leaves;
  bool isValue = true;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    Leaf &leaf = leaves.emplace_back();
    field.getName().split(leaf.path, '.');
    leaf.type = field.getType();
    leaf.offset = field.getOffset();
    leaf.counts.assign(field.getCounts().begin(), field.getCounts().end());
    leaf.strides.assign(field.getStrides().begin(), field.getStrides().end());
    isValue &= leaf.path[0] == "value";
  }
  int64_t size = record.getSize(), align = record.getAlign();
  std::optional<CppType> whole = lookupCppType(record, "this");
  isValue &= !whole && !leaves.empty() && leaves[0].offset == 0;
  // An array without a type may as well be the one member of a class.
  if (isValue && (lookupCppType(record, "value") ||
                  (leaves[0].path.size() == 1 && leaves[0].counts.empty())))
    if (auto type = getMember(leaves, "value", structIndent);
        type && type->size == size && type->name.back() != '}')
      return type->name + writeExtents(type->extents);
  if (!whole)
    whole = CppType{record.getSymName()};
  whole->size = size;
  whole->align = align;
  if (auto type = getClass(leaves, "", *whole, /*stride=*/0, classIndent))
    return type->name;
  return writer.defineStruct(
      whole->name, use,
      llvm::formatv("{0}unsigned char bytes[{1}];\n", structIndent, size), size,
      align, {});
}

//===----------------------------------------------------------------------===//
// Definitions
//===----------------------------------------------------------------------===//

std::string RecordWriter::getType(RecordOp record, const std::string &use) {
  auto [it, isNew] = types.try_emplace(record);
  if (isNew)
    it->second = Layouter(*this, record, use).run();
  return it->second;
}

/// The compiler's text for what has no name is none.
static std::string getHeaderName(StringRef cppName, const std::string &use) {
  return cppName.contains('(') || cppName == "struct"
             ? use
             : getUnscopedName(cppName);
}

std::string RecordWriter::defineStruct(StringRef cppName,
                                       const std::string &use,
                                       const std::string &body, int64_t size,
                                       int64_t align, const Offsets &members) {
  std::string key = llvm::formatv("alignas({0}) {1} {2}", align, size, body);
  auto [it, isNew] = defined.try_emplace({cppName.str(), key});
  if (!isNew)
    return it->second;
  it->second = scope.declare(getHeaderName(cppName, use));
  const std::string &name = it->second;
  definitions += llvm::formatv("{0}struct alignas({1}) {2} {{\n{3}{0}};\n"
                               "{0}static_assert(sizeof({2}) == {4});\n",
                               classIndent, align, name, body, size);
  for (const auto &[member, offset] : members)
    definitions += llvm::formatv("{0}static_assert(offsetof({1}, {2}) == {3});"
                                 "\n",
                                 classIndent, name, member, offset);
  definitions += "\n";
  return name;
}

static std::string writeEnumerator(int64_t value, StringRef underlying) {
  if (underlying == "bool")
    return value ? "true" : "false";
  if (underlying.starts_with("u") && value < 0)
    return llvm::formatv("{0}u", uint64_t(value));
  if (value == INT64_MIN)
    return "-9223372036854775807 - 1";
  return std::to_string(value);
}

std::string RecordWriter::defineEnum(const CppType &type,
                                     const std::string &use) {
  std::vector<std::pair<int64_t, StringRef>> enumerators;
  if (type.enumerators)
    for (mlir::NamedAttribute entry : type.enumerators)
      enumerators.emplace_back(
          llvm::cast<mlir::IntegerAttr>(entry.getValue()).getInt(),
          entry.getName().getValue());
  llvm::sort(enumerators);
  std::string key = type.isScoped ? "class" : "enum";
  for (const auto &[value, name] : enumerators)
    key += llvm::formatv(" {0} = {1}", name, value);
  auto [it, isNew] =
      defined.try_emplace({type.name.str(), key + type.underlying.str()});
  if (!isNew)
    return it->second;
  it->second = scope.declare(getHeaderName(type.name, use));
  definitions +=
      llvm::formatv("{0}enum {1}{2} : {3} {{", classIndent,
                    type.isScoped ? "class " : "", it->second, type.underlying);
  StringRef separator = "\n";
  for (const auto &[value, name] : enumerators) {
    if (type.isScoped ? !isCppIdentifier(name) : !scope.isFree(name))
      continue;
    if (!type.isScoped)
      scope.reserve(name);
    definitions += llvm::formatv("{0}{1}{2} = {3}", separator, structIndent,
                                 name, writeEnumerator(value, type.underlying));
    separator = ",\n";
  }
  definitions += llvm::formatv("\n{0}};\n\n", classIndent);
  return it->second;
}

/// A host may have configured GLM in another way.
void RecordWriter::useGlm(StringRef name, const GlmType &type, int64_t size,
                          const Offsets &members) {
  includes.insert("glm/glm.hpp");
  if (type.kind == GlmType::Quaternion)
    includes.insert("glm/gtc/quaternion.hpp");
  else if (type.count == 1)
    includes.insert("glm/ext/vector_float1.hpp");
  auto [it, isNew] = defined.try_emplace({name.str(), "glm"});
  if (!isNew)
    return;
  definitions += llvm::formatv("{0}static_assert(sizeof({1}) == {2});\n",
                               classIndent, name, size);
  if (type.kind == GlmType::Quaternion) // of two orders
    definitions +=
        llvm::formatv("{0}static_assert(offsetof({1}, {2}) == {3});"
                      "\n",
                      classIndent, name, members[0].first, members[0].second);
  definitions += "\n";
}
