// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- compiler.hpp - The compiler for hosts, in C++ ----------------------===//
//
// A thin owner of what compiler.h has.
//
//   piko::Compiler compiler;
//   compiler.file("draw.piko.cpp");
//   compiler.option("pipe", "DrawPipe");
//   piko::Program program = compiler.load();
//   if (!program)
//     std::cerr << compiler.diagnostics();
//   else
//     piko::rt::Pipeline pipe(*program.get());
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_C_COMPILER_HPP
#define PIKO_C_COMPILER_HPP

#include "piko-c/compiler.h"

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace piko {

/// A loaded program, which must outlive the pipelines that are made of it; or
/// none.
class Program {
public:
  Program() = default;
  explicit Program(piko_program *program) : handle(program) {}

  explicit operator bool() const { return handle != nullptr; }
  const pikort_program *get() const { return piko_get_program(handle.get()); }
  double loadMilliseconds() const {
    return piko_load_milliseconds(handle.get());
  }
  uint64_t codeHash() const { return piko_code_hash(handle.get()); }

private:
  struct Release {
    void operator()(piko_program *program) const {
      piko_release_program(program);
    }
  };
  std::unique_ptr<piko_program, Release> handle;
};

/// Functions that return a status, or nothing, leave why in diagnostics().
class Compiler {
public:
  Compiler() {
    piko_compiler *made = nullptr;
    piko_create_compiler(&made); // without memory there is none: all fails
    handle.reset(made);
  }

  /// For the C functions; still owned by this object.
  piko_compiler *get() const { return handle.get(); }
  std::string diagnostics() const { return piko_diagnostics(get()); }

  int32_t file(const std::string &path) {
    return piko_set_file(get(), path.c_str());
  }
  int32_t text(const std::string &name, std::string_view text) {
    return piko_set_text(get(), name.c_str(), text.data(), text.size());
  }
  int32_t option(const std::string &name, const std::string &value) {
    return piko_set_option(get(), name.c_str(), value.c_str());
  }

  std::optional<std::vector<std::string>> pipelines() {
    const char *const *names = nullptr;
    size_t count = 0;
    if (piko_list_pipelines(get(), &names, &count) != PIKO_OK)
      return std::nullopt;
    return std::vector<std::string>(names, names + count);
  }
  /// Valid until the next call.
  std::optional<std::vector<piko_tunable>> tunables() {
    const piko_tunable *tunables = nullptr;
    size_t count = 0;
    if (piko_list_tunables(get(), &tunables, &count) != PIKO_OK)
      return std::nullopt;
    return std::vector<piko_tunable>(tunables, tunables + count);
  }
  std::optional<std::string> emit(const std::string &level) {
    piko_bytes text = {nullptr, 0};
    if (piko_emit(get(), level.c_str(), &text) != PIKO_OK)
      return std::nullopt;
    return std::string(text.data, text.size);
  }
  /// Valid until the next call.
  std::optional<piko_object> compile() {
    piko_object object = {};
    if (piko_compile(get(), &object) != PIKO_OK)
      return std::nullopt;
    return object;
  }
  Program load() {
    piko_program *program = nullptr;
    piko_load(get(), &program);
    return Program(program);
  }

private:
  struct Destroy {
    void operator()(piko_compiler *compiler) const {
      piko_destroy_compiler(compiler);
    }
  };
  std::unique_ptr<piko_compiler, Destroy> handle;
};

} // namespace piko

#endif // PIKO_C_COMPILER_HPP
