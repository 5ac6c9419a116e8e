// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Step.cpp - After a position of a loop with a stack ----------------===//
//
// A module of its own, for grids of one warp: there is little to do, and others
// would wait at barriers.
//
//===----------------------------------------------------------------------===//

#define PIKO_ONE_WARP
#include "cuda/device/Stack.h"

using namespace piko::cuda;

namespace {

class Step : FrameTask {
public:
  explicit Step(const StackArgs &args)
      : FrameTask(*args.frame, args.number, /*work=*/0), args_(args),
        stack_(grid_, args) {}

  void run() {
    bool goesOn = FrameTask::run([&] {
      stack_.push();
      stack_.next();
    });
    if (!Grid::isFirst())
      return;
    args_.loop->again = 0;
    if (goesOn)
      stack_.publish(*args_.frame);
  }

private:
  const StackArgs &args_;
  Stack stack_;
};

} // namespace

extern "C" [[clang::nvptx_kernel]] void piko_step(const StackArgs *args) {
  Step(*args).run();
}
