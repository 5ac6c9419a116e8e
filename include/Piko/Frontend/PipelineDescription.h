//===- PipelineDescription.h - A pipeline as its C++ says it ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the front end reads about a pipeline apart from the bodies of its
// phases. Records are numbered; everything else refers to them by number.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_FRONTEND_PIPELINEDESCRIPTION_H
#define PIKO_FRONTEND_PIPELINEDESCRIPTION_H

#include "mlir/IR/BuiltinAttributes.h"
#include "mlir/IR/OperationSupport.h"
#include "llvm/ADT/SmallVector.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace piko {

/// The number types that a leaf field of a record may have; bool is I8.
enum class ScalarType { F32, F64, I8, I16, I32, I64 };

/// A number or an array of numbers at a fixed place in a record.
struct LeafField {
  std::string name;
  ScalarType type;
  int64_t offset;
  /// Outermost dimension first; strides in bytes.
  llvm::SmallVector<int64_t, 2> counts, strides;

  int64_t getElementCount() const {
    int64_t count = 1;
    for (int64_t dimension : counts)
      count *= dimension;
    return count;
  }
};

/// What C++ calls the type of a piece of a record; see `piko.cpp_types`.
struct CppTypeDescription {
  /// Of a field, of the class around some, or "this".
  std::string path;
  /// With the extents of an array: "Light[4]".
  std::string type;
  /// Of a class, where they do not follow from its fields.
  int64_t size = 0, align = 0;
  /// Of an enumeration.
  std::string underlying = {};
  bool isScoped = false;
  std::vector<std::pair<std::string, int64_t>> enumerators = {};
};

/// The layout of a trivially copyable C++ type.
struct RecordDescription {
  std::string name;
  int64_t size = 0, align = 1;
  std::vector<LeafField> fields;
  /// The types that the fields do not tell.
  std::vector<CppTypeDescription> types = {};

  int64_t getElementCount() const {
    int64_t count = 0;
    for (const LeafField &field : fields)
      count += field.getElementCount();
    return count;
  }
};

struct StateDescription {
  enum Kind { Constant, Buffer, Image };
  std::string name;
  Kind kind;
  unsigned record;
  int64_t rank;
  /// Bytes from the beginning of the state.
  int64_t offset;
  mlir::Location location;
  /// The source that gives a buffer its length.
  std::optional<int64_t> perSource = std::nullopt;
  /// Whether a constant is initialized.
  bool hasValue = false;
  /// That value, or what an image is cleared to: the bits of each number of the
  /// record.
  std::vector<uint64_t> clear = {};
  /// Whether Clang's constant evaluation gave it, and where and why it did not.
  bool isEvaluated = false;
  std::optional<std::pair<mlir::Location, std::string>> whyUnknown =
      std::nullopt;

  bool hasClear() const { return kind == Image || hasValue; }
};

/// What directives say that is the same for all bins, as attributes of the
/// operations of a stage; see piko/markers.def.
struct ScheduleDescription {
  mlir::NamedAttrList ofStage, ofSchedule, ofProcess;
  /// Whether a directive depends on the bin or on constants: then the schedule
  /// phase is code.
  bool isDynamic = false;
  /// Where the text says what lanes are given.
  std::optional<mlir::Location> lanesLocation = std::nullopt;

  bool says(llvm::StringRef attribute) const {
    return bool(ofSchedule.get(attribute));
  }
  /// 0 where it says none.
  int64_t getNumber(llvm::StringRef attribute) const {
    auto number =
        llvm::dyn_cast_or_null<mlir::IntegerAttr>(ofSchedule.get(attribute));
    return number ? number.getInt() : 0;
  }
  /// Whether the schedule phase says nothing.
  bool isEmpty() const { return ofSchedule.empty() && !isDynamic; }
};

struct StageDescription {
  /// The member of the pipeline, and what the dialect calls it: there, stages
  /// and state are symbols of one table.
  std::string name = {}, symbol = {};
  std::string typeName = {};
  std::vector<int64_t> bins = {};
  int64_t threads = 1;
  unsigned input = 0;
  std::vector<unsigned> outputs = {};
  bool hasAssign = false, hasSchedule = false;
  /// Whether process takes the list of a bin.
  bool takesList = false;
  ScheduleDescription schedule = {};
  /// Bytes from the beginning of the pipeline object.
  int64_t offset = 0;
  mlir::Location location;
  /// Where its class, or a base of it, declares them.
  std::optional<mlir::Location> assignLocation = std::nullopt,
                                processLocation = std::nullopt;

  bool isWholeDomain() const {
    for (int64_t size : bins)
      if (size != 0)
        return false;
    return true;
  }
};

struct EdgeDescription {
  unsigned producer, port, consumer;
  mlir::Location location;
};

struct SourceDescription {
  unsigned stage;
  mlir::Location location;
};

/// What a constructor expects of the host's numbers; see `piko.contract`.
struct ContractDescription {
  /// Of a source's primitives, or of the elements of a buffer.
  std::optional<int64_t> source;
  std::optional<unsigned> buffer;
  std::vector<std::string> fields;
  bool isSigned;
  /// The buffer that they index, or what they are below.
  std::optional<unsigned> target;
  int64_t below;
  mlir::Location location;
};

struct PipelineDescription {
  std::string name = {};
  std::string typeName = {};
  mlir::Location location;
  int64_t rank = 2;
  std::vector<RecordDescription> records = {};
  std::vector<StateDescription> state = {};
  std::vector<StageDescription> stages = {};
  std::vector<SourceDescription> sources = {};
  std::vector<EdgeDescription> edges = {};
  std::vector<ContractDescription> contracts = {};
};

} // namespace piko

#endif // PIKO_FRONTEND_PIPELINEDESCRIPTION_H
