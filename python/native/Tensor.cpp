// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko._core.Tensor: memory that another library hands over by DLPack; and
// piko._core.Memory, which shows ours as a buffer.

#include "Core.h"

using namespace piko::python;

namespace {

// As https://dmlc.github.io/dlpack has them.
struct DLDevice {
  int32_t type, id;
};
struct DLDataType {
  uint8_t code, bits;
  uint16_t lanes;
};
struct DLTensor {
  void *data;
  DLDevice device;
  int32_t rank;
  DLDataType type;
  int64_t *shape, *strides;
  uint64_t offset;
};
struct DLManagedTensor {
  DLTensor tensor;
  void *context;
  void (*release)(DLManagedTensor *);
};

/// Owns what a capsule held.
class Tensor {
public:
  explicit Tensor(const py::object &capsule) {
    void *held = PyCapsule_GetPointer(capsule.ptr(), "dltensor");
    if (!held)
      throw py::error_already_set();
    PyCapsule_SetName(capsule.ptr(), "used_dltensor");
    managed = static_cast<DLManagedTensor *>(held);
  }
  Tensor(const Tensor &) = delete;
  Tensor &operator=(const Tensor &) = delete;
  ~Tensor() {
    if (managed->release)
      managed->release(managed);
  }

  const DLTensor &get() const { return managed->tensor; }
  uint64_t address() const {
    return reinterpret_cast<uintptr_t>(get().data) + get().offset;
  }
  std::vector<int64_t> shape() const {
    return {get().shape, get().shape + get().rank};
  }
  /// In elements; none = contiguous.
  py::object strides() const {
    if (!get().strides)
      return py::none();
    return py::cast(
        std::vector<int64_t>(get().strides, get().strides + get().rank));
  }

private:
  DLManagedTensor *managed;
};

/// A range of memory, and who keeps it.
struct Memory {
  uint64_t address;
  int64_t size;
  bool isReadOnly;
  py::object owner;

  py::buffer_info describe() const {
    return {reinterpret_cast<uint8_t *>(address),
            1,
            py::format_descriptor<uint8_t>::format(),
            1,
            {size},
            {1},
            isReadOnly};
  }
};

} // namespace

void piko::python::defineTensor(py::module_ &module) {
  py::class_<Tensor>(module, "Tensor")
      .def(py::init<const py::object &>())
      .def_property_readonly("address", &Tensor::address)
      .def_property_readonly("shape", &Tensor::shape)
      .def_property_readonly("strides", &Tensor::strides)
      .def_property_readonly("device",
                             [](const Tensor &tensor) {
                               const DLDevice &device = tensor.get().device;
                               return py::make_tuple(device.type, device.id);
                             })
      .def_property_readonly("type", [](const Tensor &tensor) {
        const DLDataType &type = tensor.get().type;
        return py::make_tuple(type.code, type.bits, type.lanes);
      });
  py::class_<Memory>(module, "Memory", py::buffer_protocol())
      .def(py::init([](uint64_t address, int64_t size, bool isReadOnly,
                       py::object owner) {
        return new Memory{address, size, isReadOnly, std::move(owner)};
      }))
      .def_buffer(&Memory::describe);
}
