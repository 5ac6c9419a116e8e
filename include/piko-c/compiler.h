// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- compiler.h - The compiler for hosts, in C --------------------------===//
//
// libpiko compiles pipelines while an application runs: to a program that
// libpikort runs, to an object with its header, or to the text of a level.
// compiler.hpp is a thin C++ owner.
//
//   piko_compiler *compiler;
//   piko_create_compiler(&compiler);
//   piko_set_file(compiler, "draw.piko.cpp");
//   piko_set_option(compiler, "pipe", "DrawPipe");
//   piko_program *program;
//   if (piko_load(compiler, &program) != PIKO_OK)
//     fputs(piko_diagnostics(compiler), stderr);
//   else
//     pikort_create(piko_get_program(program), &pipeline);
//
// Every function that can fail returns a piko_status, and leaves what there is
// to say in piko_diagnostics: errors and warnings as Clang writes them, with
// file and line where there is one. Nothing here exits, throws or prints.
//
// A compiler is used by one thread at a time; several work at the same time. A
// loaded program does not change, and is for all threads. What functions give
// back as a pointer belongs to the compiler, and is valid until the next call
// with it that returns a status.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_C_COMPILER_H
#define PIKO_C_COMPILER_H

#include <pikort/pikort.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#define PIKO_API
#else
#define PIKO_API __attribute__((visibility("default")))
#endif

typedef struct piko_compiler piko_compiler;
typedef struct piko_program piko_program;

enum piko_status {
  PIKO_OK = 0,
  PIKO_INVALID_ARGUMENT = 1, ///< A null pointer, no such option, level, ...
  PIKO_NOT_COMPILED = 2,     ///< The text, or what is asked of it, is wrong.
  PIKO_OUT_OF_MEMORY = 3
};

/// As "1.2.3".
PIKO_API const char *piko_version(void);

// --- Life -------------------------------------------------------------------

/// Makes a compiler with no text and all options as they are by default.
PIKO_API int32_t piko_create_compiler(piko_compiler **compiler);
/// Frees it; null is allowed. Programs that it loaded stay.
PIKO_API void piko_destroy_compiler(piko_compiler *compiler);
/// What the latest call had to say that returned a status: errors after a
/// failure, and warnings; "" if nothing. Each ends with a line's end.
PIKO_API const char *piko_diagnostics(const piko_compiler *compiler);

// --- What to compile --------------------------------------------------------

/// A file: C++, `.mlir` at any level, or, to be loaded, a `.so` of objects.
PIKO_API int32_t piko_set_file(piko_compiler *compiler, const char *path);
/// `size` bytes of text, which are copied. `name` is what diagnostics call it,
/// and headers are looked for as if it were a file of that name; ".mlir" at
/// its end says what it is.
PIKO_API int32_t piko_set_text(piko_compiler *compiler, const char *name,
                               const char *text, size_t size);

/// Sets an option by its name. Those that hold a list take one more:
///
///   pipe            the pipeline; "" (the default) = the only one
///   target          cpu (the default), reference, gpu-on-cpu, cuda, auto
///   include-dir     a list of folders of headers
///   define          a list of NAME or NAME=VALUE
///   tunable         a list of NAME=VALUE, a value that the text lists
///   tuned           a file of piko-tune's: its pipeline, tunables, directives
///                   and passes; it is read now
///   cpu             as Clang names processors, or native: the default of what
///                   is loaded or shown. Objects may have several, between
///                   commas; their default is the least that Piko supports
///   opt-level       0 to 3 (the default)
///   check           off (the default), on, or nan:RECORD.FIELD,...
///   without         passes of synthesis to leave out, between commas
///   fix             a list of NAME=VALUE: constants' values and buffers' sizes
///                   that the code takes for granted
///   directive       a list of STAGE:KEY=VALUE, as piko-set-directives has them
///   count           none (the default), work, lanes: what a program counts
///   mapping-window  a factor in [1, 1000]; 2 by default
///   gpu-threads     of a block: a power of two up to 1024; 0 = as stages have
///   gpu-blocks, gpu-seed   of gpu-on-cpu: most blocks of a grid; their order
///   gpu-chip        of cuda: chips such as sm_90, between commas; of the text
///                   ptx the one that it is for
///   namespace       of an object's class and symbol; pipelines by default
///   cache           on (the default), off
///   cache-dir       a folder; "" (the default) as pikoc has it
///   cache-size      most bytes of it; 0 (the default) as pikoc has it
///   remarks         on, off (the default): what the passes have to say
PIKO_API int32_t piko_set_option(piko_compiler *compiler, const char *name,
                                 const char *value);
/// Sets an option to its default, a list to an empty one; null = all options.
PIKO_API int32_t piko_reset_option(piko_compiler *compiler, const char *name);
/// The names of the options, for index 0 and on; null where there are no more.
PIKO_API const char *piko_option_name(int32_t index);
/// What the tuned file has for pikort_set_mappings and pikort_set_strip_size,
/// which the host calls; "" and 0 if nothing.
PIKO_API const char *piko_tuned_mappings(const piko_compiler *compiler);
PIKO_API int64_t piko_tuned_strip_size(const piko_compiler *compiler);

// --- To look at it ----------------------------------------------------------

/// The names of the file's pipelines, as they stand there.
PIKO_API int32_t piko_list_pipelines(piko_compiler *compiler,
                                     const char *const **names, size_t *count);

/// A constant that the text leaves open among values.
typedef struct piko_tunable {
  const char *name;
  const char *const *values; ///< The standard one first.
  size_t value_count;
  const char *file; ///< Where it is declared; "" and 0 if that is not known.
  uint32_t line, column;
} piko_tunable;

PIKO_API int32_t piko_list_tunables(piko_compiler *compiler,
                                    const piko_tunable **tunables,
                                    size_t *count);

/// Bytes; after them there is a zero, which does not count.
typedef struct piko_bytes {
  const char *data;
  size_t size;
} piko_bytes;

/// The pipeline as text, at a level: authored, kernels, machine, target, llvm,
/// llvmir, assembly, gpu, ptx; or report, what synthesis makes of it.
PIKO_API int32_t piko_emit(piko_compiler *compiler, const char *level,
                           piko_bytes *text);

// --- To run it --------------------------------------------------------------

/// Compiles the pipeline for this machine, or finds its code in the cache, and
/// loads it.
PIKO_API int32_t piko_load(piko_compiler *compiler, piko_program **program);
/// Frees the code, which no pipeline may use any more; null is allowed.
PIKO_API void piko_release_program(piko_program *program);
/// What pikort_create takes.
PIKO_API const pikort_program *piko_get_program(const piko_program *program);
/// How long piko_load took.
PIKO_API double piko_load_milliseconds(const piko_program *program);
/// A hash of the code: what has the same runs the same.
PIKO_API uint64_t piko_code_hash(const piko_program *program);

/// An object of the pipeline's, to be linked.
typedef struct piko_object {
  const char *pipeline; ///< Its name.
  const char *symbol;   ///< The object's one definition, a pikort_program.
  piko_bytes code;      ///< An object file.
  piko_bytes header;    ///< For hosts in C++; empty below the machine level.
  const char *const *files; ///< That were read, sorted.
  size_t file_count;
} piko_object;

/// The reference executor, which is no object of its own, is an error.
PIKO_API int32_t piko_compile(piko_compiler *compiler, piko_object *object);

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKO_C_COMPILER_H
