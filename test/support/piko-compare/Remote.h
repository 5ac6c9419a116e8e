// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Runs of a pipeline whose code this machine does not run, by piko-run-capture
// under an emulator: a shared library and a capture go there, and what the runs
// left comes back.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_REMOTE_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_REMOTE_H

#include "Piko/Replay/Outcome.h"

#include <string>
#include <vector>

/// Runs `code`, an object, on `capture`, a file, once with each number of threads.
/// `runner` are the words of the command. Throws std::runtime_error.
std::vector<piko::replay::Outcome>
runRemotely(const std::vector<std::string> &runner, const std::string &code,
            const std::string &pipe, const std::string &capture,
            const std::vector<int> &threads);

/// A folder for files of this process, which goes with it.
class WorkFolder {
public:
  WorkFolder();
  ~WorkFolder();
  WorkFolder(const WorkFolder &) = delete;
  std::string operator/(const std::string &name) const {
    return path + "/" + name;
  }

private:
  std::string path;
};

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_REMOTE_H
