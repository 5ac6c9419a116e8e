// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko._core.Compiler: libpiko, with each call as a job.

#include "Core.h"

using namespace piko::python;

namespace {

using CompilerHandle = std::shared_ptr<piko_compiler>;
using Strings = std::vector<std::string>;

struct TunableCopy {
  std::string name;
  Strings values;
  std::string file;
  uint32_t line, column;
};

struct ObjectCopy {
  std::string pipeline, symbol, code, header;
  Strings files;
};

class Compiler {
public:
  Compiler() {
    piko_compiler *made = nullptr;
    if (piko_create_compiler(&made) != PIKO_OK)
      throw std::bad_alloc();
    handle.reset(made, piko_destroy_compiler);
  }

  int32_t setFile(const std::string &path) {
    return piko_set_file(handle.get(), path.c_str());
  }
  int32_t setText(const std::string &name, const std::string &text) {
    return piko_set_text(handle.get(), name.c_str(), text.data(), text.size());
  }
  int32_t setOption(const std::string &name, const std::string &value) {
    return piko_set_option(handle.get(), name.c_str(), value.c_str());
  }
  std::string diagnostics() const { return piko_diagnostics(handle.get()); }
  std::string tunedMappings() const {
    return piko_tuned_mappings(handle.get());
  }
  int64_t tunedStripSize() const { return piko_tuned_strip_size(handle.get()); }

  std::shared_ptr<Job> load() {
    return start([](piko_compiler *compiler, Job &job) {
      piko_program *program = nullptr;
      job.status = piko_load(compiler, &program);
      Program loaded{{program, piko_release_program}};
      job.result = [loaded] { return py::cast(loaded); };
    });
  }
  std::shared_ptr<Job> emit(const std::string &level) {
    return start([level](piko_compiler *compiler, Job &job) {
      piko_bytes bytes{};
      job.status = piko_emit(compiler, level.c_str(), &bytes);
      std::string text(bytes.data ? bytes.data : "", bytes.size);
      job.result = [text = std::move(text)] { return py::cast(text); };
    });
  }
  std::shared_ptr<Job> listPipelines() {
    return start([](piko_compiler *compiler, Job &job) {
      const char *const *found = nullptr;
      size_t count = 0;
      job.status = piko_list_pipelines(compiler, &found, &count);
      job.result = [names = Strings(found, found + count)] {
        return py::cast(names);
      };
    });
  }
  std::shared_ptr<Job> listTunables() {
    return start([](piko_compiler *compiler, Job &job) {
      const piko_tunable *found = nullptr;
      size_t count = 0;
      job.status = piko_list_tunables(compiler, &found, &count);
      std::vector<TunableCopy> copies;
      for (const piko_tunable *one = found; one != found + count; ++one)
        copies.push_back({one->name,
                          {one->values, one->values + one->value_count},
                          one->file,
                          one->line,
                          one->column});
      job.result = [copies = std::move(copies)] {
        py::list list;
        for (const TunableCopy &one : copies)
          list.append(py::make_tuple(one.name, one.values, one.file, one.line,
                                     one.column));
        return py::object(list);
      };
    });
  }
  std::shared_ptr<Job> compile() {
    return start([](piko_compiler *compiler, Job &job) {
      piko_object object{};
      job.status = piko_compile(compiler, &object);
      if (job.status != PIKO_OK)
        return;
      ObjectCopy copy{object.pipeline,
                      object.symbol,
                      {object.code.data, object.code.size},
                      {object.header.data, object.header.size},
                      {object.files, object.files + object.file_count}};
      job.result = [copy = std::move(copy)] {
        return py::object(py::make_tuple(copy.pipeline, copy.symbol,
                                         py::bytes(copy.code), copy.header,
                                         copy.files));
      };
    });
  }

private:
  template <class Work> std::shared_ptr<Job> start(Work work) {
    return Job::start([compiler = handle, work](Job &job) {
      work(compiler.get(), job);
      job.diagnostics = piko_diagnostics(compiler.get());
    });
  }

  CompilerHandle handle;
};

} // namespace

/// They quote lines of files, which may be anything.
static py::str toText(const std::string &bytes) {
  PyObject *text = PyUnicode_DecodeUTF8(
      bytes.data(), static_cast<Py_ssize_t>(bytes.size()), "replace");
  if (!text)
    throw py::error_already_set();
  return py::reinterpret_steal<py::str>(text);
}

void piko::python::defineCompiler(py::module_ &module) {
  py::class_<Job, std::shared_ptr<Job>>(module, "Job")
      .def("wait", &Job::wait, py::call_guard<py::gil_scoped_release>())
      .def_readonly("status", &Job::status)
      .def_property_readonly(
          "diagnostics", [](const Job &job) { return toText(job.diagnostics); })
      .def("result", [](Job &job) {
        return job.status == PIKO_OK && job.result ? job.result() : py::none();
      });
  auto property = [](auto get) {
    return [get](const Program &program) { return get(program.handle.get()); };
  };
  py::class_<Program>(module, "Program")
      .def_property_readonly("name", property([](const piko_program *program) {
                               return piko_get_program(program)->name;
                             }))
      .def_property_readonly("load_milliseconds",
                             property(piko_load_milliseconds))
      .def_property_readonly("code_hash", property(piko_code_hash));
  py::class_<Compiler>(module, "Compiler")
      .def(py::init<>())
      .def("set_file", &Compiler::setFile)
      .def("set_text", &Compiler::setText)
      .def("set_option", &Compiler::setOption)
      .def("diagnostics",
           [](const Compiler &it) { return toText(it.diagnostics()); })
      .def("tuned_mappings", &Compiler::tunedMappings)
      .def("tuned_strip_size", &Compiler::tunedStripSize)
      .def("load", &Compiler::load)
      .def("emit", &Compiler::emit)
      .def("list_pipelines", &Compiler::listPipelines)
      .def("list_tunables", &Compiler::listTunables)
      .def("compile", &Compiler::compile);
}
