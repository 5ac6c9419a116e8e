// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-run-capture LIBRARY PIPELINE CAPTURE THREADS...
//
// Runs a pipeline that was compiled ahead of time on what a capture holds, once
// with each number of threads, and writes what that left to the standard output
// (Piko/Replay/OutcomeText.h). A run that stops leaves its message. Exit status 2
// if nothing can be run.

#include "Piko/Replay/CaptureFile.h"
#include "Piko/Replay/OutcomeText.h"

#include <cstdio>
#include <cstdlib>
#include <dlfcn.h>
#include <stdexcept>

using namespace piko;

namespace {

/// The functions of a pipeline, as generated code names them.
pikort_program findProgram(const char *file, const std::string &name) {
  void *library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (!library)
    throw std::runtime_error(dlerror());
  auto find = [&](const std::string &function) {
    void *found = dlsym(library, (name + function).c_str());
    if (!found)
      throw std::runtime_error(dlerror());
    return found;
  };
  pikort_program program{PIKORT_ABI_VERSION, name.c_str(), nullptr, nullptr};
  program.setup = reinterpret_cast<decltype(program.setup)>(find(".setup"));
  program.run = reinterpret_cast<decltype(program.run)>(find(".run"));
  return program;
}

replay::Outcome runOnce(const pikort_program &program, rt::Capture capture,
                        int threads) {
  pikort_pipeline *pipeline = nullptr;
  if (pikort_create(&program, &pipeline) != PIKORT_OK)
    throw std::runtime_error(pikort_message(pipeline));
  std::string wrong = capture.bind(pipeline);
  if (wrong.empty() && pikort_set_threads(pipeline, threads) != PIKORT_OK)
    wrong = pikort_message(pipeline);
  if (!wrong.empty())
    throw std::runtime_error(wrong);
  replay::Outcome outcome;
  if (pikort_run(pipeline) == PIKORT_OK)
    outcome = replay::readOutcome(pipeline);
  else
    outcome.error = pikort_message(pipeline);
  pikort_destroy(pipeline);
  return outcome;
}

} // namespace

int main(int argc, char **argv) {
  try {
    if (argc < 5)
      throw std::runtime_error("expected LIBRARY PIPELINE CAPTURE THREADS...");
    std::string name = argv[2];
    pikort_program program = findProgram(argv[1], name);
    auto capture = replay::readCapture(argv[3]);
    if (!capture)
      throw std::runtime_error(capture.error().message);
    for (int i = 4; i < argc; ++i) {
      std::string text =
          replay::writeOutcome(runOnce(program, *capture, std::atoi(argv[i])));
      std::fwrite(text.data(), 1, text.size(), stdout);
    }
    return std::fflush(stdout) == 0 ? 0 : 2;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "piko-run-capture: %s\n", error.what());
    return 2;
  }
}
