// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Options by their names.

#include "Request.h"

#include <charconv>

using namespace piko;

//===----------------------------------------------------------------------===//
// Values
//===----------------------------------------------------------------------===//

static std::string expected(const std::string &what, const std::string &value) {
  return "expected " + what + ", but got '" + value + "'";
}

/// A number in [least, most]; returns what is wrong, or nothing.
template <class T>
static std::string readNumber(const std::string &value, T least, T most,
                              const std::string &what, T &number) {
  T read{};
  const char *end = value.data() + value.size();
  auto [stop, error] = std::from_chars(value.data(), end, read);
  if (error != std::errc() || stop != end || !(least <= read && read <= most))
    return expected(what, value);
  number = read;
  return "";
}

static std::string readSwitch(const std::string &value, bool &isOn) {
  if (value != "on" && value != "off")
    return expected("on or off", value);
  isOn = value == "on";
  return "";
}

/// NAME=VALUE into two.
static std::string readSetting(const std::string &value,
                               TunableSettings &settings) {
  size_t equals = value.find('=');
  if (equals == std::string::npos || equals == 0)
    return expected("NAME=VALUE", value);
  settings.emplace_back(value.substr(0, equals), value.substr(equals + 1));
  return "";
}

static std::string setTarget(Request &request, const std::string &value) {
  bool isReference = value == "reference";
  auto gpu = isReference ? GPUTarget::None : parseGPUTarget(value);
  if (!gpu)
    return expected("cpu, reference, gpu-on-cpu, cuda or auto", value);
  request.execution =
      isReference ? ExecutionTarget::Reference : ExecutionTarget::CPU;
  request.source.gpu.target = *gpu;
  return "";
}

static std::string setTuned(Request &request, const std::string &value) {
  std::string error;
  auto setting = readTunedSetting(value, error);
  if (setting)
    request.tuned = std::move(*setting);
  return error;
}

static std::string setCheck(Request &request, const std::string &value) {
  auto check = value == "off"
                   ? CheckOptions()
                   : parseCheckOptions(value == "on" ? "" : "=" + value);
  if (!check)
    return expected("off, on or nan:RECORD.FIELD,...", value);
  request.source.check = std::move(*check);
  return "";
}

static std::string setWithout(Request &request, const std::string &value) {
  std::vector<std::string> names;
  if (!value.empty()) {
    auto options = parseSynthesisOptions(value);
    if (!options)
      return describeWrongSynthesisOptions(value);
    names = std::move(options->without);
  }
  request.source.synthesis.without = std::move(names);
  return "";
}

static std::string setCount(Request &request, const std::string &value) {
  Counting &count = request.source.synthesis.count;
  if (value == "none")
    count = Counting::None;
  else if (value == "work")
    count = Counting::Work;
  else if (value == "lanes")
    count = Counting::Lanes;
  else
    return expected("none, work or lanes", value);
  return "";
}

static std::string setGPUThreads(Request &request, const std::string &value) {
  const char *what = "0, or a power of two up to 1024";
  int64_t threads = 0;
  std::string wrong = readNumber<int64_t>(value, 0, 1024, what, threads);
  if (wrong.empty() && (threads & (threads - 1)) != 0)
    return expected(what, value);
  if (wrong.empty())
    request.source.gpu.threads = threads;
  return wrong;
}

static std::string setChips(Request &request, const std::string &value) {
  GPUOptions chosen;
  if (!chosen.setChips(value))
    return expected("names such as sm_90 between commas", value);
  request.source.gpu.chip = chosen.chip;
  request.source.gpu.cubins = chosen.cubins;
  return "";
}

//===----------------------------------------------------------------------===//
// Names
//===----------------------------------------------------------------------===//

namespace {

struct Option {
  const char *name;
  /// Returns what is wrong with a value, or nothing.
  std::string (*set)(Request &request, const std::string &value);
  /// Takes it from another request.
  void (*copy)(Request &to, const Request &from);
};

} // namespace

static constexpr int64_t most = INT64_MAX;

static const Option options[] = {
    {"pipe",
     [](Request &r, const std::string &value) {
       r.source.pipeName = value;
       return std::string();
     },
     [](Request &r, const Request &from) {
       r.source.pipeName = from.source.pipeName;
     }},
    {"target", setTarget,
     [](Request &r, const Request &from) {
       r.execution = from.execution;
       r.source.gpu.target = from.source.gpu.target;
     }},
    {"include-dir",
     [](Request &r, const std::string &value) {
       r.source.includeDirs.push_back(value);
       return std::string();
     },
     [](Request &r, const Request &from) {
       r.source.includeDirs = from.source.includeDirs;
     }},
    {"define",
     [](Request &r, const std::string &value) {
       if (value.empty() || value[0] == '=')
         return expected("NAME or NAME=VALUE", value);
       r.source.defines.push_back(value);
       return std::string();
     },
     [](Request &r, const Request &from) {
       r.source.defines = from.source.defines;
     }},
    {"tunable",
     [](Request &r, const std::string &value) {
       return readSetting(value, r.source.tunables);
     },
     [](Request &r, const Request &from) {
       r.source.tunables = from.source.tunables;
     }},
    {"tuned", setTuned,
     [](Request &r, const Request &from) { r.tuned = from.tuned; }},
    {"cpu",
     [](Request &r, const std::string &value) {
       r.cpu = value;
       return std::string();
     },
     [](Request &r, const Request &from) { r.cpu = from.cpu; }},
    {"opt-level",
     [](Request &r, const std::string &value) {
       return readNumber(value, 0, 3, "0 to 3", r.optLevel);
     },
     [](Request &r, const Request &from) { r.optLevel = from.optLevel; }},
    {"check", setCheck,
     [](Request &r, const Request &from) {
       r.source.check = from.source.check;
     }},
    {"without", setWithout,
     [](Request &r, const Request &from) {
       r.source.synthesis.without = from.source.synthesis.without;
     }},
    {"fix",
     [](Request &r, const std::string &value) {
       r.source.synthesis.fix.push_back(value);
       return std::string();
     },
     [](Request &r, const Request &from) {
       r.source.synthesis.fix = from.source.synthesis.fix;
     }},
    {"directive",
     [](Request &r, const std::string &value) {
       r.source.synthesis.directives.push_back(value);
       return std::string();
     },
     [](Request &r, const Request &from) {
       r.source.synthesis.directives = from.source.synthesis.directives;
     }},
    {"count", setCount,
     [](Request &r, const Request &from) {
       r.source.synthesis.count = from.source.synthesis.count;
     }},
    {"mapping-window",
     [](Request &r, const std::string &value) {
       return readNumber(value, 1.0, 1000.0, "a factor in [1, 1000]",
                         r.source.synthesis.mappingWindow);
     },
     [](Request &r, const Request &from) {
       r.source.synthesis.mappingWindow = from.source.synthesis.mappingWindow;
     }},
    {"gpu-threads", setGPUThreads,
     [](Request &r, const Request &from) {
       r.source.gpu.threads = from.source.gpu.threads;
     }},
    {"gpu-blocks",
     [](Request &r, const std::string &value) {
       return readNumber(value, int64_t(0), most, "a number of at least 0",
                         r.source.gpu.blocks);
     },
     [](Request &r, const Request &from) {
       r.source.gpu.blocks = from.source.gpu.blocks;
     }},
    {"gpu-seed",
     [](Request &r, const std::string &value) {
       return readNumber(value, int64_t(0), most, "a number of at least 0",
                         r.source.gpu.seed);
     },
     [](Request &r, const Request &from) {
       r.source.gpu.seed = from.source.gpu.seed;
     }},
    {"gpu-chip", setChips,
     [](Request &r, const Request &from) {
       r.source.gpu.chip = from.source.gpu.chip;
       r.source.gpu.cubins = from.source.gpu.cubins;
     }},
    {"namespace",
     [](Request &r, const std::string &value) {
       r.nameSpace = value;
       return std::string();
     },
     [](Request &r, const Request &from) { r.nameSpace = from.nameSpace; }},
    {"cache",
     [](Request &r, const std::string &value) {
       return readSwitch(value, r.source.cache.enabled);
     },
     [](Request &r, const Request &from) {
       r.source.cache.enabled = from.source.cache.enabled;
     }},
    {"cache-dir",
     [](Request &r, const std::string &value) {
       r.source.cache.directory = value;
       return std::string();
     },
     [](Request &r, const Request &from) {
       r.source.cache.directory = from.source.cache.directory;
     }},
    {"cache-size",
     [](Request &r, const std::string &value) {
       return readNumber(value, uint64_t(0), UINT64_MAX, "a number of bytes",
                         r.source.cache.maxBytes);
     },
     [](Request &r, const Request &from) {
       r.source.cache.maxBytes = from.source.cache.maxBytes;
     }},
    {"remarks",
     [](Request &r, const std::string &value) {
       return readSwitch(value, r.remarks);
     },
     [](Request &r, const Request &from) { r.remarks = from.remarks; }},
};

static const Option *findOption(const std::string &name) {
  for (const Option &option : options)
    if (name == option.name)
      return &option;
  return nullptr;
}

static std::string describeUnknown(const std::string &name) {
  std::string text = "there is no option '" + name + "'; expected one of";
  for (const Option &option : options)
    text += std::string(&option == options ? " " : ", ") + option.name;
  return text;
}

std::string piko::setOption(Request &request, const std::string &name,
                            const std::string &value) {
  const Option *option = findOption(name);
  if (!option)
    return describeUnknown(name);
  std::string wrong = option->set(request, value);
  return wrong.empty() ? "" : "option '" + name + "': " + wrong;
}

std::string piko::resetOption(Request &request, const std::string &name) {
  const Option *option = findOption(name);
  if (!option)
    return describeUnknown(name);
  option->copy(request, Request());
  return "";
}

const char *piko::getOptionName(int index) {
  bool exists = index >= 0 && index < static_cast<int>(std::size(options));
  return exists ? options[index].name : nullptr;
}

//===----------------------------------------------------------------------===//
// Requests
//===----------------------------------------------------------------------===//

CompileOptions Request::getSource(std::string &error) const {
  CompileOptions options = source;
  if (tuned)
    error = tuned->apply(options.pipeName, options.tunables, options.synthesis);
  if (!error.empty())
    error = "option 'tuned': " + error;
  return options;
}

LoadOptions Request::getLoadOptions(std::string &error) const {
  CompileOptions options = getSource(error);
  return {.pipeName = options.pipeName,
          .target = execution,
          .includeDirs = options.includeDirs,
          .defines = options.defines,
          .tunables = options.tunables,
          .cache = options.cache,
          .check = options.check,
          .synthesis = options.synthesis,
          .gpu = options.gpu,
          .cpu = cpu.value_or("native"),
          .optLevel = optLevel};
}

ObjectOptions Request::getObjectOptions(std::string &error) const {
  ObjectOptions options{
      .source = getSource(error),
      .execution = execution,
      .target = {.cpu = cpu.value_or(""), .optLevel = optLevel},
      .nameSpace = nameSpace,
      .remarks = remarks};
  options.target = options.target.leaveOut(options.source.synthesis);
  return options;
}

TextOptions Request::getTextOptions(TextKind kind, std::string &error) const {
  TextOptions options{
      .source = getSource(error),
      .kind = kind,
      .target = {.cpu = cpu.value_or("native"), .optLevel = optLevel},
      .remarks = remarks};
  if (kind == TextKind::PTX) {
    const GPUOptions &gpu = source.gpu;
    options.target.cpu = gpu.cubins.empty() ? "" : gpu.chip;
  }
  return options;
}
