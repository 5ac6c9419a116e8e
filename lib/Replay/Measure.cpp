// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Replay/Measure.h"

#include "pikort/pikort.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

using namespace piko;
using namespace piko::replay;

namespace {

/// The differences in one field.
struct FieldError {
  int64_t numbers = 0, different = 0;
  int64_t odd = 0; ///< finite in only one
  double absolute = 0, relative = 0;
  uint64_t ulps = 0;

  void add(int32_t type, const char *a, const char *b);
  std::string describe(const std::string &name, bool isFloat) const;

private:
  template <class T, class Bits> void addFloats(const char *a, const char *b);
};

/// Numbers that follow each other become integers that do.
template <class Bits> Bits order(Bits bits) {
  constexpr Bits sign = Bits(1) << (sizeof(Bits) * 8 - 1);
  return bits & sign ? sign - (bits & ~sign) : sign + bits;
}

template <class T, class Bits>
void FieldError::addFloats(const char *a, const char *b) {
  T x, y;
  std::memcpy(&x, a, sizeof(T));
  std::memcpy(&y, b, sizeof(T));
  Bits from, to;
  std::memcpy(&from, a, sizeof(T));
  std::memcpy(&to, b, sizeof(T));
  if (from == to || (x != x && y != y))
    return;
  ++different;
  if (!std::isfinite(x) || !std::isfinite(y)) {
    ++odd;
    return;
  }
  double difference = std::fabs(double(x) - double(y));
  absolute = std::max(absolute, difference);
  if (difference > 0)
    relative = std::max(relative, difference / std::max(std::fabs(double(x)),
                                                        std::fabs(double(y))));
  from = order(from);
  to = order(to);
  ulps = std::max(ulps, uint64_t(from > to ? from - to : to - from));
}

void FieldError::add(int32_t type, const char *a, const char *b) {
  ++numbers;
  if (type == PIKORT_F32)
    addFloats<float, uint32_t>(a, b);
  else if (type == PIKORT_F64)
    addFloats<double, uint64_t>(a, b);
  else
    different += std::memcmp(a, b, size_t(1) << (type - PIKORT_I8)) != 0;
}

std::string FieldError::describe(const std::string &name, bool isFloat) const {
  std::string text = "'" + name + "': " + std::to_string(different) + " of " +
                     std::to_string(numbers) + " numbers differ";
  if (!isFloat)
    return text;
  char sizes[128];
  std::snprintf(sizes, sizeof sizes, ", by at most %.3g, relatively %.3g, %llu",
                absolute, relative, static_cast<unsigned long long>(ulps));
  text += std::string(sizes) + " ULP";
  if (odd)
    text += "; " + std::to_string(odd) + " are finite in only one";
  return text;
}

void measureRecords(const std::string &name, const Records &expected,
                    const Records &actual, Measure &into) {
  int64_t records = int64_t(expected.bytes.size()) / expected.size;
  for (const Field &field : expected.fields) {
    bool isFloat = field.type == PIKORT_F32 || field.type == PIKORT_F64;
    FieldError error;
    for (int64_t i = 0; i < records; ++i)
      for (int64_t e = 0; e < field.elements; ++e) {
        size_t at = size_t(i * expected.size + field.offset + e * field.stride);
        error.add(field.type, &expected.bytes[at], &actual.bytes[at]);
      }
    if (!error.different)
      continue;
    into.lines.push_back(error.describe(name + "." + field.name, isFloat));
    into.relative = std::max(into.relative, error.relative);
    into.differsInKind |= !isFloat || error.odd > 0;
  }
}

} // namespace

Measure replay::measureOutcomes(const Outcome &expected,
                                const Outcome &actual) {
  Measure measure;
  for (const auto &[name, records] : expected.state) {
    auto found = actual.state.find(name);
    if (found != actual.state.end() &&
        found->second.bytes.size() == records.bytes.size()) {
      measureRecords(name, records, found->second, measure);
      continue;
    }
    measure.lines.push_back("'" + name + "' is missing or of another size");
    measure.differsInKind = true;
  }
  return measure;
}

// --- All numbers at once ----------------------------------------------------

namespace {

template <class T> double readAs(const char *at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return double(value);
}

double readNumber(int32_t type, const char *at) {
  switch (type) {
  case PIKORT_F32:
    return readAs<float>(at);
  case PIKORT_F64:
    return readAs<double>(at);
  case PIKORT_I8:
    return readAs<int8_t>(at);
  case PIKORT_I16:
    return readAs<int16_t>(at);
  case PIKORT_I32:
    return readAs<int32_t>(at);
  default:
    return readAs<int64_t>(at);
  }
}

/// All numbers of a field.
std::vector<double> readNumbers(const Records &records, const Field &field) {
  std::vector<double> numbers;
  int64_t count = int64_t(records.bytes.size()) / records.size;
  for (int64_t i = 0; i < count; ++i)
    for (int64_t e = 0; e < field.elements; ++e)
      numbers.push_back(readNumber(
          field.type, &records.bytes[size_t(i * records.size + field.offset +
                                            e * field.stride)]));
  return numbers;
}

double differenceOf(double a, double b, double scale) {
  bool areEqual = a == b || (std::isnan(a) && std::isnan(b));
  if (areEqual)
    return 0;
  if (!std::isfinite(a) || !std::isfinite(b))
    return 1;
  return std::fabs(a - b) / scale;
}

} // namespace

NumberErrors replay::measureNumbers(const Outcome &expected,
                                    const Outcome &actual) {
  std::vector<double> differences;
  for (const auto &[name, records] : expected.state) {
    auto found = actual.state.find(name);
    bool isThere = found != actual.state.end() &&
                   found->second.bytes.size() == records.bytes.size();
    for (const Field &field : records.fields) {
      std::vector<double> wanted = readNumbers(records, field);
      if (!isThere) {
        differences.insert(differences.end(), wanted.size(), 1);
        continue;
      }
      double scale = 0;
      for (double number : wanted)
        if (std::isfinite(number))
          scale = std::max(scale, std::fabs(number));
      std::vector<double> got = readNumbers(found->second, field);
      for (size_t i = 0; i < wanted.size(); ++i)
        differences.push_back(
            differenceOf(wanted[i], got[i], scale > 0 ? scale : 1));
    }
  }
  NumberErrors errors;
  if (differences.empty())
    return errors;
  double squares = 0;
  for (double difference : differences) {
    errors.largest = std::max(errors.largest, difference);
    errors.mean += difference;
    squares += difference * difference;
  }
  auto count = double(differences.size());
  errors.mean /= count;
  errors.rms = std::sqrt(squares / count);
  auto place = differences.begin() + int64_t(0.99 * (count - 1));
  std::nth_element(differences.begin(), place, differences.end());
  errors.p99 = *place;
  return errors;
}
