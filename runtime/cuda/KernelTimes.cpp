// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- KernelTimes.cpp - What grids of a frame take -----------------------===//

#include "cuda/KernelTimes.h"
#include "common/Pipeline.h"

using namespace piko::cuda;

void KernelTimes::record(CUstream stream) {
  if (used_ == events_.size()) {
    CUevent event = nullptr;
    device_.check(device_.driver.cuEventCreate(&event, CU_EVENT_DEFAULT),
                  "creating an event");
    events_.push_back(event);
  }
  device_.check(device_.driver.cuEventRecord(events_[used_], stream),
                "timing kernels");
  ++used_;
}

void KernelTimes::begin(CUstream stream) {
  used_ = 0;
  grids_.clear();
  record(stream);
}

void KernelTimes::note(CUstream stream, int32_t kernel, bool isJoin) {
  record(stream);
  grids_.push_back({kernel, isJoin});
}

void KernelTimes::add(std::vector<rt::KernelStats> &stats) {
  for (size_t i = 0; i < grids_.size(); ++i) {
    float milliseconds = 0;
    if (grids_[i].kernel < 0)
      continue;
    device_.check(device_.driver.cuEventElapsedTime(&milliseconds, events_[i],
                                                    events_[i + 1]),
                  "timing kernels");
    rt::KernelStats &kernel = stats[static_cast<size_t>(grids_[i].kernel)];
    kernel.milliseconds += double(milliseconds);
    kernel.joinMilliseconds += grids_[i].isJoin ? double(milliseconds) : 0;
    kernel.launches += !grids_[i].isJoin;
  }
  used_ = 0;
  grids_.clear();
}

void KernelTimes::end() noexcept {
  for (CUevent event : events_)
    device_.driver.cuEventDestroy(event);
  events_.clear();
}
