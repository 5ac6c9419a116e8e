// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Core.h"

using namespace piko::python;

PYBIND11_MODULE(_core, module) {
  module.doc() = "The C interfaces of libpiko and libpikort.";
  module.def("version", piko_version);
  module.def("finish_jobs", finishJobs,
             py::call_guard<py::gil_scoped_release>());
  module.def("forget_jobs", forgetJobs);
  defineCompiler(module);
  defineErrors(module);
  definePipeline(module);
  defineTensor(module);
}
