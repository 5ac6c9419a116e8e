//===- TableFile.cpp - Primitives from tables of numbers ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/TableFile.h"

#include "PackedFile.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>
#include <type_traits>

using namespace piko;
using namespace piko::render;

namespace {

std::string quote(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + "'";
}

Error failAt(const std::string &path, int64_t line, const std::string &why) {
  return {"table '" + path + "', line " + std::to_string(line) + ": " + why};
}

std::string_view trim(std::string_view word) {
  constexpr std::string_view space = " \t\r";
  size_t first = word.find_first_not_of(space);
  if (first == word.npos)
    return {};
  return word.substr(first, word.find_last_not_of(space) + 1 - first);
}

/// What comes before a separator, which goes with it.
std::string_view take(std::string_view &rest, char separator) {
  size_t end = std::min(rest.find(separator), rest.size());
  std::string_view word = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return word;
}

/// Appends the words between commas: how many there are.
size_t split(std::string_view line, std::vector<std::string_view> &words) {
  auto count = size_t(std::count(line.begin(), line.end(), ',') + 1);
  for (size_t i = 0; i < count; ++i)
    words.push_back(trim(take(line, ',')));
  return count;
}

Result<Done> addLine(Table &table, std::string_view line, int64_t number) {
  if (table.names.empty()) {
    split(line, table.names);
    for (size_t i = 0; i < table.names.size(); ++i) {
      auto begin = table.names.begin(), at = begin + std::ptrdiff_t(i);
      if (at->empty())
        return failAt(table.path, number,
                      "expected a name of a field between "
                      "commas, but got nothing");
      if (std::find(begin, at, *at) != at)
        return failAt(table.path, number,
                      "expected each field once, but got " + quote(*at) +
                          " twice");
    }
    return Done{};
  }
  size_t count = split(line, table.words);
  table.lines.push_back(number);
  if (count != table.names.size())
    return failAt(table.path, number,
                  "expected " + std::to_string(table.names.size()) +
                      " numbers, but got " + std::to_string(count));
  return Done{};
}

Result<Table> parseTable(const std::string &path, std::string content) {
  Table table;
  table.path = path;
  table.text = std::make_shared<const std::string>(std::move(content));
  std::string_view rest = *table.text;
  constexpr std::string_view byteOrderMark = "\xef\xbb\xbf";
  if (rest.starts_with(byteOrderMark))
    rest.remove_prefix(byteOrderMark.size());
  for (int64_t number = 1; !rest.empty(); ++number) {
    std::string_view line = trim(take(rest, '\n'));
    if (line.empty() || line[0] == '#')
      continue;
    if (auto ok = addLine(table, line, number); !ok)
      return ok.error();
  }
  if (table.names.empty())
    return Error{"table '" + path +
                 "': expected a line of names, but it is empty"};
  return table;
}

/// A place in a record.
struct Slot {
  int64_t offset = 0;
  int32_t type = 0;
};

/// The numbers of a record by their names, in order of places.
Result<std::vector<std::pair<std::string, Slot>>>
findSlots(pikort_pipeline *pipeline, int32_t record, int32_t fields) {
  std::vector<std::pair<std::string, Slot>> slots;
  for (int32_t f = 0; f < fields; ++f) {
    pikort_field_info field;
    if (pikort_get_field(pipeline, record, f, &field) != PIKORT_OK)
      return Error{pikort_message(pipeline)};
    for (int64_t e = 0; e < field.elements; ++e) {
      std::string name = field.name;
      if (field.elements > 1)
        name += "[" + std::to_string(e) + "]";
      slots.push_back({name, {field.offset + e * field.stride, field.type}});
    }
  }
  return slots;
}

template <class T>
bool store(std::string_view word, char *to, int64_t least, uint64_t most) {
  const char *end = word.data() + word.size();
  bool isNegative = word.starts_with('-');
  int64_t negative = 0;
  uint64_t positive = 0;
  auto [stop, error] = isNegative ? std::from_chars(word.data(), end, negative)
                                  : std::from_chars(word.data(), end, positive);
  if (error != std::errc() || stop != end || negative < least ||
      positive > most)
    return false;
  auto value = T(isNegative ? uint64_t(negative) : positive);
  std::memcpy(to, &value, sizeof value);
  return true;
}

/// A whole number of a field, which may be signed or not: nobody knows.
template <class T> bool storeWhole(std::string_view word, char *to) {
  using Signed = std::make_signed_t<T>;
  return store<T>(word, to, std::numeric_limits<Signed>::min(),
                  std::numeric_limits<T>::max());
}

template <class T> bool storeReal(std::string_view word, char *to) {
  T value{};
  const char *end = word.data() + word.size();
  auto [stop, error] = std::from_chars(word.data(), end, value);
  if (error != std::errc() || stop != end)
    return false;
  std::memcpy(to, &value, sizeof value);
  return true;
}

/// Writes a number; false if the word is none that the type holds.
bool storeNumber(std::string_view word, int32_t type, char *to) {
  switch (type) {
  case PIKORT_F32:
    return storeReal<float>(word, to);
  case PIKORT_F64:
    return storeReal<double>(word, to);
  case PIKORT_I8:
    return storeWhole<uint8_t>(word, to);
  case PIKORT_I16:
    return storeWhole<uint16_t>(word, to);
  case PIKORT_I32:
    return storeWhole<uint32_t>(word, to);
  default:
    return storeWhole<uint64_t>(word, to);
  }
}

const char *describe(int32_t type) {
  switch (type) {
  case PIKORT_F32:
    return "a number that a float holds";
  case PIKORT_F64:
    return "a number that a double holds";
  case PIKORT_I8:
    return "a whole number of 8 bits";
  case PIKORT_I16:
    return "a whole number of 16 bits";
  case PIKORT_I32:
    return "a whole number of 32 bits";
  default:
    return "a whole number of 64 bits";
  }
}

std::string listNames(const std::vector<std::pair<std::string, Slot>> &slots) {
  std::string text;
  for (const auto &[name, slot] : slots)
    text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// The slot of each column, all of which there must be.
Result<std::vector<Slot>>
findColumns(const Table &table, const char *record,
            const std::vector<std::pair<std::string, Slot>> &slots) {
  auto fail = [&](const std::string &why) {
    return Error{"table '" + table.path + "': " + why};
  };
  std::vector<Slot> columns;
  for (std::string_view name : table.names) {
    auto found =
        std::find_if(slots.begin(), slots.end(),
                     [&](const auto &slot) { return slot.first == name; });
    if (found == slots.end())
      return fail("expected fields of '" + std::string(record) + "' (" +
                  listNames(slots) + "), but got " + quote(name));
    columns.push_back(found->second);
  }
  for (const auto &[name, slot] : slots)
    if (std::find(table.names.begin(), table.names.end(), name) ==
        table.names.end())
      return fail("expected all fields of '" + std::string(record) + "' (" +
                  listNames(slots) + "), but '" + name + "' is missing");
  return columns;
}

} // namespace

bool render::isTableFile(const std::string &path) {
  return formatOf(path) == ".csv";
}

Result<Table> render::loadTable(const std::string &path) {
  try {
    auto content = readFile(path);
    if (!content)
      return Error{"cannot read table '" + path +
                   "': " + content.error().message};
    return parseTable(path, std::move(*content));
  } catch (const std::bad_alloc &) {
  } catch (const std::length_error &) { // more than there are addresses
  }
  return Error{"cannot read table '" + path +
               "': there is not enough memory for it"};
}

Result<TableRecords> render::makeRecords(const Table &table,
                                         pikort_pipeline *pipeline,
                                         int32_t record) {
  pikort_record_info info;
  if (pikort_get_record(pipeline, record, &info) != PIKORT_OK)
    return Error{pikort_message(pipeline)};
  auto slots = findSlots(pipeline, record, info.field_count);
  if (!slots)
    return slots.error();
  auto columns = findColumns(table, info.name, *slots);
  if (!columns)
    return columns.error();
  TableRecords records;
  records.count = int64_t(table.lines.size());
  records.size = info.size;
  auto bytes = size_t(records.count * records.size);
  records.memory.resize((bytes + sizeof(TableRecords::Block) - 1) /
                        sizeof(TableRecords::Block));
  char *to = records.memory.empty() ? nullptr : records.memory[0].bytes;
  const std::string_view *word = table.words.data();
  for (int64_t line : table.lines) {
    for (size_t c = 0; c < columns->size(); ++c, ++word)
      if (!storeNumber(*word, (*columns)[c].type, to + (*columns)[c].offset))
        return failAt(table.path, line,
                      "expected " + std::string(describe((*columns)[c].type)) +
                          " for '" + std::string(table.names[c]) +
                          "', but got " + quote(*word));
    to += records.size;
  }
  return records;
}
