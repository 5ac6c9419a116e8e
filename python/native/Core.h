// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko._core: the C interfaces of libpiko and libpikort for Python. It knows
// addresses, names and numbers; what they mean in Python, as arrays, exceptions
// and who keeps memory alive, is the package's, in Python.

#ifndef PIKO_PYTHON_CORE_H
#define PIKO_PYTHON_CORE_H

#include <piko-c/compiler.h>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <functional>
#include <memory>
#include <string>

namespace piko::python {

namespace py = pybind11;

/// A loaded program; pipelines hold on to it.
struct Program {
  std::shared_ptr<piko_program> handle;
};

/// What a compiler does in a thread of its own, so that who waits for it can
/// hear of signals. It goes on, to no effect, when nobody waits any more.
class Job {
public:
  /// `work` must not touch Python.
  static std::shared_ptr<Job> start(std::function<void(Job &)> work);

  /// Whether it has ended, within so many seconds.
  bool wait(double seconds);

  // Set by the work:
  int32_t status = PIKO_OK;
  std::string diagnostics;
  /// What to give Python of it; called once it has ended.
  std::function<py::object()> result;

private:
  struct State;
  std::shared_ptr<State> state;
};

/// Waits until all jobs have ended, as they must before the process does.
void finishJobs();
/// In a child process there are none of the parent's.
void forgetJobs();

void defineCompiler(py::module_ &module);
void defineErrors(py::module_ &module);
void definePipeline(py::module_ &module);
void defineTensor(py::module_ &module);

} // namespace piko::python

#endif // PIKO_PYTHON_CORE_H
