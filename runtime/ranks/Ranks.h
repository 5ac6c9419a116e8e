// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Ranks.h - A pipeline that is one of several ranks ------------------===//
//
// All ranks run the same program and so the same meetings, in the same order.
// In a meeting each rank first says whether it goes on and how many bytes it
// has for each other one. Where one has failed all tell their errors, the first
// of which in the order of one process becomes everybody's: so an error of a
// rank ends all, and nobody waits for who has left. The end of a run is a
// meeting, too.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_RANKS_RANKS_H
#define PIKO_RUNTIME_RANKS_RANKS_H

#include "common/Pipeline.h"
#include "pikort/abi_ranks.h"
#include "pikort/ranks.h"

#include <map>

namespace piko::rt {

struct Items; // Kernel.h

/// A field that several ranks change by one operation.
struct SharedField {
  int64_t offset, elements, stride, bytes;
  int32_t kind;
};

class Ranks {
public:
  Ranks(pikort_pipeline &p, const pikort_ranks &transport)
      : p_(p), transport_(transport) {}

  int32_t rank() const { return transport_.rank; }
  int32_t size() const { return transport_.size; }
  /// Who runs a bin of a stage that is divided by bins.
  int32_t ownerOf(const Stage &stage, int64_t bin) const;
  /// The same of all its bins.
  std::vector<int32_t> findOwners(const Stage &stage) const;
  /// Whether this rank runs a bin of a stage.
  bool owns(const Stage &stage, int64_t bin) const {
    return stage.partition == PIKOIR_BINS    ? ownerOf(stage, bin) == rank()
           : stage.partition == PIKOIR_PARTS ? true
                                             : rank() == 0;
  }

  /// Takes this rank's part of the sources.
  void beginRun();
  /// Of a source's primitives, with their buckets: only those buckets that this
  /// rank owns.
  void filter(const Stage &stage, Items &items, Array<uint32_t> &storage) const;
  /// These throw.
  void exchange(Edge &edge);
  void keep(int32_t state);
  void addField(const SharedField &field) { fields_.push_back(field); }
  void share(int32_t state, const Stage *stage, int32_t flags);
  /// Ends a run; its status is that of all ranks then.
  void finish() noexcept;

  struct Traffic {
    std::string from, to;
    int64_t records = 0, bytes = 0, kept = 0;
  };
  std::vector<Traffic> traffic;
  std::vector<pikort_rank_totals> totals; ///< By rank, after a run.

private:
  using Bytes = Array<uint8_t>;
  struct Piece {
    const void *data;
    int64_t bytes;
  };
  enum class Going : int64_t { On, Failed, Finished };

  void callTransport(const std::vector<const void *> &send,
                     const std::vector<int64_t> &sendBytes,
                     const std::vector<void *> &receive,
                     const std::vector<int64_t> &receiveBytes);
  std::vector<int64_t> meet(Going going, const std::vector<int64_t> &bytes,
                            pikort_rank_totals own = {});
  std::vector<Bytes> swap(const std::vector<Piece> &pieces);
  [[noreturn]] void agreeOnError();
  Traffic &trafficOf(const std::string &from, const std::string &to);

  void shareFirst(State &state, int64_t bytes);
  void shareOwned(State &state, const Stage &stage, bool toFirst);
  void shareChanges(State &state, Bytes &kept, bool toFirst);
  void count(State &state, const std::vector<Piece> &pieces);

  pikort_pipeline &p_;
  pikort_ranks transport_;
  int64_t meetings_ = 0;
  bool agreed_ = false; ///< This run has ended for all.
  std::string broken_;  ///< Why no meeting is possible any more.
  std::map<int32_t, Bytes> kept_;
  std::vector<SharedField> fields_;
};

/// Calls body(first, cells) for each row of cells of a stage's bin.
void forBinRows(const pikort_pipeline &p, const Stage &stage, int64_t bin,
                const std::function<void(int64_t, int64_t)> &body);

} // namespace piko::rt

#endif // PIKO_RUNTIME_RANKS_RANKS_H
