// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What C++ calls stages, barriers and the types of records.

#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "llvm/ADT/StringSet.h"
#include "llvm/ADT/StringSwitch.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Names
//===----------------------------------------------------------------------===//

StringRef piko::getCppName(Operation *op) {
  if (auto stage = dyn_cast<StageOp>(op); stage && stage.getLabel())
    return *stage.getLabel();
  if (auto name = op->getAttrOfType<StringAttr>(cppNameAttr))
    return name.getValue();
  if (isa<SymbolOpInterface>(op))
    return SymbolTable::getSymbolName(op).getValue();
  return op->getName().stripDialect();
}

Type piko::getCppStorage(StringRef name, MLIRContext *context) {
  if (name == "float")
    return Float32Type::get(context);
  if (name == "double")
    return Float64Type::get(context);
  unsigned width =
      llvm::StringSwitch<unsigned>(name)
          .Cases({"int8_t", "uint8_t", "char", "char8_t", "bool", "std::byte"},
                 8)
          .Cases({"int16_t", "uint16_t", "char16_t"}, 16)
          .Cases({"int32_t", "uint32_t", "char32_t", "wchar_t"}, 32)
          .Cases({"int64_t", "uint64_t", "long long", "unsigned long long"}, 64)
          .Default(0);
  return width ? IntegerType::get(context, width) : Type();
}

/// `4`, or `4x3`.
static int64_t parseExtents(StringRef text) {
  int64_t product = 1;
  SmallVector<StringRef, 2> parts;
  text.split(parts, 'x');
  for (StringRef part : parts) {
    int64_t extent;
    if (part.getAsInteger(10, extent) || extent < 1 || extent > 4)
      return 0;
    product *= extent;
  }
  return parts.size() == 1 ? -product : product;
}

/// `vec<3, int8_t>`, after the namespace.
static std::optional<GlmType> parseGlmTemplate(StringRef name) {
  auto [kind, rest] = name.split('<');
  SmallVector<StringRef, 4> arguments;
  rest.drop_back().split(arguments, ", ");
  GlmType type{GlmType::Vector, 1, ""};
  size_t extents = 1;
  if (kind == "mat") {
    type.kind = GlmType::Matrix;
    extents = 2;
  } else if (kind == "qua") {
    type = {GlmType::Quaternion, 4, ""};
    extents = 0;
  } else if (kind != "vec") {
    return std::nullopt;
  }
  if (arguments.size() <= extents || arguments.size() > extents + 2)
    return std::nullopt;
  for (StringRef argument : ArrayRef(arguments).take_front(extents))
    type.count *= std::abs(parseExtents(argument));
  type.number = arguments[extents];
  return type;
}

std::optional<GlmType> piko::parseGlmType(StringRef name) {
  if (!name.consume_front("glm::"))
    return std::nullopt;
  if (name.ends_with(">"))
    return parseGlmTemplate(name);
  GlmType type{GlmType::Vector, 0, "float"};
  for (auto [letter, number] : {std::pair{"d", "double"},
                                {"i", "int32_t"},
                                {"u", "uint32_t"},
                                {"b", "bool"}})
    if (name.consume_front(letter)) {
      type.number = number;
      break;
    }
  int64_t extents = 0;
  if (name.consume_front("vec")) {
    extents = -parseExtents(name);
  } else if (name.consume_front("mat")) {
    type.kind = GlmType::Matrix;
    extents = parseExtents(name);
    if (extents < 0)
      extents *= extents;
  } else if (name == "quat") {
    type.kind = GlmType::Quaternion;
    extents = 4;
  }
  type.count = extents;
  return extents > 0 ? std::optional(type) : std::nullopt;
}

//===----------------------------------------------------------------------===//
// Entries
//===----------------------------------------------------------------------===//

/// Takes `[2][4]` from the end of a name.
static SmallVector<int64_t, 2> takeExtents(StringRef &name) {
  SmallVector<int64_t, 2> extents;
  while (name.ends_with("]")) {
    auto [before, inside] = name.rsplit('[');
    int64_t extent;
    if (inside.drop_back().getAsInteger(10, extent) || extent < 1)
      break;
    extents.insert(extents.begin(), extent);
    name = before;
  }
  return extents;
}

static CppType readType(Attribute attribute) {
  CppType type;
  auto text = dyn_cast<StringAttr>(attribute);
  if (auto parts = dyn_cast<DictionaryAttr>(attribute)) {
    text = parts.getAs<StringAttr>("type");
    if (auto size = parts.getAs<IntegerAttr>("size"))
      type.size = size.getInt();
    if (auto align = parts.getAs<IntegerAttr>("align"))
      type.align = align.getInt();
    if (auto underlying = parts.getAs<StringAttr>("underlying"))
      type.underlying = underlying.getValue();
    type.isScoped = parts.contains("scoped");
    type.enumerators = parts.getAs<DictionaryAttr>("values");
  }
  if (text)
    type.name = text.getValue();
  type.extents = takeExtents(type.name);
  return type;
}

std::optional<CppType> piko::lookupCppType(RecordOp record, StringRef path) {
  auto types = record->getAttrOfType<DictionaryAttr>(cppTypesAttr);
  Attribute entry = types ? types.get(path) : Attribute();
  if (!entry)
    return std::nullopt;
  return readType(entry);
}

//===----------------------------------------------------------------------===//
// Verification
//===----------------------------------------------------------------------===//

namespace {

class Verifier {
public:
  Verifier(RecordOp record, DictionaryAttr types)
      : record(record), types(types) {}

  LogicalResult verify() {
    for (auto field : record.getFields().getAsRange<FieldAttr>())
      for (StringRef path = field.getName(); paths.insert(path).second;)
        path = path.take_front(path.rfind('.'));
    for (NamedAttribute entry : types)
      if (failed(verifyEntry(entry.getName(), entry.getValue())))
        return failure();
    for (auto field : record.getFields().getAsRange<FieldAttr>())
      if (failed(verifyField(field)))
        return failure();
    return success();
  }

private:
  InFlightDiagnostic expected(const Twine &what, StringRef path) {
    return record.emitOpError("expected the C++ type of '")
           << path << "' to be " << what << ", but got ";
  }

  LogicalResult verifyEntry(StringRef path, Attribute entry) {
    if (path != "this" && !paths.contains(path))
      return record.emitOpError("expected '")
             << cppTypesAttr << "' to name a field, a class around fields or "
             << "'this', but got '" << path << "'";
    CppType type = readType(entry);
    if (type.name.empty() || type.name.ends_with("]"))
      return expected("a name with extents of at least 1, or a dictionary with "
                      "one as its 'type'",
                      path)
             << entry;
    if (type.size < 0 || type.align < 0 || (type.align & (type.align - 1)) ||
        (type.size == 0) != (type.align == 0) ||
        (type.align && type.size % type.align))
      return expected("a class with a power of two as its 'align', that "
                      "divides its 'size'",
                      path)
             << type.align << " and " << type.size;
    if (path == "this" && !type.extents.empty())
      return expected("no array", path) << entry;
    bool isField = path != "this" && record.getField(path);
    if (!isField && (getCppStorage(type.name, record.getContext()) ||
                     !type.underlying.empty()))
      return expected("a class", path) << entry;
    return verifyEnumerators(path, type);
  }

  LogicalResult verifyEnumerators(StringRef path, const CppType &type) {
    if (!type.enumerators)
      return success();
    for (NamedAttribute value : type.enumerators)
      if (!isa<IntegerAttr>(value.getValue()))
        return expected("an enumeration whose 'values' are integers", path)
               << value.getValue() << " for '" << value.getName().getValue()
               << "'";
    return success();
  }

  /// Each class on the path to a number, and the number.
  LogicalResult verifyField(FieldAttr field) {
    StringRef name = field.getName();
    ArrayRef<int64_t> counts = field.getCounts();
    std::optional<CppType> whole = lookupCppType(record, "this");
    if (whole && failed(verifyGlm(field, "", *whole, counts)))
      return failure();
    bool isComplete = true; // whether all classes up to here are named
    for (size_t end = name.find('.');; end = name.find('.', end + 1)) {
      StringRef path = name.take_front(end);
      std::optional<CppType> type = lookupCppType(record, path);
      bool isNumber = path.size() == name.size();
      if (type && isNumber && failed(verifyNumber(field, *type)))
        return failure();
      if (type && isComplete &&
          (failed(verifyExtents(field, path, *type, counts)) ||
           failed(verifyGlm(field, path, *type, counts))))
        return failure();
      if (isNumber)
        return success();
      isComplete &= type.has_value();
    }
  }

  LogicalResult verifyNumber(FieldAttr field, const CppType &type) {
    StringRef number = type.underlying.empty() ? type.name : type.underlying;
    Type storage = getCppStorage(number, record.getContext());
    if (!storage)
      return expected("a number, or an enumeration with a number as its "
                      "'underlying'",
                      field.getName())
             << "'" << number << "'";
    if (storage == field.getType())
      return success();
    return record.emitOpError("expected the C++ type of '")
           << field.getName() << "' to be kept in " << field.getType()
           << ", but got '" << number << "'";
  }

  /// Takes the extents of a class or a number from those of the field.
  LogicalResult verifyExtents(FieldAttr field, StringRef path,
                              const CppType &type, ArrayRef<int64_t> &counts) {
    size_t rank = type.extents.size();
    bool isNumber = path == field.getName();
    if (counts.take_front(rank).equals(type.extents) &&
        (!isNumber || counts.size() == rank)) {
      counts = counts.drop_front(rank);
      return success();
    }
    auto diagnostic = record.emitOpError("expected the extents of '")
                      << path << "' to be those of field '" << field.getName()
                      << "', [";
    llvm::interleaveComma(field.getCounts(), diagnostic);
    diagnostic << "], but got [";
    llvm::interleaveComma(type.extents, diagnostic);
    return diagnostic << "]";
  }

  /// `counts` are the extents of the field in the class.
  LogicalResult verifyGlm(FieldAttr field, StringRef path, const CppType &type,
                          ArrayRef<int64_t> counts) {
    std::optional<GlmType> glm = parseGlmType(type.name);
    if (!glm && type.name.starts_with("glm::"))
      return record.emitOpError("expected '")
             << type.name
             << "' to be a vector, a matrix or a quaternion of GLM";
    if (!glm)
      return success();
    std::string prefix = path.empty() ? "" : (path + ".").str();
    auto isInside = [&](FieldAttr other) {
      return other.getName().starts_with(prefix);
    };
    int64_t count =
        llvm::count_if(record.getFields().getAsRange<FieldAttr>(), isInside) *
        llvm::product_of(counts);
    Type storage = getCppStorage(glm->number, record.getContext());
    if (count == glm->count && storage == field.getType())
      return success();
    return record.emitOpError("expected '")
           << type.name << "' for " << glm->count << " numbers of type '"
           << glm->number << "', but got " << count << " of type "
           << field.getType() << " in '"
           << (path.empty() ? StringRef("this") : path) << "'";
  }

  RecordOp record;
  DictionaryAttr types;
  llvm::StringSet<> paths;
};

} // namespace

LogicalResult piko::verifyCppTypes(RecordOp record) {
  auto types = record->getAttrOfType<DictionaryAttr>(cppTypesAttr);
  return types ? Verifier(record, types).verify() : success();
}
