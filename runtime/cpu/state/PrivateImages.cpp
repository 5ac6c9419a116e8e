// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- PrivateImages.cpp - Pixels that threads select ---------------------===//

#include "cpu/state/PrivateImages.h"

#include "cpu/Parallel.h"

#include <algorithm>
#include <cstring>

using namespace piko::rt;

// What images of all lanes may take, and how many have some: all of them are
// read when the kernel ends.
static constexpr int64_t mostImageBytes = int64_t(512) << 20;
static constexpr size_t mostSharers = 8;
static constexpr int64_t chunk = int64_t(1) << 14; // pixels of a thread's turn

static int64_t countPixels(const State &state) {
  int64_t pixels = 1;
  for (int64_t extent : state.view.extent)
    pixels *= extent;
  return pixels;
}

static int64_t pixelSize(const pikort_pipeline &p, int32_t image) {
  return p.records[p.states[image].record].size;
}

/// What images of a lane's own take.
static int64_t imageBytes(const pikort_pipeline &p,
                          const Selection &selection) {
  int64_t perPixel = sizeof(int32_t);
  for (int32_t image : selection.images)
    perPixel += pixelSize(p, image);
  return perPixel * countPixels(p.states[selection.images.front()]);
}

/// How many lanes have images of their own: none if what threads save is not
/// worth it, by a guess of what a primitive takes. To begin and to combine a
/// pixel takes some nanoseconds.
static size_t countSharers(const pikort_pipeline &p, const Kernel &kernel,
                           size_t lanes) {
  if (p.memory.limit() > 0)
    return 0;
  int64_t bytes = 0;
  for (const Selection &selection : p.stages[kernel.stage].selections) {
    int64_t pixels = countPixels(p.states[selection.images.front()]);
    int64_t perPrimitive = selection.often ? 64 : 4;
    if (pixels > INT32_MAX || kernel.positions < pixels / perPrimitive)
      return 0;
    bytes += imageBytes(p, selection);
  }
  size_t most = std::min(lanes, mostSharers);
  if (bytes > 0)
    most = std::min(most, static_cast<size_t>(mostImageBytes / bytes));
  return most > 1 ? most : 0;
}

/// Makes what is not there yet. False if memory is refused.
static bool allocate(pikort_pipeline &p, const Selection &selection,
                     size_t lanes, PrivateImages &images) {
  int64_t pixels = countPixels(p.states[selection.images.front()]);
  if (pixels != images.pixels)
    images.ofLanes.clear();
  images.pixels = pixels;
  images.ofLanes.resize(std::max(images.ofLanes.size(), lanes));
  try {
    for (size_t i = 0; i < lanes; ++i) {
      PrivateImages::Own &own = images.ofLanes[i];
      if (own.units)
        continue;
      own.units = Array<int32_t>(p.memory, pixels, Use::State);
      for (size_t s = 0; i > 0 && s < selection.images.size(); ++s)
        own.images.emplace_back(
            p.memory, pixels * pixelSize(p, selection.images[s]), Use::State);
    }
    return true;
  } catch (const OutOfMemory &) {
    images.ofLanes.clear();
    return false;
  }
}

/// Nothing is selected yet: all lanes begin with the keys of the state.
static void fillOwn(pikort_pipeline &p, const Selection &selection,
                    size_t lanes, PrivateImages &images) {
  int32_t key = selection.images.front();
  int64_t size = pixelSize(p, key);
  const uint8_t *keys = p.states[key].view.data;
  parallelChunks(
      p.threads, images.pixels, chunk, [&](int64_t begin, int64_t end) {
        for (size_t i = 0; i < lanes; ++i) {
          PrivateImages::Own &own = images.ofLanes[i];
          std::fill(own.units.data() + begin, own.units.data() + end, -1);
          if (i > 0)
            std::memcpy(own.images.front().data() + begin * size,
                        keys + begin * size,
                        static_cast<size_t>((end - begin) * size));
        }
      });
}

/// What generated code sees.
static void setPointers(pikort_pipeline &p, const Selection &selection,
                        size_t lane, bool shared, PrivateImages &images) {
  PrivateImages::Own &own = images.ofLanes[lane];
  own.pointers.clear();
  for (size_t i = 0; i < selection.images.size(); ++i)
    own.pointers.push_back(shared && lane > 0
                               ? own.images[i].data()
                               : p.states[selection.images[i]].view.data);
  own.pointers.push_back(shared ? reinterpret_cast<uint8_t *>(own.units.data())
                                : nullptr);
}

void piko::rt::beginSelections(pikort_pipeline &p, Kernel &kernel) {
  const std::vector<Selection> &selections = p.stages[kernel.stage].selections;
  if (selections.empty())
    return;
  size_t lanes = kernel.runsSerially ? 1 : kernel.activeLanes;
  size_t sharing = countSharers(p, kernel, lanes);
  while (kernel.images.size() < selections.size())
    kernel.images.push_back(std::make_unique<PrivateImages>());
  bool shared = sharing > 0;
  for (size_t s = 0; s < selections.size(); ++s)
    shared = shared && allocate(p, selections[s], sharing, *kernel.images[s]);
  if (shared)
    kernel.activeLanes = lanes = sharing;
  kernel.mostThreads = shared ? static_cast<int32_t>(sharing) : 1;
  for (size_t s = 0; s < selections.size(); ++s) {
    PrivateImages &images = *kernel.images[s];
    if (shared)
      fillOwn(p, selections[s], lanes, images);
    else if (p.memory.limit() > 0)
      images.ofLanes.clear(); // there is other use for it
    images.ofLanes.resize(std::max(images.ofLanes.size(), lanes));
    for (size_t i = 0; i < lanes; ++i)
      setPointers(p, selections[s], i, shared, images);
  }
  for (size_t i = 0; i < lanes; ++i)
    kernel.lanes[i]->selects = false;
}

void piko::rt::endSelections(pikort_pipeline &p, Kernel &kernel) {
  if (kernel.source >= 0 || kernel.mostThreads == 1)
    return;
  const std::vector<Selection> &selections = p.stages[kernel.stage].selections;
  for (size_t s = 0; s < selections.size(); ++s) {
    PrivateImages &images = *kernel.images[s];
    parallelChunks(
        p.threads, images.pixels, chunk, [&](int64_t begin, int64_t end) {
          for (size_t i = 1; i < kernel.activeLanes; ++i)
            if (kernel.lanes[i]->selects)
              selections[s].select(images.ofLanes.front().pointers.data(),
                                   images.ofLanes[i].pointers.data(), begin,
                                   end);
        });
  }
}

uint8_t *const *pikoir_get_images(pikoir_writer *writer, int32_t selection) {
  Lane *lane = static_cast<Lane *>(writer);
  lane->selects = true;
  const Kernel &kernel = *lane->kernel;
  size_t number = 0; // of the lane
  while (kernel.lanes[number].get() != lane)
    ++number;
  return kernel.images[static_cast<size_t>(selection)]
      ->ofLanes[number]
      .pointers.data();
}
