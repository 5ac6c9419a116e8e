// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The end of a memory buffer, which is not copied.

#include "Piko/Frontend/BufferTail.h"

using namespace llvm;
using namespace piko;

namespace {
class BufferTail : public MemoryBuffer {
public:
  BufferTail(std::unique_ptr<MemoryBuffer> whole, size_t begin)
      : whole(std::move(whole)) {
    init(this->whole->getBufferStart() + begin, this->whole->getBufferEnd(),
         /*RequiresNullTerminator=*/false);
  }
  StringRef getBufferIdentifier() const override {
    return whole->getBufferIdentifier();
  }
  BufferKind getBufferKind() const override { return whole->getBufferKind(); }

private:
  std::unique_ptr<MemoryBuffer> whole;
};
} // namespace

std::unique_ptr<MemoryBuffer>
piko::dropFront(std::unique_ptr<MemoryBuffer> buffer, size_t begin) {
  return std::make_unique<BufferTail>(std::move(buffer), begin);
}
