// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Options.h"

#include "Piko/Target/Processor.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace {

/// The words of a command line, or of a line of a file of cases.
class Words {
public:
  explicit Words(std::vector<std::string> words) : words(std::move(words)) {}

  bool atEnd() const { return next == words.size(); }
  const std::string &take() { return words[next++]; }

  /// The values that follow an option.
  std::vector<std::string> takeValues(const std::string &option, bool several) {
    std::vector<std::string> values;
    while (!atEnd() && !isOption(words[next]) && (several || values.empty()))
      values.push_back(take());
    if (values.empty())
      throw std::runtime_error(option + " lacks its value");
    return values;
  }

private:
  static bool isOption(const std::string &word) {
    return word.rfind("--", 0) == 0 || word.rfind("-O", 0) == 0;
  }

  std::vector<std::string> words;
  size_t next = 0;
};

template <class T> T toNumber(const std::string &value) {
  T number{};
  const char *end = value.data() + value.size();
  auto [after, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || after != end)
    throw std::runtime_error("expected a number, but got '" + value + "'");
  return number;
}

template <class T> std::vector<T> toNumbers(std::vector<std::string> values) {
  std::vector<T> numbers;
  for (const std::string &value : values)
    numbers.push_back(toNumber<T>(value));
  return numbers;
}

/// True if the option was one that a case has.
bool readCaseOption(const std::string &name, Words &words, Case &into) {
  if (name == "--pipe")
    into.pipe = words.takeValues(name, false)[0];
  else if (name == "--domain")
    into.domain = toNumbers<int64_t>(words.takeValues(name, true));
  else if (name == "--count")
    into.counts = toNumbers<int64_t>(words.takeValues(name, true));
  else if (name == "--seed")
    into.seed = toNumbers<unsigned>(words.takeValues(name, false))[0];
  else if (name == "--loop-limit")
    into.loopLimit = toNumbers<int64_t>(words.takeValues(name, false))[0];
  else if (name == "--strip")
    into.strip = toNumbers<int64_t>(words.takeValues(name, false))[0];
  else if (name == "--budget")
    into.budget = toNumbers<int64_t>(words.takeValues(name, false))[0];
  else if (name == "--wide")
    into.wide = true;
  else
    return false;
  return true;
}

/// A name of --targets, with the options for a GPU that all of them share.
Target readTarget(const std::string &name, const piko::GPUOptions &gpu) {
  Target target{name, "native", gpu};
  if (auto kind = piko::parseGPUTarget(name);
      kind && *kind != piko::GPUTarget::Auto) {
    target.gpu.target = *kind;
    return target;
  }
  target.cpu = name;
  llvm::Expected<piko::Processor> processor = piko::resolveProcessor(name);
  if (name.empty() || !processor)
    throw std::runtime_error(
        "expected --targets with cpu, gpu-on-cpu, cuda or names of processors "
        "between commas, but got '" +
        name + "'" +
        (processor ? "" : ": " + llvm::toString(processor.takeError())));
  return target;
}

/// Those of --targets, or the one of --target and --cpu.
std::vector<Target> readTargets(const std::optional<std::string> &names,
                                const Target &one) {
  if (!names)
    return {one};
  if (one.gpu.target != piko::GPUTarget::None || one.cpu != Target().cpu)
    throw std::runtime_error(
        "expected --targets, or --target and --cpu, but got both");
  std::vector<Target> targets;
  for (size_t begin = 0; begin <= names->size();) {
    size_t end = std::min(names->find(',', begin), names->size());
    std::string name = names->substr(begin, end - begin);
    if (std::any_of(targets.begin(), targets.end(),
                    [&](const Target &t) { return t.name == name; }))
      throw std::runtime_error("expected each of --targets once, but got '" +
                               name + "' twice");
    targets.push_back(readTarget(name, one.gpu));
    begin = end + 1;
  }
  return targets;
}

} // namespace

Options parseOptions(int argc, char **argv) {
  Options options;
  Target one;
  std::optional<std::string> targets;
  Words words({argv + 1, argv + argc});
  while (!words.atEnd()) {
    std::string name = words.take();
    if (name.size() == 3 && name.rfind("-O", 0) == 0 && name[2] >= '0' &&
        name[2] <= '3')
      options.optLevel = name[2] - '0';
    else if (name.rfind("--", 0) != 0)
      options.file = name;
    else if (name == "--check" || name.rfind("--check=", 0) == 0) {
      auto check = piko::parseCheckOptions(name.substr(7));
      if (!check)
        throw std::runtime_error("expected --check[=nan:RECORD.FIELD,..]");
      options.check = *check;
    } else if (name == "--reference")
      options.reference = words.takeValues(name, false)[0];
    else if (name == "--cases")
      options.cases = words.takeValues(name, false)[0];
    else if (name == "--without") {
      std::string text = words.takeValues(name, false)[0];
      auto synthesis = piko::parseSynthesisOptions(text);
      if (!synthesis)
        throw std::runtime_error(piko::describeWrongSynthesisOptions(text));
      options.synthesis.without = synthesis->without;
    } else if (name == "--targets")
      targets = words.takeValues(name, false)[0];
    else if (name == "--mapping-window")
      options.synthesis.mappingWindow =
          toNumber<double>(words.takeValues(name, false)[0]);
    else if (name == "--target") {
      auto target = piko::parseGPUTarget(words.takeValues(name, false)[0]);
      if (!target || *target == piko::GPUTarget::Auto)
        throw std::runtime_error("expected --target cpu, cuda or gpu-on-cpu");
      one.gpu.target = *target;
    } else if (name == "--gpu-threads")
      one.gpu.threads = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--gpu-chip") {
      if (!one.gpu.setChips(words.takeValues(name, false)[0]))
        throw std::runtime_error("expected --gpu-chip sm_90,..");
    } else if (name == "--gpu-seed")
      one.gpu.seed = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--gpu-blocks")
      one.gpu.blocks = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--threads")
      options.threads = toNumbers<int>(words.takeValues(name, true));
    else if (name == "--runs")
      options.runs = toNumbers<int>(words.takeValues(name, false))[0];
    else if (name == "--timeout")
      options.timeout = toNumbers<unsigned>(words.takeValues(name, false))[0];
    else if (name == "--cpu")
      one.cpu = words.takeValues(name, false)[0];
    else if (name == "--tolerance")
      options.tolerance = toNumber<double>(words.takeValues(name, false)[0]);
    else if (name == "--stops")
      options.stops = true;
    else if (name == "--spread")
      options.spread = true;
    else if (name == "--owners")
      options.owners = true;
    else if (name == "--no-cache")
      options.cache.enabled = false;
    else if (!readCaseOption(name, words, options.one))
      throw std::runtime_error("unknown option " + name);
  }
  if (options.file.empty())
    throw std::runtime_error("expected a file");
  if (options.reference.empty())
    options.reference = options.file;
  options.targets = readTargets(targets, one);
  return options;
}

bool hasOwnCases(const Options &options) {
  return options.cases.ends_with(".cpp") || options.cases.ends_with(".mlir");
}

std::vector<Case> readCases(const Options &options) {
  std::ifstream stream(options.cases);
  if (!stream)
    throw std::runtime_error("cannot open " + options.cases);
  const std::string mark = hasOwnCases(options) ? "// CASE: " : "";
  std::vector<Case> cases;
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(mark))
      continue;
    std::istringstream text(line.substr(mark.size()));
    std::vector<std::string> list;
    for (std::string word; text >> word;)
      list.push_back(word);
    Words words(list);
    Case read = options.one;
    while (!words.atEnd()) {
      std::string name = words.take();
      if (!readCaseOption(name, words, read))
        throw std::runtime_error("unknown option " + name + " of a case");
    }
    cases.push_back(read);
  }
  if (cases.empty())
    throw std::runtime_error("expected a case in " + options.cases);
  return cases;
}
