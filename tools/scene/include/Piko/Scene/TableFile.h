//===- TableFile.h - Primitives from tables of numbers ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A table stands in the place of a scene and feeds a source whose primitives
// are a pipeline's own:
//
//   position.x, position.y, size    names of fields, as the pipeline has them
//   12.5, 40, 3                     a primitive
//   # ...                           not read, as are empty lines
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_SCENE_TABLEFILE_H
#define PIKO_SCENE_TABLEFILE_H

#include "Piko/Scene/Result.h"

#include <pikort/pikort.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace piko::render {

/// The words of a table. Each line has as many as there are names.
struct Table {
  std::string path;
  std::shared_ptr<const std::string> text; ///< what words point into
  std::vector<std::string_view> names;
  std::vector<std::string_view> words; ///< line by line
  std::vector<int64_t> lines;          ///< their numbers in the file, from 1
};

/// Records that a table's lines are; they do not move.
struct TableRecords {
  /// As aligned as any record is.
  struct alignas(64) Block {
    char bytes[64];
  };
  std::vector<Block> memory;
  int64_t count = 0, size = 0; ///< in bytes, of each
};

/// Whether a file's name is that of a table: NAME.csv or NAME.csv.gz.
bool isTableFile(const std::string &path);

/// Reads a table. Errors: the file cannot be read, has no names, one twice, or
/// a line of more or fewer numbers.
Result<Table> loadTable(const std::string &path);

/// The lines as records of a pipeline. An element of a field that is an array
/// is called "field[0]". Errors: the table does not have exactly the record's
/// fields, or something is no number that its field holds.
Result<TableRecords> makeRecords(const Table &table, pikort_pipeline *pipeline,
                                 int32_t record);

} // namespace piko::render

#endif // PIKO_SCENE_TABLEFILE_H
