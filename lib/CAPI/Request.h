// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a host has asked of a compiler, by options that have names.

#ifndef PIKO_LIB_CAPI_REQUEST_H
#define PIKO_LIB_CAPI_REQUEST_H

#include "Piko/Driver/Inspect.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Driver/PipelineLoader.h"
#include "Piko/Driver/TunedSetting.h"

#include <optional>
#include <string>

namespace piko {

struct Request {
  CompileOptions source = {};
  ExecutionTarget execution = ExecutionTarget::CPU;
  std::optional<std::string> cpu = {};
  int optLevel = 3;
  std::string nameSpace = defaultNamespace;
  bool remarks = false;
  std::optional<TunedSetting> tuned = {};

  /// The three kinds of options with what was tuned; what is wrong with that is
  /// in `error`.
  LoadOptions getLoadOptions(std::string &error) const;
  ObjectOptions getObjectOptions(std::string &error) const;
  TextOptions getTextOptions(TextKind kind, std::string &error) const;

private:
  CompileOptions getSource(std::string &error) const;
};

/// Sets an option; returns what is wrong, or nothing.
std::string setOption(Request &request, const std::string &name,
                      const std::string &value);
/// Sets it to its default; returns what is wrong, or nothing.
std::string resetOption(Request &request, const std::string &name);
/// Null where there are no more.
const char *getOptionName(int index);

} // namespace piko

#endif // PIKO_LIB_CAPI_REQUEST_H
