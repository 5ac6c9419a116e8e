// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ranks.hpp - Ranks for C++ ------------------------------------------===//
//
// What a pipeline's ranks() takes. pikort/mpi.hpp makes one of MPI's.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_RANKS_HPP
#define PIKORT_RANKS_HPP

#include <piko/macros_begin.h>

#include "piko/status.h"
#include "pikort/ranks.h"

#include <memory>
#include <utility>

namespace piko::rt {

/// This process, or thread, as one rank of several. Copies are the same one,
/// and pipelines that have been given one keep it.
class Communicator {
public:
  /// Of a host's own network; what the context points to outlives the runs.
  explicit Communicator(const pikort_ranks &ranks)
      : Communicator(Status(),
                     std::shared_ptr<pikort_ranks>(new pikort_ranks(ranks))) {}

  /// How the creation went; a pipeline that is given one that failed says it.
  const Status &created() const { return created_; }
  int32_t rank() const { return get()->rank; }
  int32_t size() const { return get()->size; }
  /// For the C functions; still owned by this object.
  const pikort_ranks *get() const { return ranks_.get(); }

protected:
  Communicator(Status created, std::shared_ptr<pikort_ranks> ranks)
      : created_(std::move(created)), ranks_(std::move(ranks)) {}

private:
  Status created_;
  std::shared_ptr<pikort_ranks> ranks_;
};

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_RANKS_HPP
