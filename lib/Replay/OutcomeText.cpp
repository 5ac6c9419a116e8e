// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Numbers of eight bytes, and texts after their lengths.

#include "Piko/Replay/OutcomeText.h"

#include <cstring>

using namespace piko;
using replay::Field;
using replay::Outcome;
using replay::Records;

namespace {

class Writer {
public:
  void add(int64_t number) {
    text.append(reinterpret_cast<const char *>(&number), sizeof number);
  }
  void add(size_t number) { add(static_cast<int64_t>(number)); }
  void add(std::string_view bytes) {
    add(bytes.size());
    text.append(bytes);
  }

  std::string text;
};

/// What is left of a text. After what is none, all is empty.
class Reader {
public:
  explicit Reader(std::string_view rest) : rest(rest) {}

  int64_t number() {
    int64_t value = 0;
    std::string_view bytes = take(sizeof value);
    if (isWhole)
      std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string bytes() { return std::string(take(size_t(number()))); }
  bool isAtEnd() const { return rest.empty(); }

  bool isWhole = true;

private:
  std::string_view take(size_t count) {
    isWhole &= count <= rest.size();
    if (!isWhole)
      return {};
    std::string_view taken = rest.substr(0, count);
    rest.remove_prefix(count);
    return taken;
  }

  std::string_view rest;
};

Records readRecords(Reader &in) {
  Records records;
  records.bytes = in.bytes();
  records.size = in.number();
  in.isWhole &= records.size > 0;
  for (int64_t i = in.number(); i > 0 && in.isWhole; --i) {
    Field field{in.bytes(), 0, 0, 0, 0};
    for (int64_t *part : {&field.offset, &field.elements, &field.stride})
      *part = in.number();
    field.type = static_cast<int32_t>(in.number());
    records.fields.push_back(std::move(field));
  }
  return records;
}

} // namespace

std::string replay::writeOutcome(const Outcome &outcome) {
  Writer out;
  out.add(outcome.error);
  out.add(outcome.state.size());
  for (const auto &[name, records] : outcome.state) {
    out.add(name);
    out.add(records.bytes);
    out.add(records.size);
    out.add(records.fields.size());
    for (const Field &field : records.fields) {
      out.add(field.name);
      for (int64_t part : {field.offset, field.elements, field.stride})
        out.add(part);
      out.add(int64_t(field.type));
    }
  }
  return out.text;
}

std::optional<std::vector<Outcome>>
replay::readOutcomes(std::string_view text) {
  Reader in(text);
  std::vector<Outcome> outcomes;
  while (in.isWhole && !in.isAtEnd()) {
    Outcome outcome;
    outcome.error = in.bytes();
    for (int64_t i = in.number(); i > 0 && in.isWhole; --i) {
      std::string name = in.bytes();
      outcome.state[name] = readRecords(in);
    }
    outcomes.push_back(std::move(outcome));
  }
  if (!in.isWhole)
    return std::nullopt;
  return outcomes;
}
