// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Mappings.cpp - What the host says of the versions of loops ---------===//

#include "common/HostCalls.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

using namespace piko::rt;

namespace {

/// Reads a setting, as "expected,Shade:0=vectors".
class SettingReader {
public:
  explicit SettingReader(const pikort_pipeline &p) : p_(p) {
    for (const Mapping &mapping : p.mappings)
      choices.push_back(mapping.choice);
  }
  void read(std::string_view text);

  std::vector<MappingChoice> choices; ///< Of each mapping.

private:
  void readEntry(std::string_view entry);
  MappingChoice readChoice(std::string_view entry, std::string_view word);
  [[noreturn]] void fail(const std::string &expected, std::string_view got) {
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "pipeline " + quoted(p_.name) + ": mappings: expected " +
                      expected + ", but got " + quoted(std::string(got))};
  }
  std::string nameOf(const Mapping &mapping) const {
    return p_.kernelStats[mapping.kernel].name + ":" +
           std::to_string(mapping.number);
  }

  const pikort_pipeline &p_;
};

} // namespace

MappingChoice SettingReader::readChoice(std::string_view entry,
                                        std::string_view word) {
  constexpr std::pair<std::string_view, MappingChoice> words[] = {
      {"measured", MappingChoice::Measured},
      {"expected", MappingChoice::Expected},
      {"vectors", MappingChoice::Vectors},
      {"scalar", MappingChoice::Scalar}};
  for (auto [name, choice] : words)
    if (name == word)
      return choice;
  fail("'measured', 'expected', 'vectors' or 'scalar'", entry);
}

void SettingReader::readEntry(std::string_view entry) {
  size_t equals = entry.find('=');
  if (equals == entry.npos) {
    std::fill(choices.begin(), choices.end(), readChoice(entry, entry));
    return;
  }
  std::string_view name = entry.substr(0, equals);
  auto found = std::find_if(
      p_.mappings.begin(), p_.mappings.end(),
      [&](const Mapping &mapping) { return nameOf(mapping) == name; });
  if (found == p_.mappings.end()) {
    std::string names;
    for (const Mapping &mapping : p_.mappings)
      names += (names.empty() ? "" : ", ") + nameOf(mapping);
    fail(names.empty() ? "no loop by name, as the code holds none in two "
                         "versions"
                       : "one of " + names + " before '='",
         entry);
  }
  choices[static_cast<size_t>(found - p_.mappings.begin())] =
      readChoice(entry, entry.substr(equals + 1));
}

void SettingReader::read(std::string_view text) {
  while (true) {
    size_t comma = text.find(',');
    readEntry(text.substr(0, comma));
    if (comma == text.npos)
      return;
    text.remove_prefix(comma + 1);
  }
}

/// Has a choice hold from the next run on.
static void choose(pikort_pipeline &p,
                   const std::vector<MappingChoice> &choices) {
  for (size_t i = 0; i < choices.size(); ++i)
    p.mappings[i].choice = choices[i];
}

void pikort_pipeline::readMappingSetting() {
  const char *text = std::getenv("PIKO_MAPPINGS");
  // It is for all pipelines of a process: what has no choice takes no part.
  if (!text || !*text || mappings.empty())
    return;
  SettingReader reader(*this);
  try {
    reader.read(text);
  } catch (Failure &failure) {
    failure.message = "$PIKO_MAPPINGS: " + failure.message;
    throw;
  }
  choose(*this, reader.choices);
}

extern "C" int32_t pikort_set_mappings(pikort_pipeline *p,
                                       const char *setting) {
  return call(p, [&] {
    if (!setting)
      invalid("expected a setting of mappings, but got null");
    SettingReader reader(*p);
    reader.read(setting);
    change(p,
           [p, choices = std::move(reader.choices)] { choose(*p, choices); });
  });
}
