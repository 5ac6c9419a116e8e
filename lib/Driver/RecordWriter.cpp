// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records as C++ structs.
//
// A record lists its numbers by their paths: `lights.color.x` is four floats,
// 32 bytes apart. Paths that begin alike become a member that is a struct. The
// dimensions of an array belong to a member on the path, but the record does
// not say to which; they go to the innermost where the bytes come out right.

#include "RecordWriter.h"

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
  std::string text, lastType = {};
  int64_t size = 0, align = 1;
  std::vector<std::pair<std::string, int64_t>> members = {};
};

/// A member's type and array extents, without its place.
struct Member {
  std::string type, extents;
  int64_t size, align;
};

} // namespace

static StringRef getCppType(mlir::Type type) {
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

bool piko::isCppIdentifier(StringRef name) {
  return !name.empty() && !llvm::isDigit(name[0]) &&
         llvm::all_of(name,
                      [](char c) { return llvm::isAlnum(c) || c == '_'; });
}

StringRef piko::getScalarType(RecordOp record) {
  if (record.getFields().size() != 1)
    return "";
  auto field = llvm::cast<FieldAttr>(record.getFields()[0]);
  bool isScalar =
      field.getName() == "value" && field.getOffset() == 0 &&
      field.getCounts().empty() &&
      int64_t(record.getSize()) * 8 == field.getType().getIntOrFloatBitWidth();
  return isScalar ? getCppType(field.getType()) : "";
}

/// Bytes between members.
static void pad(Layout &layout, int64_t offset, StringRef indent) {
  layout.text += llvm::formatv("{0}unsigned char padding{1}_[{2}];\n", indent,
                               layout.size, offset - layout.size)
                     .str();
  layout.size = offset;
  layout.lastType.clear();
}

/// How many outer dimensions, down from the first, have the bytes of an array
/// of elements of that size; none if the dimensions do not fit an array.
static bool isDense(ArrayRef<int64_t> counts, ArrayRef<int64_t> strides,
                    int64_t size) {
  for (size_t d = counts.size(); d-- > 0;) {
    if (strides[d] != size)
      return false;
    size *= counts[d];
  }
  return true;
}

static std::string writeExtents(ArrayRef<int64_t> counts) {
  std::string text;
  for (int64_t count : counts)
    text += llvm::formatv("[{0}]", count).str();
  return text;
}

static std::optional<Layout> layOut(ArrayRef<Leaf> leaves, int64_t base,
                                    const std::string &indent);

/// A member that is a number or an array of numbers.
static std::optional<Member> makeNumber(const Leaf &leaf) {
  int64_t size = leaf.getElementSize();
  if (!isDense(leaf.counts, leaf.strides, size))
    return std::nullopt;
  int64_t elements = llvm::product_of(leaf.counts);
  return Member{getCppType(leaf.type).str(), writeExtents(leaf.counts),
                size * elements, size};
}

/// A member that is a struct or, over its leaves' first `dims` dimensions, an
/// array of them.
static std::optional<Member> makeStruct(ArrayRef<Leaf> leaves, size_t dims,
                                        const std::string &indent) {
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
  std::optional<Layout> layout = layOut(inner, first.offset, indent + "  ");
  if (!layout)
    return std::nullopt;
  int64_t size = llvm::alignTo(layout->size, layout->align);
  if (dims != 0) {
    if (size > strides.back() || strides.back() % layout->align != 0)
      return std::nullopt;
    if (size < strides.back())
      pad(*layout, strides.back(), indent + "  ");
    size = strides.back();
    if (!isDense(counts, strides, size))
      return std::nullopt;
  }
  return Member{"struct {\n" + layout->text + indent + "}",
                writeExtents(counts), size * llvm::product_of(counts),
                layout->align};
}

static std::optional<Member> makeMember(ArrayRef<Leaf> leaves,
                                        const std::string &indent) {
  if (leaves.size() == 1 && leaves[0].path.size() == 1)
    return makeNumber(leaves[0]);
  for (size_t dims = 0; dims <= leaves[0].counts.size(); ++dims)
    if (std::optional<Member> member = makeStruct(leaves, dims, indent))
      return member;
  return std::nullopt;
}

/// Behind a number of the same type, on its line.
static void addMember(Layout &layout, const Member &member, StringRef name,
                      const std::string &indent) {
  if (member.type == layout.lastType && member.extents.empty()) {
    layout.text.resize(layout.text.size() - 2); // ";\n"
    layout.text += ", " + name.str() + ";\n";
    return;
  }
  layout.text +=
      indent + member.type + " " + name.str() + member.extents + ";\n";
  bool isLine = member.extents.empty() && member.type.back() != '}';
  layout.lastType = isLine ? member.type : "";
}

static std::optional<Layout> layOut(ArrayRef<Leaf> leaves, int64_t base,
                                    const std::string &indent) {
  Layout layout;
  while (!leaves.empty()) {
    StringRef name = leaves[0].path[0];
    auto together = leaves.take_while(
        [&](const Leaf &leaf) { return leaf.path[0] == name; });
    leaves = leaves.drop_front(together.size());
    int64_t offset = together[0].offset - base;
    std::optional<Member> member = makeMember(together, indent);
    bool isKnown = llvm::any_of(
        layout.members, [&](const auto &other) { return other.first == name; });
    if (!member || isKnown || !isCppIdentifier(name) || offset < layout.size ||
        offset % member->align != 0)
      return std::nullopt;
    if (offset != int64_t(llvm::alignTo(layout.size, member->align)))
      pad(layout, offset, indent);
    addMember(layout, *member, name, indent);
    layout.size = offset + member->size;
    layout.align = std::max(layout.align, member->align);
    layout.members.emplace_back(name.str(), offset);
  }
  return layout;
}

static std::optional<Layout> layOutRecord(RecordOp record,
                                          const std::string &indent) {
  std::vector<Leaf> leaves;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    Leaf &leaf = leaves.emplace_back();
    field.getName().split(leaf.path, '.');
    leaf.type = field.getType();
    leaf.offset = field.getOffset();
    leaf.counts.assign(field.getCounts().begin(), field.getCounts().end());
    leaf.strides.assign(field.getStrides().begin(), field.getStrides().end());
  }
  std::optional<Layout> layout = layOut(leaves, 0, indent);
  int64_t size = record.getSize(), align = record.getAlign();
  if (!layout || layout->align > align || layout->size > size)
    return std::nullopt;
  if (int64_t(llvm::alignTo(layout->size, align)) < size)
    pad(*layout, size, indent);
  layout->align = align;
  return layout;
}

std::string piko::writeRecord(RecordOp record, StringRef name,
                              StringRef indent) {
  std::string inner = (indent + "  ").str();
  int64_t size = record.getSize(), align = record.getAlign();
  std::optional<Layout> layout = layOutRecord(record, inner);
  if (!layout)
    layout = Layout{
        .text = llvm::formatv("{0}unsigned char bytes[{1}];\n", inner, size),
        .size = size,
        .align = align};
  std::string text = llvm::formatv("{0}struct alignas({1}) {2} {{\n{3}{0}};\n"
                                   "{0}static_assert(sizeof({2}) == {4});\n",
                                   indent, align, name, layout->text, size);
  for (const auto &[member, offset] : layout->members)
    text += llvm::formatv("{0}static_assert(offsetof({1}, {2}) == {3});\n",
                          indent, name, member, offset);
  return text;
}
