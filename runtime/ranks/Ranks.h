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
#include "ranks/CommonMemory.h"
#include "ranks/Owners.h"

#include <functional>
#include <map>
#include <set>

namespace piko::rt {

struct Items;  // Kernel.h
struct Kernel; // Kernel.h
struct Stream; // Kernel.h

/// A field that several ranks change by one operation.
struct SharedField {
  int64_t offset, elements, stride, bytes;
  int32_t kind;
};

class Ranks {
public:
  Ranks(pikort_pipeline &p, const pikort_ranks &transport)
      : p_(p), transport_(transport), owners_(p, transport.size) {}

  ~Ranks() { dropCommonMemory(); }
  Ranks(const Ranks &) = delete;
  Ranks &operator=(const Ranks &) = delete;

  int32_t rank() const { return transport_.rank; }
  int32_t size() const { return transport_.size; }
  /// Who runs the bins of a stage that is divided by bins.
  const std::vector<int32_t> &ownersOf(const Stage &stage) {
    return owners_.of(stage).owners;
  }
  /// Whether this rank runs a bin of a stage.
  bool owns(const Stage &stage, int64_t bin) {
    return stage.partition == PIKOIR_BINS
               ? ownersOf(stage)[static_cast<size_t>(bin)] == rank()
           : stage.partition == PIKOIR_FIRST_RANK ? rank() == 0
                                                  : true;
  }

  /// Before there is any state: finds owners, and memory for images that ranks
  /// of one machine share.
  void prepareRun();
  /// Takes this rank's part of the sources.
  void beginRun();
  /// Takes this rank's part of a source's strip.
  void takePart(Source &source) const;
  /// The smallest size of a strip that a rank proposes. Throws, also if another
  /// rank has failed.
  int64_t agreeOnStrip(int64_t proposed, bool failed);
  /// Whether an error of this run is known to all.
  bool hasAgreed() const { return agreed_; }
  /// Goes on after an error that all know: drops what came in the strip.
  void takeBack(const StripGroup &group);
  /// The memory of an image that is common; null: it is this rank's own.
  uint8_t *commonMemory(const State &state) const;
  /// Which bins a kernel runs.
  void noteBins(const Stage &stage, const Kernel &kernel);
  /// The same of a launch that is serial.
  void noteBuckets(const Stage &stage, const Items &items);
  /// Whether an image is cleared here in this rank's bins alone.
  bool clearsOwnedOnly(const Stage &stage, int32_t state);
  /// Of a source's primitives, with their buckets: only those buckets that this
  /// rank owns.
  void filter(const Stage &stage, Items &items, Array<uint32_t> &storage);
  /// These throw.
  void exchange(Edge &edge);
  void exchangeSource(int32_t source);
  /// The buckets of a source that has been exchanged; whether it has been.
  bool takeBuckets(int32_t source, Array<uint32_t> &buckets);
  void keep(int32_t state, bool cleared);
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
    const void *data = nullptr;
    int64_t bytes = 0;
  };
  /// What has come from a rank.
  struct Landing {
    Bytes memory;
    uint8_t *data = nullptr;
    int64_t bytes = 0;
  };
  /// What a rank says in a meeting; all that go on say the same.
  enum class Going : int64_t { On, Failed, Finished, Begin };
  /// What a piece of state has held.
  struct Kept {
    bool cleared = false;
    Bytes bytes; ///< If it was not clear.
  };

  void callTransport(const std::vector<const void *> &send,
                     const std::vector<int64_t> &sendBytes,
                     const std::vector<void *> &receive,
                     const std::vector<int64_t> &receiveBytes);
  std::vector<int64_t> meet(Going going, const std::vector<int64_t> &bytes,
                            pikort_rank_totals own = {});
  /// Where records shall lie in what comes: after so many bytes, and at
  /// multiples of their size from another one.
  struct Placement {
    const uint8_t *like = nullptr;
    int64_t after = 0, size = 1;
  };
  std::vector<Landing> swap(const std::vector<Piece> &pieces,
                            Placement placement);
  std::vector<Landing> swap(const std::vector<Piece> &pieces) {
    return swap(pieces, {});
  }
  Landing land(int64_t bytes, const Placement &placement);
  bool isDivided(const Source &source) const;
  [[noreturn]] void agreeOnError();
  [[noreturn]] void breakOff(const std::string &why);
  Traffic &trafficOf(const std::string &from, const std::string &to);

  void balanceOwners();
  void findCommonMemory();
  void dropCommonMemory();

  void shareFirst(State &state, int64_t bytes);
  void shareOwned(int32_t state, const Stage &stage, bool toFirst);
  void shareChanges(State &state, const Kept &kept, int64_t elements,
                    const Stage *owners, bool toFirst);
  void count(State &state, const std::vector<Piece> &pieces);

  pikort_pipeline &p_;
  pikort_ranks transport_;
  Owners owners_;
  int64_t meetings_ = 0;
  bool agreed_ = false; ///< This run has ended for all.
  std::string broken_;  ///< Why no meeting is possible any more.
  CommonMemory common_;
  int64_t commonBytes_ = -1;                 ///< That were looked for last.
  std::map<int32_t, int64_t> commonOffsets_; ///< Of states.
  /// Cleared in this rank's bins alone.
  std::set<int32_t> sparse_;
  std::map<int32_t, Kept> kept_;
  std::map<int32_t, Array<uint32_t>> sourceBuckets_;
  std::vector<SharedField> fields_;
};

/// Calls body(first, cells) for each row of cells of a stage's bin.
void forBinRows(const pikort_pipeline &p, const Stage &stage, int64_t bin,
                const std::function<void(int64_t, int64_t)> &body);

} // namespace piko::rt

#endif // PIKO_RUNTIME_RANKS_RANKS_H
