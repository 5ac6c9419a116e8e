// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CheckPTX.cpp - Loads files of PTX into the driver for tests --------===//
//
//   piko-check-ptx FILE...
//
// Exits with 1 where the driver does not take a file; says why, as
// FILE: line N: text.
//
//===----------------------------------------------------------------------===//

#include "Symbols.h"
#include "TestDriver.h"

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

using namespace piko::cuda;

static bool check(const char *path) {
  std::ifstream file(path);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  CUmodule module = nullptr;
  if (file.bad() ||
      cuModuleLoadDataEx(&module, text.c_str(), 0, nullptr, nullptr)) {
    std::fprintf(stderr, "%s: %s\n", path, pikoTestDriverError());
    return false;
  }
  return cuModuleUnload(module) == CUDA_SUCCESS;
}

int main(int count, char **arguments) {
  CUcontext context = nullptr;
  if (cuInit(0) || cuDevicePrimaryCtxRetain(&context, 0) ||
      cuCtxSetCurrent(context)) {
    std::fprintf(stderr, "%s\n", pikoTestDriverError());
    return 1;
  }
  bool valid = count > 1;
  for (int i = 1; i < count; ++i)
    valid &= check(arguments[i]);
  cuDevicePrimaryCtxRelease(0);
  return valid ? 0 : 1;
}
