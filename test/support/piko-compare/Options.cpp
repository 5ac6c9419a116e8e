// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Options.h"

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

template <class T> std::vector<T> toNumbers(std::vector<std::string> values) {
  std::vector<T> numbers;
  for (const std::string &value : values)
    numbers.push_back(T(std::stoll(value)));
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
  else if (name == "--wide")
    into.wide = true;
  else
    return false;
  return true;
}

} // namespace

Options parseOptions(int argc, char **argv) {
  Options options;
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
      options.synthesis = *synthesis;
    } else if (name == "--mapping-window")
      options.mappingWindow = std::stod(words.takeValues(name, false)[0]);
    else if (name == "--target") {
      auto target = piko::parseGPUTarget(words.takeValues(name, false)[0]);
      if (!target || *target == piko::GPUTarget::Auto)
        throw std::runtime_error("expected --target cpu, cuda or gpu-on-cpu");
      options.gpu.target = *target;
    } else if (name == "--gpu-threads")
      options.gpu.threads =
          toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--gpu-chip") {
      if (!options.gpu.setChips(words.takeValues(name, false)[0]))
        throw std::runtime_error("expected --gpu-chip sm_90,..");
    } else if (name == "--gpu-seed")
      options.gpu.seed = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--gpu-blocks")
      options.gpu.blocks = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--threads")
      options.threads = toNumbers<int>(words.takeValues(name, true));
    else if (name == "--runs")
      options.runs = toNumbers<int>(words.takeValues(name, false))[0];
    else if (name == "--strip")
      options.strip = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--budget")
      options.budget = toNumbers<int64_t>(words.takeValues(name, false))[0];
    else if (name == "--timeout")
      options.timeout = toNumbers<unsigned>(words.takeValues(name, false))[0];
    else if (name == "--cpu")
      options.cpu = words.takeValues(name, false)[0];
    else if (name == "--tolerance")
      options.tolerance = std::stod(words.takeValues(name, false)[0]);
    else if (name == "--owners")
      options.owners = true;
    else if (name == "--no-cache")
      options.cache.enabled = false;
    else if (!readCaseOption(name, words, options.one))
      throw std::runtime_error("unknown option " + name);
  }
  if (options.mappingWindow)
    options.synthesis.mappingWindow = *options.mappingWindow;
  if (options.file.empty())
    throw std::runtime_error("expected a file");
  if (options.reference.empty())
    options.reference = options.file;
  return options;
}

std::vector<Case> readCases(const std::string &file) {
  std::ifstream stream(file);
  if (!stream)
    throw std::runtime_error("cannot open " + file);
  std::vector<Case> cases;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream text(line);
    std::vector<std::string> list;
    for (std::string word; text >> word;)
      list.push_back(word);
    Words words(list);
    Case read;
    while (!words.atEnd()) {
      std::string name = words.take();
      if (!readCaseOption(name, words, read))
        throw std::runtime_error("unknown option " + name + " of a case");
    }
    cases.push_back(read);
  }
  return cases;
}
