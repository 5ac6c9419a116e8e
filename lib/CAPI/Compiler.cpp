// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The compiler for hosts, in C.

#include "piko-c/compiler.h"

#include "Request.h"

#include "Piko/Driver/DeepStack.h"

#include <new>
#include <string_view>

using namespace piko;

struct piko_compiler {
  Request request;
  std::string diagnostics;

  // What the latest call has given back:
  std::vector<std::string> names;
  std::vector<Tunable> tunables;
  std::string text;
  CompiledObject object;
  /// Pointers to these.
  std::vector<const char *> pointers;
  std::vector<piko_tunable> infos;
};

struct piko_program {
  std::unique_ptr<LoadedProgram> loaded;
};

//===----------------------------------------------------------------------===//
// Calls
//===----------------------------------------------------------------------===//

static int32_t fail(piko_compiler &compiler, int32_t status,
                    const std::string &text) {
  compiler.diagnostics += "error: " + text + "\n";
  return status;
}

static int32_t invalid(piko_compiler &compiler, const std::string &text) {
  return fail(compiler, PIKO_INVALID_ARGUMENT, text);
}

/// Calls `body`, which returns a status and may find no memory.
template <class Body>
static int32_t call(piko_compiler *compiler, Body body) noexcept {
  if (!compiler)
    return PIKO_INVALID_ARGUMENT;
  try {
    compiler->diagnostics.clear();
    return body(*compiler);
  } catch (...) {
    return PIKO_OUT_OF_MEMORY;
  }
}

/// Calls `work`, which gives something or diagnostics, with a stack that is
/// deep enough, and lives on where LLVM fails.
template <class T, class Work>
static int32_t contain(piko_compiler &compiler, T &result, Work work) {
  auto failed = runContained([&] { result = work(compiler.diagnostics); });
  if (failed)
    return fail(compiler, PIKO_NOT_COMPILED, *failed);
  return result ? PIKO_OK : PIKO_NOT_COMPILED;
}

/// What is wrong with a request before it is compiled; PIKO_OK if nothing.
static int32_t checkRequest(piko_compiler &compiler,
                            const std::string &tunedError, bool loads) {
  const CompileOptions &source = compiler.request.source;
  if (source.file.empty())
    return invalid(compiler, "expected a file or a text to compile");
  if (!loads && !source.text && isPipelineLibrary(source.file))
    return invalid(compiler, "expected the text of a pipeline, but '" +
                                 source.file + "' is a library");
  return tunedError.empty() ? PIKO_OK : invalid(compiler, tunedError);
}

static const char *const *pointTo(piko_compiler &compiler,
                                  const std::vector<std::string> &texts) {
  compiler.pointers.clear();
  for (const std::string &text : texts)
    compiler.pointers.push_back(text.c_str());
  compiler.pointers.push_back(nullptr);
  return compiler.pointers.data();
}

static piko_bytes bytesOf(const std::string &text) {
  return {text.c_str(), text.size()};
}

//===----------------------------------------------------------------------===//
// Looking at a text
//===----------------------------------------------------------------------===//

static const char *const levels[] = {
    "authored", "kernels",  "machine", "target", "llvm",
    "llvmir",   "assembly", "gpu",     "ptx",    "report"};
static_assert(std::size(levels) == size_t(TextKind::Report) + 1);

static int32_t emit(piko_compiler &compiler, std::string_view level,
                    piko_bytes *text) {
  size_t kind = 0;
  while (kind < std::size(levels) && level != levels[kind])
    ++kind;
  if (kind == std::size(levels)) {
    std::string wrong =
        "there is no level '" + std::string(level) + "'; expected one of";
    for (const char *name : levels)
      wrong += std::string(name == levels[0] ? " " : ", ") + name;
    return invalid(compiler, wrong);
  }
  if (compiler.request.execution == ExecutionTarget::Reference)
    return invalid(compiler, "the reference executor has no levels");
  std::string error;
  TextOptions options =
      compiler.request.getTextOptions(static_cast<TextKind>(kind), error);
  if (int32_t status = checkRequest(compiler, error, /*loads=*/false))
    return status;
  std::optional<std::string> made;
  int32_t status = contain(compiler, made, [&](std::string &diagnostics) {
    return writeText(options, diagnostics);
  });
  if (status != PIKO_OK)
    return status;
  compiler.text = std::move(*made);
  *text = bytesOf(compiler.text);
  return PIKO_OK;
}

static int32_t findPipelines(piko_compiler &compiler) {
  std::string error;
  ObjectOptions options = compiler.request.getObjectOptions(error);
  if (int32_t status = checkRequest(compiler, error, /*loads=*/false))
    return status;
  std::optional<std::vector<std::string>> found;
  int32_t status = contain(compiler, found, [&](std::string &diagnostics) {
    return listPipelines(options.source, diagnostics);
  });
  if (status == PIKO_OK)
    compiler.names = std::move(*found);
  return status;
}

static int32_t findTunables(piko_compiler &compiler) {
  // Whatever is chosen of them.
  const CompileOptions &source = compiler.request.source;
  if (int32_t status = checkRequest(compiler, "", /*loads=*/false))
    return status;
  std::optional<std::vector<Tunable>> found;
  int32_t status = contain(compiler, found, [&](std::string &diagnostics) {
    return listTunables(source, diagnostics);
  });
  if (status != PIKO_OK)
    return status;
  compiler.tunables = std::move(*found);
  size_t count = 0;
  for (const Tunable &tunable : compiler.tunables)
    count += tunable.values.size();
  compiler.pointers.clear();
  compiler.pointers.reserve(count); // infos point into it
  compiler.infos.clear();
  for (const Tunable &tunable : compiler.tunables) {
    const char *const *values =
        compiler.pointers.data() + compiler.pointers.size();
    for (const std::string &value : tunable.values)
      compiler.pointers.push_back(value.c_str());
    compiler.infos.push_back({tunable.name.c_str(), values,
                              tunable.values.size(), tunable.file.c_str(),
                              tunable.line, tunable.column});
  }
  return PIKO_OK;
}

//===----------------------------------------------------------------------===//
// Code
//===----------------------------------------------------------------------===//

static int32_t load(piko_compiler &compiler, piko_program **program) {
  std::string error;
  LoadOptions options = compiler.request.getLoadOptions(error);
  if (int32_t status = checkRequest(compiler, error, /*loads=*/true))
    return status;
  const CompileOptions &source = compiler.request.source;
  auto made = std::make_unique<piko_program>();
  made->loaded = source.text
                     ? loadPipelineText(source.file, *source.text, options,
                                        compiler.diagnostics)
                     : loadPipeline(source.file, options, compiler.diagnostics);
  if (!made->loaded)
    return PIKO_NOT_COMPILED;
  *program = made.release();
  return PIKO_OK;
}

static int32_t compile(piko_compiler &compiler, piko_object *object) {
  std::string error;
  ObjectOptions options = compiler.request.getObjectOptions(error);
  if (int32_t status = checkRequest(compiler, error, /*loads=*/false))
    return status;
  if (options.execution == ExecutionTarget::Reference)
    return invalid(compiler, "the reference executor is no object of its own; "
                             "compile the text as C++ for it");
  std::optional<CompiledObject> made;
  int32_t status = contain(compiler, made, [&](std::string &diagnostics) {
    return compileObject(options, diagnostics);
  });
  if (status != PIKO_OK)
    return status;
  const CompiledObject &kept = compiler.object = std::move(*made);
  *object = {kept.pipelines.front().c_str(),
             kept.symbol.c_str(),
             bytesOf(kept.code),
             bytesOf(kept.header),
             pointTo(compiler, kept.files),
             kept.files.size()};
  return PIKO_OK;
}

//===----------------------------------------------------------------------===//
// The interface
//===----------------------------------------------------------------------===//

extern "C" {

const char *piko_version(void) { return PIKO_VERSION; }

int32_t piko_create_compiler(piko_compiler **compiler) {
  if (!compiler)
    return PIKO_INVALID_ARGUMENT;
  *compiler = nullptr;
  try {
    *compiler = new piko_compiler;
    return PIKO_OK;
  } catch (...) {
    return PIKO_OUT_OF_MEMORY;
  }
}

void piko_destroy_compiler(piko_compiler *compiler) { delete compiler; }

const char *piko_diagnostics(const piko_compiler *compiler) {
  return compiler ? compiler->diagnostics.c_str() : "";
}

int32_t piko_set_file(piko_compiler *compiler, const char *path) {
  return call(compiler, [&](piko_compiler &c) {
    if (!path || !*path)
      return invalid(c, "expected the name of a file");
    if (std::string_view(path) == "-")
      return invalid(c, "expected the name of a file, not the standard input");
    c.request.source.file = path;
    c.request.source.text.reset();
    return int32_t(PIKO_OK);
  });
}

int32_t piko_set_text(piko_compiler *compiler, const char *name,
                      const char *text, size_t size) {
  return call(compiler, [&](piko_compiler &c) {
    if (!name || !*name || !text)
      return invalid(c, "expected a text and its name");
    c.request.source.text.emplace(text, size);
    c.request.source.file = name;
    return int32_t(PIKO_OK);
  });
}

int32_t piko_set_option(piko_compiler *compiler, const char *name,
                        const char *value) {
  return call(compiler, [&](piko_compiler &c) {
    if (!name || !value)
      return invalid(c, "expected an option's name and value");
    std::string wrong = setOption(c.request, name, value);
    return wrong.empty() ? int32_t(PIKO_OK) : invalid(c, wrong);
  });
}

int32_t piko_reset_option(piko_compiler *compiler, const char *name) {
  return call(compiler, [&](piko_compiler &c) {
    std::string wrong;
    if (name)
      wrong = resetOption(c.request, name);
    else
      for (int i = 0; const char *each = getOptionName(i); ++i)
        wrong += resetOption(c.request, each);
    return wrong.empty() ? int32_t(PIKO_OK) : invalid(c, wrong);
  });
}

const char *piko_option_name(int32_t index) { return getOptionName(index); }

const char *piko_tuned_mappings(const piko_compiler *compiler) {
  bool isTuned = compiler && compiler->request.tuned;
  return isTuned ? compiler->request.tuned->mappings.c_str() : "";
}

int64_t piko_tuned_strip_size(const piko_compiler *compiler) {
  bool isTuned = compiler && compiler->request.tuned;
  return isTuned ? compiler->request.tuned->stripSize : 0;
}

int32_t piko_list_pipelines(piko_compiler *compiler, const char *const **names,
                            size_t *count) {
  return call(compiler, [&](piko_compiler &c) {
    if (!names || !count)
      return invalid(c, "expected somewhere to put names and their count");
    *names = nullptr, *count = 0;
    int32_t status = findPipelines(c);
    if (status == PIKO_OK)
      *names = pointTo(c, c.names), *count = c.names.size();
    return status;
  });
}

int32_t piko_list_tunables(piko_compiler *compiler,
                           const piko_tunable **tunables, size_t *count) {
  return call(compiler, [&](piko_compiler &c) {
    if (!tunables || !count)
      return invalid(c, "expected somewhere to put tunables and their count");
    *tunables = nullptr, *count = 0;
    int32_t status = findTunables(c);
    if (status == PIKO_OK)
      *tunables = c.infos.data(), *count = c.infos.size();
    return status;
  });
}

int32_t piko_emit(piko_compiler *compiler, const char *level,
                  piko_bytes *text) {
  return call(compiler, [&](piko_compiler &c) {
    if (!level || !text)
      return invalid(c, "expected a level and somewhere to put its text");
    *text = {"", 0};
    return emit(c, level, text);
  });
}

int32_t piko_load(piko_compiler *compiler, piko_program **program) {
  return call(compiler, [&](piko_compiler &c) {
    if (!program)
      return invalid(c, "expected somewhere to put the program");
    *program = nullptr;
    return load(c, program);
  });
}

void piko_release_program(piko_program *program) { delete program; }

const pikort_program *piko_get_program(const piko_program *program) {
  return program ? &program->loaded->get() : nullptr;
}

double piko_load_milliseconds(const piko_program *program) {
  return program ? program->loaded->compileMilliseconds() : 0;
}

uint64_t piko_code_hash(const piko_program *program) {
  return program ? program->loaded->codeHash() : 0;
}

int32_t piko_compile(piko_compiler *compiler, piko_object *object) {
  return call(compiler, [&](piko_compiler &c) {
    if (!object)
      return invalid(c, "expected somewhere to put the object");
    *object = {"", "", {"", 0}, {"", 0}, nullptr, 0};
    return compile(c, object);
  });
}

} // extern "C"
