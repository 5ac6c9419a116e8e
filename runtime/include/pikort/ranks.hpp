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

#include <utility>

namespace piko::rt {

/// Ranks that copies share; the last one frees them. (std::shared_ptr's header
/// brings all names of <unistd.h>, such as pipe, into a host's file.)
class SharedRanks {
public:
  /// `free`, if any, is called before the memory of the ranks is given back.
  SharedRanks(const pikort_ranks &ranks, void (*free)(pikort_ranks *))
      : owned_(new Owned{ranks, free, 1}) {}
  SharedRanks(const SharedRanks &other) : owned_(other.owned_) {
    __atomic_add_fetch(&owned_->users, 1, __ATOMIC_RELAXED);
  }
  SharedRanks &operator=(SharedRanks other) {
    std::swap(owned_, other.owned_);
    return *this;
  }
  ~SharedRanks() {
    if (__atomic_sub_fetch(&owned_->users, 1, __ATOMIC_ACQ_REL) > 0)
      return;
    if (owned_->free)
      owned_->free(&owned_->ranks);
    delete owned_;
  }
  pikort_ranks *get() const { return &owned_->ranks; }

private:
  struct Owned {
    pikort_ranks ranks;
    void (*free)(pikort_ranks *);
    int64_t users;
  };
  Owned *owned_;
};

/// This process, or thread, as one rank of several. Copies are the same one,
/// and pipelines that have been given one keep it.
class Communicator {
public:
  /// Of a host's own network; what the context points to outlives the runs.
  explicit Communicator(const pikort_ranks &ranks)
      : Communicator(Status(), SharedRanks(ranks, nullptr)) {}

  /// How the creation went; a pipeline that is given one that failed says it.
  const Status &created() const { return created_; }
  int32_t rank() const { return get()->rank; }
  int32_t size() const { return get()->size; }
  /// For the C functions; still owned by this object.
  const pikort_ranks *get() const { return ranks_.get(); }

protected:
  Communicator(Status created, SharedRanks ranks)
      : created_(std::move(created)), ranks_(std::move(ranks)) {}

private:
  Status created_;
  SharedRanks ranks_;
};

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_RANKS_HPP
