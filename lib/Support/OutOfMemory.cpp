//===- OutOfMemory.cpp - What memory there is, and none -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Support/OutOfMemory.h"

#include <cstring>
#include <exception>
#include <limits>
#include <new>

#include <unistd.h>

static const char *toolName = "piko";
static std::terminate_handler others = nullptr;

static bool isOutOfMemory() {
  std::exception_ptr why = std::current_exception();
  if (!why)
    return false;
  try {
    std::rethrow_exception(why);
  } catch (const std::bad_alloc &) {
    return true;
  } catch (...) {
    return false;
  }
}

/// Writes what needs no memory.
static void print(const char *text) {
  while (*text) {
    ssize_t done = write(STDERR_FILENO, text, std::strlen(text));
    if (done <= 0)
      return;
    text += done;
  }
}

void piko::support::endOutOfMemory() {
  print(toolName);
  print(": error: out of memory\n");
  _exit(1);
}

[[noreturn]] static void end() {
  if (!isOutOfMemory())
    others();
  piko::support::endOutOfMemory();
}

void piko::support::reportOutOfMemory(const char *tool) {
  toolName = tool;
  std::set_new_handler(nullptr); // LLVM's would abort
  others = std::set_terminate(end);
}

uint64_t piko::support::memoryOfMachine() {
  long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || size <= 0)
    return std::numeric_limits<uint64_t>::max();
  return static_cast<uint64_t>(pages) * static_cast<uint64_t>(size);
}
