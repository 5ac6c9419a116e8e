//===- SanitizerOptions.cpp - Defaults of the sanitizers' runtimes --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Linked into every program of a build with sanitizers, so that a program
// needs no environment. What is turned off here concerns libraries that are
// built without sanitizers; each line says why.
//
//===----------------------------------------------------------------------===//

extern "C" {

[[gnu::visibility("default"), gnu::used]] const char *__asan_default_options() {
  // LLVM's allocators, which are inline functions, poison what they have not
  // given away. Instrumented code would poison a slab from which libLLVM, whose
  // copy of the same functions does not unpoison, then allocates.
  return "allow_user_poisoning=0"
         // A std::vector that libLLVM has filled has stale annotations.
         ":detect_container_overflow=0"
         ":detect_stack_use_after_return=1"
         // LLVM gives threads signal stacks of its own, which would be unmapped
         // in place of the sanitizer's when they end.
         ":use_sigaltstack=0";
}

[[gnu::visibility("default"), gnu::used]] const char *
__ubsan_default_options() {
  return "print_stacktrace=1";
}

[[gnu::visibility("default"), gnu::used]] const char *__tsan_default_options() {
  // OpenMP's runtime synchronizes by instructions of its own. Archer, which is
  // linked, tells what comes before what; the runtime's accesses are left out.
  return "ignore_noninstrumented_modules=1";
}

[[gnu::visibility("default"), gnu::used]] const char *
__lsan_default_suppressions() {
  // OpenMP's runtime keeps its threads and their memory until the process ends;
  // OpenJPEG and x265 that of pictures that they have refused.
  return "leak:libomp.so\n"
         "leak:libopenjp2.so\n"
         "leak:libx265.so\n";
}

[[gnu::visibility("default"), gnu::used]] const char *__lsan_default_options() {
  return "print_suppressions=0";
}

} // extern "C"
