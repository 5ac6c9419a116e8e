// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How far results are from what is right, as piko-diff and piko-tune measure
// it.

#include "Core.h"

#include "Piko/Replay/Measure.h"
#include "Piko/Scene/ImageError.h"

#include <cstring>

namespace replay = piko::replay;
namespace render = piko::render;
namespace py = pybind11;

/// Rows of r, g, b and alpha, from an array's memory.
static render::Image copyImage(int width, int height, uint64_t address) {
  render::Image image{width, height, {}};
  image.pixels.resize(size_t(width) * size_t(height));
  static_assert(sizeof(piko::scene::Color) == 4 * sizeof(float));
  std::memcpy(image.pixels.data(), reinterpret_cast<const void *>(address),
              image.pixels.size() * sizeof(piko::scene::Color));
  return image;
}

/// (largest, mean, rms, p99, PSNR, FLIP) between two pictures of that size.
static py::tuple measurePictures(int width, int height, uint64_t reference,
                                 uint64_t picture) {
  auto measured = [&] {
    py::gil_scoped_release release;
    return render::compareImages(copyImage(width, height, reference),
                                 copyImage(width, height, picture));
  }();
  if (!measured)
    throw py::value_error(measured.error().message);
  return py::make_tuple(measured->largest, measured->mean, measured->rms,
                        measured->p99, measured->psnr, measured->flip);
}

namespace {

/// Numbers that a run left: a copy of arrays, name by name.
class Numbers {
public:
  /// `fields` are (name, offset, elements, stride, type), as records have them.
  void add(const std::string &name, const py::bytes &bytes, int64_t size,
           const std::vector<std::tuple<std::string, int64_t, int64_t, int64_t,
                                        int32_t>> &fields) {
    replay::Records &records = outcome.state[name];
    records.bytes = bytes;
    records.size = size;
    for (const auto &[field, offset, elements, stride, type] : fields)
      records.fields.push_back({field, offset, elements, stride, type});
  }

  /// (largest, mean, rms, p99) of what another run left.
  py::tuple measure(const Numbers &actual) const {
    replay::NumberErrors errors;
    {
      py::gil_scoped_release release;
      errors = replay::measureNumbers(outcome, actual.outcome);
    }
    return py::make_tuple(errors.largest, errors.mean, errors.rms, errors.p99);
  }

private:
  replay::Outcome outcome;
};

} // namespace

void piko::python::defineErrors(py::module_ &module) {
  module.def("measure_pictures", measurePictures);
  py::class_<Numbers>(module, "Numbers")
      .def(py::init<>())
      .def("add", &Numbers::add)
      .def("measure", &Numbers::measure);
}
