// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Contracts.cpp - What code takes for granted of the host's numbers --===//

#include "common/Contracts.h"
#include "common/Pipeline.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

namespace {

/// Records that the host has bound, in the host's memory or in a device's.
struct Fed {
  const uint8_t *data;
  int64_t count, size;
  bool onDevice;
};

/// Numbers side by side in each record.
struct Run {
  int64_t offset, count;
};

} // namespace

static int64_t bytesOf(int32_t type) {
  switch (type) {
  case PIKORT_I8:
    return 1;
  case PIKORT_I16:
    return 2;
  case PIKORT_I32:
    return 4;
  default:
    return 8;
  }
}

/// What negative numbers are larger than.
static uint64_t halfOf(int32_t type) {
  return uint64_t(1) << (8 * bytesOf(type) - 1);
}

void Contracts::add(const ContractTerms &terms, ContractField field) {
  auto same = std::find_if(
      contracts.begin(), contracts.end(),
      [&](const Contract &contract) { return contract.terms == terms; });
  if (same == contracts.end())
    same = contracts.insert(same, {terms, {}});
  same->fields.push_back(std::move(field));
}

void Contracts::forget() {
  for (Contract &contract : contracts)
    contract.version = -1;
}

static std::vector<Run> findRuns(const Contract &contract) {
  int64_t size = bytesOf(contract.terms.type);
  std::vector<Run> runs;
  auto add = [&](int64_t offset, int64_t count) {
    if (!runs.empty() &&
        runs.back().offset + runs.back().count * size == offset)
      runs.back().count += count;
    else
      runs.push_back({offset, count});
  };
  for (const ContractField &field : contract.fields) {
    if (field.elements == 1 || field.stride == size)
      add(field.offset, field.elements);
    else
      for (int64_t i = 0; i < field.elements; ++i)
        add(field.offset + i * field.stride, 1);
  }
  return runs;
}

template <class T>
static T largestOf(const uint8_t *records, int64_t count, int64_t size,
                   const Run &run) {
  T largest = 0;
  auto look = [&](const uint8_t *at) {
    T number;
    std::memcpy(&number, at, sizeof(T));
    largest = std::max(largest, number);
  };
  constexpr auto width = static_cast<int64_t>(sizeof(T));
  if (run.count * width == size) // nothing else is between them
    for (int64_t i = 0; i < count * run.count; ++i)
      look(records + i * width);
  else
    for (int64_t i = 0; i < count; ++i)
      for (int64_t j = 0; j < run.count; ++j)
        look(records + i * size + run.offset + j * width);
  return largest;
}

/// Without signs.
static uint64_t largestOf(int32_t type, const uint8_t *records, int64_t count,
                          int64_t size, const Run &run) {
  switch (type) {
  case PIKORT_I8:
    return largestOf<uint8_t>(records, count, size, run);
  case PIKORT_I16:
    return largestOf<uint16_t>(records, count, size, run);
  case PIKORT_I32:
    return largestOf<uint32_t>(records, count, size, run);
  default:
    return largestOf<uint64_t>(records, count, size, run);
  }
}

/// Calls body(records, first, count) with parts of what is bound, in the host's
/// memory, until it returns false.
static void forParts(pikort_pipeline &p, const Fed &bound, auto &&body) {
  if (!bound.onDevice) {
    body(bound.data, int64_t(0), bound.count);
    return;
  }
  constexpr int64_t most = int64_t(1) << 24; // bytes
  int64_t part = std::max<int64_t>(1, most / bound.size);
  std::vector<uint8_t> copy(
      static_cast<size_t>(std::min(part, bound.count) * bound.size));
  for (int64_t first = 0; first < bound.count; first += part) {
    int64_t count = std::min(part, bound.count - first);
    p.accelerator->download(copy.data(), bound.data + first * bound.size,
                            count * bound.size);
    p.accelerator->finishStream();
    if (!body(copy.data(), first, count))
      return;
  }
}

static uint64_t findLargest(pikort_pipeline &p, const Contract &contract,
                            const Fed &bound) {
  uint64_t largest = 0;
  std::vector<Run> runs = findRuns(contract);
  forParts(p, bound, [&](const uint8_t *records, int64_t, int64_t count) {
    for (const Run &run : runs)
      largest = std::max(largest, largestOf(contract.terms.type, records, count,
                                            bound.size, run));
    return true;
  });
  return largest;
}

static std::string numberText(const ContractTerms &terms, uint64_t number) {
  bool isNegative = !terms.isUnsigned && number >= halfOf(terms.type);
  return isNegative ? std::to_string(
                          static_cast<int64_t>(number - 2 * halfOf(terms.type)))
                    : std::to_string(number);
}

/// What is said of the first number that is not below the limit.
static Failure describe(pikort_pipeline &p, const Contract &contract,
                        const Fed &bound, uint64_t limit, int64_t below) {
  const ContractTerms &terms = contract.terms;
  const State *target = terms.target < 0 ? nullptr : &p.states[terms.target];
  std::string expected =
      (target ? " to be an index into " + quoted(target->name) + ", in [0, "
              : " in [0, ") +
      std::to_string(below) + "), but got ";
  std::string text;
  auto say = [&](int64_t record, const ContractField &field, int64_t element,
                 uint64_t number) {
    std::string name = field.name;
    if (field.elements > 1)
      name += "[" + std::to_string(element) + "]";
    // What is a number itself has this one field.
    std::string of =
        field.name == "value" ? "" : "field " + quoted(name) + " of ";
    std::string which = std::to_string(record);
    text = terms.source < 0
               ? "buffer " + quoted(p.states[terms.state].name) +
                     ": expected " + of + "element " + which
               : "stage " +
                     quoted(p.stages[p.sources[terms.source].stage].name) +
                     ": expected " + of + "primitive " + which + " of source " +
                     std::to_string(terms.source);
    text += expected + numberText(terms, number);
  };
  forParts(p, bound, [&](const uint8_t *records, int64_t first, int64_t count) {
    for (int64_t i = 0; i < count && text.empty(); ++i)
      for (const ContractField &field : contract.fields)
        for (int64_t j = 0; j < field.elements && text.empty(); ++j) {
          uint64_t number =
              largestOf(terms.type, records + i * bound.size, 1, bound.size,
                        {field.offset + j * field.stride, 1});
          if (number >= limit)
            say(first + i, field, j, number);
        }
    return text.empty();
  });
  return {PIKORT_INDEX_OUTSIDE, text};
}

/// What a contract is about; and the version of what is bound.
static std::pair<Fed, int64_t> findBound(const pikort_pipeline &p,
                                         const ContractTerms &terms) {
  if (terms.source >= 0) {
    const Source &source = p.sources[terms.source];
    int64_t size = p.records[p.hostRecord(source.stage)].size;
    return {{source.data, source.count, size, source.onDevice}, source.version};
  }
  const State &state = p.states[terms.state];
  return {{state.view.data, state.view.extent[0], p.records[state.record].size,
           state.onDevice},
          state.version};
}

static bool isChecking(const pikort_pipeline &p) {
  return std::any_of(p.records.begin(), p.records.end(),
                     [](const Record &record) { return record.host >= 0; });
}

bool Contracts::check(pikort_pipeline &p) {
  bool hasLooked = false;
  bool again = !contracts.empty() && isChecking(p);
  for (Contract &contract : contracts) {
    const ContractTerms &terms = contract.terms;
    int64_t below = terms.below;
    if (terms.target >= 0) {
      const State &target = p.states[terms.target];
      if (!target.bound && target.perSource < 0)
        continue; // nothing uses it
      below = target.perSource < 0 ? target.view.extent[0]
                                   : p.sources[target.perSource].count;
    }
    auto [bound, version] = findBound(p, terms);
    if (contract.version != version || again) {
      if (terms.state >= 0 && p.states[terms.state].owned)
        bringToHost(p, p.states[terms.state]);
      contract.largest = findLargest(p, contract, bound);
      hasLooked = true;
    }
    contract.version = version;
    uint64_t limit = terms.isUnsigned ? static_cast<uint64_t>(below)
                                      : std::min(static_cast<uint64_t>(below),
                                                 halfOf(terms.type));
    if (bound.count > 0 && contract.largest >= limit)
      throw describe(p, contract, bound, limit, below);
  }
  return hasLooked;
}
