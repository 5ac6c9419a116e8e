// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko._core.Pipeline: libpikort. Calls that can fail return a status, and
// message() says why.

#include "Core.h"

#include <atomic>
#include <cerrno>
#include <csignal>

#include <unistd.h>

using namespace piko::python;

namespace {

/// The run of the main thread that SIGINT ends, and what the signal did before.
std::atomic<pikort_pipeline *> interruptible{nullptr};
struct sigaction actionBefore;
/// How often it came in that run.
std::atomic<int> interruptCount{0};

/// Who asks again wonders why nothing happens. Of what may be called here.
void explainWaiting() {
  static constexpr char text[] =
      "\npiko: the run ends when its kernel has ended, and a kernel cannot be "
      "stopped; Ctrl-\\ ends the process\n";
  int before = errno;
  [[maybe_unused]] ssize_t written =
      write(STDERR_FILENO, text, sizeof text - 1);
  errno = before;
}

void onInterrupt(int number, siginfo_t *info, void *context) {
  if (actionBefore.sa_flags & SA_SIGINFO)
    actionBefore.sa_sigaction(number, info, context);
  else if (actionBefore.sa_handler != SIG_IGN &&
           actionBefore.sa_handler != SIG_DFL)
    actionBefore.sa_handler(number); // Python notes it
  if (pikort_pipeline *pipeline = interruptible.load()) {
    pikort_interrupt(pipeline, 1);
    if (++interruptCount == 2)
      explainWaiting();
  }
}

/// While it lives, SIGINT also ends a pipeline's run.
class InterruptScope {
public:
  explicit InterruptScope(pikort_pipeline *pipeline) {
    interruptCount = 0;
    interruptible = pipeline;
    struct sigaction action = {};
    action.sa_sigaction = onInterrupt;
    action.sa_flags = SA_SIGINFO;
    sigaction(SIGINT, nullptr, &actionBefore);
    sigaction(SIGINT, &action, nullptr);
  }
  InterruptScope(const InterruptScope &) = delete;
  InterruptScope &operator=(const InterruptScope &) = delete;
  ~InterruptScope() {
    sigaction(SIGINT, &actionBefore, nullptr);
    pikort_interrupt(interruptible.exchange(nullptr), 0);
  }
};

class Pipeline {
public:
  Pipeline(const Program &made, int32_t device) : program(made) {
    py::gil_scoped_release release;
    created =
        pikort_create_on(piko_get_program(made.handle.get()), device, &handle);
  }
  Pipeline(const Pipeline &) = delete;
  Pipeline &operator=(const Pipeline &) = delete;
  ~Pipeline() { pikort_destroy(handle); }

  int32_t status() const { return created; }
  pikort_pipeline *get() const { return handle; }

  int32_t setDomain(const std::vector<int64_t> &extent) {
    return pikort_set_domain(handle, static_cast<int32_t>(extent.size()),
                             extent.data());
  }
  int32_t bindConstant(const std::string &name, const py::bytes &value) {
    std::string bytes = value;
    return pikort_bind_constant(handle, name.c_str(), bytes.data(),
                                static_cast<int64_t>(bytes.size()));
  }
  int32_t bindBuffer(const std::string &name, uint64_t address, int64_t count,
                     int64_t size, bool onDevice) {
    return onDevice ? pikort_bind_device_buffer(handle, name.c_str(), address,
                                                count, size)
                    : pikort_bind_buffer(handle, name.c_str(),
                                         pointerTo(address), count, size);
  }
  int32_t bindSource(int32_t source, uint64_t address, int64_t count,
                     int64_t size, bool onDevice) {
    return onDevice
               ? pikort_bind_device_source(handle, source, address, count, size)
               : pikort_bind_source(handle, source, pointerTo(address), count,
                                    size);
  }
  int32_t allocate(const std::string &name, int64_t count) {
    return pikort_allocate_buffer(handle, name.c_str(), count);
  }
  int32_t read(const std::string &name, uint64_t address, int64_t count,
               int64_t size) {
    py::gil_scoped_release release;
    return pikort_read(handle, name.c_str(), pointerTo(address), count, size);
  }
  int32_t capture(const std::string &path) {
    py::gil_scoped_release release;
    return pikort_capture(handle, path.c_str());
  }

  /// (status, address, extent, record's size, rank)
  py::tuple view(const std::string &name) {
    pikort_view view{};
    int32_t status = pikort_get_view(handle, name.c_str(), &view);
    return py::make_tuple(status, reinterpret_cast<uintptr_t>(view.data),
                          std::vector<int64_t>(view.extent, view.extent + 4),
                          view.record_size, view.rank);
  }
  /// (status, address, extent, strides, record's size, rank, device)
  py::tuple deviceView(const std::string &name) {
    pikort_device_view view{};
    int32_t status = pikort_get_device_view(handle, name.c_str(), &view);
    return py::make_tuple(status, view.address,
                          std::vector<int64_t>(view.extent, view.extent + 4),
                          std::vector<int64_t>(view.stride, view.stride + 4),
                          view.record_size, view.rank, view.device);
  }

  /// In the order of a stream, or of the pipeline's own. With `hears` SIGINT
  /// ends it; then Python's handler has its say.
  int32_t run(std::optional<uint64_t> stream, bool hears) {
    std::optional<InterruptScope> scope;
    if (hears)
      scope.emplace(handle);
    auto checkSignals = [&] {
      if (hears && PyErr_CheckSignals() != 0)
        throw py::error_already_set();
    };
    checkSignals(); // what came before the handler was there
    int32_t status = PIKORT_OK;
    {
      py::gil_scoped_release release;
      if (!stream)
        status = pikort_run(handle);
      else if ((status = pikort_run_async(handle, pointerTo(*stream))) ==
               PIKORT_OK)
        status = pikort_wait(handle);
    }
    scope.reset();
    checkSignals();
    return status;
  }

private:
  static void *pointerTo(uint64_t address) {
    return reinterpret_cast<void *>(address);
  }

  Program program;
  pikort_pipeline *handle = nullptr;
  int32_t created = PIKORT_OK;
};

//===----------------------------------------------------------------------===//
// Descriptions
//===----------------------------------------------------------------------===//

/// (name, size, align, [(name, offset, elements, stride, type)])
py::list describeRecords(const Pipeline &pipeline) {
  py::list records;
  for (int32_t r = 0; r < pikort_record_count(pipeline.get()); ++r) {
    pikort_record_info info{};
    pikort_get_record(pipeline.get(), r, &info);
    py::list fields;
    for (int32_t f = 0; f < info.field_count; ++f) {
      pikort_field_info field{};
      pikort_get_field(pipeline.get(), r, f, &field);
      fields.append(py::make_tuple(field.name, field.offset, field.elements,
                                   field.stride, field.type));
    }
    records.append(py::make_tuple(info.name, info.size, info.align, fields));
  }
  return records;
}

/// (name, kind, record, rank, the source that sizes it, whether it is bound)
py::list describeStates(const Pipeline &pipeline) {
  py::list states;
  for (int32_t i = 0; i < pikort_state_count(pipeline.get()); ++i) {
    pikort_state_info info{};
    pikort_get_state_info(pipeline.get(), i, &info);
    states.append(py::make_tuple(info.name, info.kind, info.record, info.rank,
                                 info.per_source, info.bound != 0));
  }
  return states;
}

/// (the stage's name, record, primitives bound)
py::list describeSources(const Pipeline &pipeline) {
  py::list sources;
  for (int32_t i = 0; i < pikort_source_count(pipeline.get()); ++i) {
    pikort_source_info info{};
    pikort_stage_info stage{};
    pikort_get_source_info(pipeline.get(), i, &info);
    pikort_get_stage_info(pipeline.get(), info.stage, &stage);
    sources.append(py::make_tuple(stage.name, info.record, info.count));
  }
  return sources;
}

py::list describeStages(const Pipeline &pipeline) {
  py::list stages;
  for (int32_t i = 0; i < pikort_stage_count(pipeline.get()); ++i) {
    pikort_stage_info stage{};
    pikort_stage_stats stats{};
    pikort_get_stage_info(pipeline.get(), i, &stage);
    pikort_get_stage_stats(pipeline.get(), i, &stats);
    std::vector<int64_t> bin(stage.bin_size,
                             stage.bin_size + pikort_rank(pipeline.get()));
    stages.append(
        py::make_tuple(stage.name, bin, stats.in, stats.placed, stats.out));
  }
  return stages;
}

py::list describeKernels(const Pipeline &pipeline) {
  py::list kernels;
  for (int32_t i = 0; i < pikort_kernel_count(pipeline.get()); ++i) {
    pikort_kernel_stats stats{};
    pikort_get_kernel_stats(pipeline.get(), i, &stats);
    kernels.append(py::make_tuple(
        stats.name, stats.milliseconds, stats.join_milliseconds,
        stats.wait_milliseconds, stats.launches, stats.parallel_launches));
  }
  return kernels;
}

py::dict describeTimes(const Pipeline &pipeline) {
  pikort_time_stats times{};
  pikort_get_time_stats(pipeline.get(), &times);
  return py::dict(
      py::arg("kernels") = times.kernels, py::arg("waiting") = times.waiting,
      py::arg("joins") = times.joins, py::arg("cycles") = times.cycles,
      py::arg("clears") = times.clears,
      py::arg("allocation") = times.allocation,
      py::arg("program") = times.program, py::arg("device") = times.device);
}

/// (kernel, number, loop, whether vectors run, state, measured ratio)
py::list describeMappings(const Pipeline &pipeline) {
  py::list mappings;
  for (int32_t i = 0; i < pikort_mapping_count(pipeline.get()); ++i) {
    pikort_mapping_info info{};
    pikort_get_mapping(pipeline.get(), i, &info);
    mappings.append(py::make_tuple(info.kernel, info.number, info.loop,
                                   info.vectors != 0, info.state,
                                   info.measured_ratio));
  }
  return mappings;
}

/// (name, compute capability, whether it is usable, memory in bytes)
py::list listDevices() {
  py::list devices;
  for (int32_t i = 0; i < pikort_device_count(); ++i) {
    pikort_device_info info{};
    pikort_get_device(i, &info);
    devices.append(py::make_tuple(std::string(info.name), info.capability,
                                  info.usable != 0, info.memory));
  }
  return devices;
}

} // namespace

void piko::python::definePipeline(py::module_ &module) {
  /// Of a function that takes the C handle alone, or and one value.
  auto get = [](auto function) {
    return [function](const Pipeline &p) { return function(p.get()); };
  };
  auto set = [](auto function) {
    return [function](Pipeline &p, int64_t value) {
      return function(p.get(), value);
    };
  };
  py::class_<Pipeline>(module, "Pipeline")
      .def(py::init<const Program &, int32_t>())
      .def("status", &Pipeline::status)
      .def("message", get(pikort_message))
      .def("name", get(pikort_name))
      .def("rank", get(pikort_rank))
      .def("processor", get(pikort_processor))
      .def("device", get(pikort_device))
      .def("device_refusal", get(pikort_device_refusal))
      .def("threads", get(pikort_threads))
      .def("records", describeRecords)
      .def("states", describeStates)
      .def("sources", describeSources)
      .def("set_domain", &Pipeline::setDomain)
      .def("set_threads", set([](pikort_pipeline *p, int64_t count) {
             bool fits = count >= INT32_MIN && count <= INT32_MAX;
             return pikort_set_threads(p,
                                       fits ? static_cast<int32_t>(count) : -1);
           }))
      .def("set_memory_limit", set(pikort_set_memory_limit))
      .def("set_memory_budget", set(pikort_set_memory_budget))
      .def("set_strip_size", set(pikort_set_strip_size))
      .def("set_loop_limit", set(pikort_set_loop_limit))
      .def("set_static_input", set([](pikort_pipeline *p, int64_t on) {
             return pikort_set_static_input(p, on != 0);
           }))
      .def("set_mappings",
           [](Pipeline &p, const std::string &setting) {
             return pikort_set_mappings(p.get(), setting.c_str());
           })
      .def("bind_constant", &Pipeline::bindConstant)
      .def("bind_buffer", &Pipeline::bindBuffer)
      .def("bind_source", &Pipeline::bindSource)
      .def("allocate", &Pipeline::allocate)
      .def("view", &Pipeline::view)
      .def("device_view", &Pipeline::deviceView)
      .def("read", &Pipeline::read)
      .def("capture", &Pipeline::capture)
      .def("run", &Pipeline::run)
      .def("stages", describeStages)
      .def("kernels", describeKernels)
      .def("times", describeTimes)
      .def("mappings", describeMappings)
      .def("runs", get(pikort_stats_runs))
      .def("peak_bytes", get(pikort_peak_bytes))
      .def("reserved_bytes", get(pikort_reserved_bytes))
      .def("reset_stats",
           get([](pikort_pipeline *p) { pikort_reset_stats(p); }));
  module.def("devices", listDevices);
}
