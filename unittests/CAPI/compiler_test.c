// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The compiler's C interface, each function and each kind of error.
//
//   compiler_test FOLDER CC
//
// The folder is for files; CC makes a shared library of an object.

#include "Check.h"

#include "piko-c/compiler.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

/// values[i] = FACTOR * i + offset, with a warning if WARN is defined.
static const char *const table =
    "#include <piko.h>\n"
    "constexpr int factor = piko::tunable(\"factor\", 3, 5, 7);\n"
    "constexpr bool twice = piko::tunable(\"twice\", false, true);\n"
    "struct State { int offset; piko::Buffer<int> values; };\n"
    "struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {\n"
    "  void process(const int &i) {\n"
    "    state().values[i] = factor * (twice ? 2 : 1) * i + state().offset;\n"
    "  }\n"
    "};\n"
    "struct Table : piko::Pipe<State> {\n"
    "  Set set;\n"
    "  Table() { source(set); }\n"
    "};\n"
    "#ifdef MORE\n"
    "struct More : Table {};\n"
    "#endif\n"
    "#ifdef WARN\n"
    "#warning mind the step\n"
    "#endif\n";

static const char *folder, *cc;

static char *pathOf(const char *name) {
  static char path[4096];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  return path;
}

static void writeFile(const char *path, const char *bytes, size_t size) {
  FILE *file = fopen(path, "wb");
  EXPECT(file && fwrite(bytes, 1, size, file) == size && fclose(file) == 0);
}

static piko_compiler *make(void) {
  piko_compiler *compiler = NULL;
  EXPECT_STATUS(PIKO_OK, piko_create_compiler(&compiler));
  return compiler;
}

static piko_compiler *makeOf(const char *text) {
  piko_compiler *compiler = make();
  EXPECT_STATUS(PIKO_OK,
                piko_set_text(compiler, "table.piko.cpp", text, strlen(text)));
  return compiler;
}

static void set(piko_compiler *compiler, const char *name, const char *value) {
  EXPECT_STATUS(PIKO_OK, piko_set_option(compiler, name, value));
}

/// values[2] of a run with offset 100; -1 after an error, which it says.
static int run(const pikort_program *program) {
  pikort_pipeline *pipe = NULL;
  int32_t offset = 100, indices[] = {0, 1, 2}, values[] = {-1, -1, -1};
  int64_t extent[] = {1, 1};
  bool ok = pikort_create(program, &pipe) == PIKORT_OK &&
            pikort_set_domain(pipe, 2, extent) == PIKORT_OK &&
            pikort_bind_constant(pipe, "offset", &offset, 4) == PIKORT_OK &&
            pikort_bind_buffer(pipe, "values", values, 3, 4) == PIKORT_OK &&
            pikort_bind_source(pipe, 0, indices, 3, 4) == PIKORT_OK &&
            pikort_run(pipe) == PIKORT_OK;
  if (!ok)
    fprintf(stderr, "%s\n", pikort_message(pipe));
  pikort_destroy(pipe);
  return ok ? values[2] : -1;
}

/// The same of what a compiler loads.
static int loadAndRun(piko_compiler *compiler) {
  piko_program *program = NULL;
  EXPECT_STATUS(PIKO_OK, piko_load(compiler, &program));
  if (!program) {
    fprintf(stderr, "%s", piko_diagnostics(compiler));
    return -1;
  }
  int result = run(piko_get_program(program));
  piko_release_program(program);
  return result;
}

// --- Arguments --------------------------------------------------------------

static void testNulls(void) {
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_create_compiler(NULL));
  piko_destroy_compiler(NULL);
  piko_release_program(NULL);
  EXPECT(piko_get_program(NULL) == NULL && piko_code_hash(NULL) == 0);
  EXPECT(piko_load_milliseconds(NULL) == 0);
  EXPECT(strcmp(piko_diagnostics(NULL), "") == 0);
  EXPECT(strcmp(piko_tuned_mappings(NULL), "") == 0);
  EXPECT(piko_tuned_strip_size(NULL) == 0);
  EXPECT(piko_option_name(-1) == NULL && piko_option_name(1000) == NULL);

  const char *const *names;
  const piko_tunable *tunables;
  size_t count;
  piko_bytes text;
  piko_object object;
  piko_program *program;
  piko_compiler *own = makeOf(table);
  for (int i = 0; i < 2; ++i) { // without a compiler, and without the rest
    piko_compiler *c = i ? own : NULL;
    EXPECT_STATUS(1, piko_set_file(c, i ? NULL : "a.cpp"));
    EXPECT_STATUS(1, piko_set_text(c, i ? NULL : "a", "", 0));
    EXPECT_STATUS(1, piko_set_text(c, "a", i ? NULL : "", 0));
    EXPECT_STATUS(1, piko_set_option(c, i ? NULL : "pipe", ""));
    EXPECT_STATUS(1, piko_set_option(c, "pipe", i ? NULL : ""));
    EXPECT_STATUS(1, piko_list_pipelines(c, i ? NULL : &names, &count));
    EXPECT_STATUS(1, piko_list_pipelines(c, &names, i ? NULL : &count));
    EXPECT_STATUS(1, piko_list_tunables(c, i ? NULL : &tunables, &count));
    EXPECT_STATUS(1, piko_emit(c, i ? NULL : "kernels", &text));
    EXPECT_STATUS(1, piko_emit(c, "kernels", i ? NULL : &text));
    EXPECT_STATUS(1, piko_load(c, i ? NULL : &program));
    EXPECT_STATUS(1, piko_compile(c, i ? NULL : &object));
  }
  EXPECT_STATUS(1, piko_reset_option(NULL, "pipe"));
  piko_destroy_compiler(own);
}

static void testWithoutText(void) {
  piko_compiler *c = make();
  const char *const *names;
  const piko_tunable *tunables;
  size_t count;
  piko_bytes text;
  piko_object object;
  piko_program *program;
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_list_pipelines(c, &names, &count));
  EXPECT_HAS(piko_diagnostics(c), "expected a file or a text to compile\n");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT,
                piko_list_tunables(c, &tunables, &count));
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_emit(c, "kernels", &text));
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_load(c, &program));
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_compile(c, &object));
  EXPECT(!program && count == 0 && text.size == 0 && object.code.size == 0);
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_set_file(c, ""));
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_set_file(c, "-"));
  EXPECT_HAS(piko_diagnostics(c), "not the standard input");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_set_text(c, "", "", 0));
  piko_destroy_compiler(c);
}

// --- Options ----------------------------------------------------------------

static const struct {
  const char *name, *good, *bad, *says;
} optionCases[] = {
    {"pipe", "Table", NULL, NULL},
    {"target", "gpu-on-cpu", "gpu", "expected cpu, reference, gpu-on-cpu"},
    {"include-dir", "folder", NULL, NULL},
    {"define", "A=1", "=1", "expected NAME or NAME=VALUE"},
    {"tunable", "factor=5", "factor", "expected NAME=VALUE, but got 'factor'"},
    {"tuned", NULL, "none.json", "none.json"},
    {"cpu", "x86-64", NULL, NULL},
    {"opt-level", "0", "4", "expected 0 to 3, but got '4'"},
    {"check", "nan:A.b", "yes", "expected off, on or nan:RECORD.FIELD"},
    {"without", "vectorize", "nothing", "nothing"},
    {"fix", "offset=1", NULL, NULL},
    {"directive", "set:schedule=none", NULL, NULL},
    {"count", "lanes", "all", "expected none, work or lanes"},
    {"mapping-window", "1.5", "0.5", "expected a factor in [1, 1000]"},
    {"gpu-threads", "64", "48", "expected 0, or a power of two up to 1024"},
    {"gpu-blocks", "7", "-1", "expected a number of at least 0"},
    {"gpu-seed", "7", "1x", "expected a number of at least 0"},
    {"gpu-chip", "sm_80,sm_90a", "80", "expected names such as sm_90"},
    {"namespace", "mine", NULL, NULL},
    {"cache", "off", "no", "expected on or off, but got 'no'"},
    {"cache-dir", "folder", NULL, NULL},
    {"cache-size", "1000", "many", "expected a number of bytes"},
    {"remarks", "on", "1", "expected on or off, but got '1'"},
};

static void testOptions(void) {
  piko_compiler *c = makeOf(table);
  int count = sizeof optionCases / sizeof *optionCases;
  for (int i = 0; i < count; ++i) {
    const char *name = optionCases[i].name;
    EXPECT(piko_option_name(i) && strcmp(piko_option_name(i), name) == 0);
    if (optionCases[i].good) {
      set(c, name, optionCases[i].good);
      EXPECT(strcmp(piko_diagnostics(c), "") == 0);
    }
    if (!optionCases[i].bad)
      continue;
    EXPECT_STATUS(PIKO_INVALID_ARGUMENT,
                  piko_set_option(c, name, optionCases[i].bad));
    EXPECT_HAS(piko_diagnostics(c), "error: option '");
    EXPECT_HAS(piko_diagnostics(c), optionCases[i].says);
  }
  EXPECT(piko_option_name(count) == NULL);
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_set_option(c, "level", "3"));
  EXPECT_HAS(piko_diagnostics(c), "there is no option 'level'");
  EXPECT_HAS(piko_diagnostics(c), "expected one of pipe, target,");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_reset_option(c, "level"));
  // After all of these it is as it was.
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, NULL));
  EXPECT(loadAndRun(c) == 106);
  set(c, "tunable", "factor=5");
  EXPECT(loadAndRun(c) == 110);
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, "tunable"));
  EXPECT(loadAndRun(c) == 106);
  piko_destroy_compiler(c);
}

static void testTuned(void) {
  const char *text = "{\"pipeline\": \"Table\", \"tunables\": {\"factor\": 7},"
                     " \"strip\": 64, \"mappings\": \"scalar\"}";
  writeFile(pathOf("tuned.json"), text, strlen(text));
  piko_compiler *c = makeOf(table);
  set(c, "tuned", pathOf("tuned.json"));
  EXPECT(loadAndRun(c) == 114);
  EXPECT(strcmp(piko_tuned_mappings(c), "scalar") == 0);
  EXPECT(piko_tuned_strip_size(c) == 64);
  set(c, "pipe", "Other");
  piko_program *program;
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_load(c, &program));
  EXPECT_HAS(piko_diagnostics(c), "error: option 'tuned': ");
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, NULL));
  EXPECT(piko_tuned_strip_size(c) == 0);
  writeFile(pathOf("tuned.json"), "{", 1);
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT,
                piko_set_option(c, "tuned", pathOf("tuned.json")));
  EXPECT_HAS(piko_diagnostics(c), "tuned.json");
  piko_destroy_compiler(c);
}

// --- Looking at a text ------------------------------------------------------

static void testLists(void) {
  piko_compiler *c = makeOf(table);
  set(c, "define", "MORE");
  const char *const *names;
  size_t count;
  EXPECT_STATUS(PIKO_OK, piko_list_pipelines(c, &names, &count));
  EXPECT(count == 2 && strcmp(names[0], "Table") == 0 &&
         strcmp(names[1], "More") == 0 && !names[2]);
  const piko_tunable *tunables;
  EXPECT_STATUS(PIKO_OK, piko_list_tunables(c, &tunables, &count));
  EXPECT(count == 2);
  const piko_tunable *factor = &tunables[0], *twice = &tunables[1];
  EXPECT(strcmp(factor->name, "factor") == 0 && factor->value_count == 3);
  EXPECT(strcmp(factor->values[0], "3") == 0 &&
         strcmp(factor->values[2], "7") == 0);
  EXPECT_HAS(factor->file, "table.piko.cpp");
  EXPECT(factor->line == 2 && factor->column > 1);
  EXPECT(strcmp(twice->name, "twice") == 0 && twice->value_count == 2 &&
         strcmp(twice->values[1], "true") == 0);

  // Which of the two?
  piko_program *program;
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT_HAS(piko_diagnostics(c), "pipeline 'More' is defined here");
  set(c, "pipe", "None");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT_HAS(piko_diagnostics(c), "None");
  piko_destroy_compiler(c);

  c = makeOf("#include <piko.h>\nint a = \"text\";\n");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_list_pipelines(c, &names, &count));
  EXPECT_HAS(piko_diagnostics(c), "table.piko.cpp:2:");
  EXPECT_HAS(piko_diagnostics(c), "int a = \"text\";\n");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_list_tunables(c, &tunables, &count));
  EXPECT(count == 0);
  piko_destroy_compiler(c);
}

static void testLevels(void) {
  static const char *const levels[][2] = {
      {"authored", "piko.stage"}, {"kernels", "piko.kernel"},
      {"machine", "piko.kernel"}, {"target", "func.func"},
      {"llvm", "llvm.func"},      {"llvmir", "define"},
      {"assembly", ".text"},      {"gpu", "gpu.func"},
      {"ptx", ".target sm_"},     {"report", "Table"},
  };
  piko_compiler *c = makeOf(table);
  piko_bytes text;
  for (size_t i = 0; i < sizeof levels / sizeof *levels; ++i) {
    EXPECT_STATUS(PIKO_OK, piko_emit(c, levels[i][0], &text));
    EXPECT_HAS(text.data, levels[i][1]);
    EXPECT(strlen(text.data) == text.size);
  }
  set(c, "gpu-chip", "sm_80");
  EXPECT_STATUS(PIKO_OK, piko_emit(c, "ptx", &text));
  EXPECT_HAS(text.data, ".target sm_80");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_emit(c, "kernel", &text));
  EXPECT_HAS(piko_diagnostics(c), "there is no level 'kernel'; expected one "
                                  "of authored, kernels,");
  set(c, "target", "reference");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_emit(c, "kernels", &text));
  set(c, "target", "auto");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_emit(c, "kernels", &text));
  EXPECT_HAS(piko_diagnostics(c), "auto is two");
  set(c, "target", "cpu");
  set(c, "cpu", "nope");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_emit(c, "target", &text));
  EXPECT_HAS(piko_diagnostics(c), "there is no processor 'nope'");

  // What it wrote it reads again.
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, NULL));
  EXPECT_STATUS(PIKO_OK, piko_emit(c, "authored", &text));
  piko_compiler *second = make();
  EXPECT_STATUS(PIKO_OK,
                piko_set_text(second, "table.mlir", text.data, text.size));
  EXPECT(loadAndRun(second) == 106);
  piko_destroy_compiler(second);
  piko_destroy_compiler(c);
}

// --- Code -------------------------------------------------------------------

static void testPrograms(void) {
  piko_compiler *c = makeOf(table);
  piko_program *program = NULL, *again = NULL;
  EXPECT_STATUS(PIKO_OK, piko_load(c, &program));
  EXPECT_STATUS(PIKO_OK, piko_load(c, &again));
  EXPECT(piko_code_hash(program) == piko_code_hash(again) &&
         piko_code_hash(program) != 0);
  EXPECT(piko_load_milliseconds(program) > 0);
  EXPECT(strcmp(piko_get_program(program)->name, "Table") == 0);
  piko_release_program(again);
  piko_destroy_compiler(c); // the program stays
  EXPECT(run(piko_get_program(program)) == 106);
  piko_release_program(program);

  static const char *const targets[] = {"reference", "gpu-on-cpu", "auto"};
  for (int i = 0; i < 3; ++i) {
    c = makeOf(table);
    set(c, "target", targets[i]);
    EXPECT(loadAndRun(c) == 106);
    piko_destroy_compiler(c);
  }

  c = makeOf(table);
  writeFile(pathOf("table.piko.cpp"), table, strlen(table));
  EXPECT_STATUS(PIKO_OK, piko_set_file(c, pathOf("table.piko.cpp")));
  EXPECT(loadAndRun(c) == 106);
  EXPECT_STATUS(PIKO_OK, piko_set_file(c, pathOf("none.cpp")));
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT(!program);
  EXPECT_HAS(piko_diagnostics(c), "none.cpp:1:1: error: cannot open the file");
  piko_destroy_compiler(c);

  c = makeOf(table);
  set(c, "tunable", "factor=4");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT_HAS(piko_diagnostics(c), "table.piko.cpp:2:");
  piko_destroy_compiler(c);
}

static void testWarnings(void) {
  piko_compiler *c = makeOf(table);
  set(c, "define", "WARN");
  for (int i = 0; i < 2; ++i) { // the second from the cache
    EXPECT(loadAndRun(c) == 106);
    EXPECT_HAS(piko_diagnostics(c), "warning: mind the step");
  }
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, NULL));
  set(c, "cache", "off");
  EXPECT(loadAndRun(c) == 106);
  EXPECT(strcmp(piko_diagnostics(c), "") == 0);
  set(c, "cache", "on");
  writeFile(pathOf("file"), "", 0);
  set(c, "cache-dir", pathOf("file/cache"));
  EXPECT(loadAndRun(c) == 106);
  EXPECT_HAS(piko_diagnostics(c), "warning: cannot write to the cache");
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, NULL));
  piko_destroy_compiler(c);
}

static void testObjects(void) {
  piko_compiler *c = makeOf(table);
  set(c, "namespace", "mine");
  piko_object object;
  EXPECT_STATUS(PIKO_OK, piko_compile(c, &object));
  EXPECT(strcmp(object.pipeline, "Table") == 0);
  EXPECT(strcmp(object.symbol, "mine_Table_program") == 0);
  EXPECT(object.code.size > 4 && memcmp(object.code.data, "\177ELF", 4) == 0);
  EXPECT_HAS(object.header.data, "class Table");
  bool found = false;
  for (size_t i = 0; i < object.file_count; ++i)
    found |= strstr(object.files[i], "piko.h") != NULL;
  EXPECT(found && !object.files[object.file_count]);

  // As a library it is loaded without its text.
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, "namespace"));
  EXPECT_STATUS(PIKO_OK, piko_compile(c, &object));
  char from[4096], to[4096], command[10000];
  snprintf(from, sizeof from, "%s", pathOf("table.o"));
  snprintf(to, sizeof to, "%s", pathOf("table.so"));
  writeFile(from, object.code.data, object.code.size);
  snprintf(command, sizeof command, "'%s' -shared -o '%s' '%s'", cc, to, from);
  EXPECT(system(command) == 0);
  EXPECT_STATUS(PIKO_OK, piko_set_file(c, to));
  set(c, "pipe", "Table");
  EXPECT(loadAndRun(c) == 106);
  piko_bytes text;
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_emit(c, "kernels", &text));
  EXPECT_HAS(piko_diagnostics(c), "is a library");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_compile(c, &object));
  set(c, "define", "A");
  piko_program *program;
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT_HAS(piko_diagnostics(c), "but this is a library");
  piko_destroy_compiler(c);

  c = makeOf(table);
  set(c, "target", "reference");
  EXPECT_STATUS(PIKO_INVALID_ARGUMENT, piko_compile(c, &object));
  EXPECT_HAS(piko_diagnostics(c), "the reference executor is no object");
  set(c, "target", "cpu");
  set(c, "cpu", "nope");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_compile(c, &object));
  EXPECT_HAS(piko_diagnostics(c), "there is no processor 'nope'");
  piko_destroy_compiler(c);
}

static void testRemarksAndCounts(void) {
  piko_compiler *c = makeOf(table);
  set(c, "remarks", "on");
  piko_bytes text;
  EXPECT_STATUS(PIKO_OK, piko_emit(c, "target", &text));
  EXPECT_HAS(piko_diagnostics(c), "remark: ");
  set(c, "remarks", "off");
  EXPECT_STATUS(PIKO_OK, piko_emit(c, "target", &text));
  EXPECT(strcmp(piko_diagnostics(c), "") == 0);
  set(c, "fix", "offset=100");
  EXPECT(loadAndRun(c) == 106);
  set(c, "fix", "none=1");
  piko_program *program;
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, "fix"));
  set(c, "directive", "none:schedule=none");
  EXPECT_STATUS(PIKO_NOT_COMPILED, piko_load(c, &program));
  EXPECT_STATUS(PIKO_OK, piko_reset_option(c, "directive"));
  set(c, "count", "work");
  EXPECT_STATUS(PIKO_OK, piko_load(c, &program));
  pikort_pipeline *pipe = NULL;
  EXPECT_STATUS(PIKORT_OK, pikort_create(piko_get_program(program), &pipe));
  EXPECT(pikort_counter_count(pipe) > 0);
  pikort_destroy(pipe);
  piko_release_program(program);
  piko_destroy_compiler(c);
}

static void *loadOnThread(void *factor) {
  piko_compiler *c = makeOf(table);
  char setting[32];
  snprintf(setting, sizeof setting, "factor=%d", *(int *)factor);
  set(c, "tunable", setting);
  set(c, "cache", "off");
  *(int *)factor = loadAndRun(c);
  piko_destroy_compiler(c);
  return NULL;
}

static void testThreads(void) {
  pthread_t threads[3];
  int factors[3] = {3, 5, 7};
  for (int i = 0; i < 3; ++i)
    EXPECT(pthread_create(&threads[i], NULL, loadOnThread, &factors[i]) == 0);
  for (int i = 0; i < 3; ++i)
    EXPECT(pthread_join(threads[i], NULL) == 0);
  EXPECT(factors[0] == 106 && factors[1] == 110 && factors[2] == 114);
}

int main(int argc, char **argv) {
  if (argc != 3) {
    fprintf(stderr, "expected FOLDER CC\n");
    return 2;
  }
  folder = argv[1];
  cc = argv[2];
  EXPECT(strchr(piko_version(), '.') != NULL);
  testNulls();
  testWithoutText();
  testOptions();
  testTuned();
  testLists();
  testLevels();
  testPrograms();
  testWarnings();
  testObjects();
  testRemarksAndCounts();
  testThreads();
  fprintf(stderr, failures ? "%d failures\n" : "passed\n", failures);
  return failures != 0;
}
