// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Entries.h - Reads what threads have left in a log ------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_ENTRIES_H
#define PIKO_RUNTIME_CUDA_DEVICE_ENTRIES_H

#include "cuda/device/Grid.h"

namespace piko::cuda {

/// As in rt::noBucket: a source's primitive that has none.
constexpr uint32_t noBucket = 0xffffffffu;

inline const uint8_t *payload(const pikoir_entry *entry) {
  return reinterpret_cast<const uint8_t *>(entry + 1);
}

inline const pikoir_entry *entryAt(int64_t address) {
  return reinterpret_cast<const pikoir_entry *>(address);
}

/// Where the entry after `entry` is, past links.
inline int64_t skipLinks(int64_t at, int64_t end) {
  while (at != end && entryAt(at)->kind == PIKOIR_ENTRY_LINK)
    at = *reinterpret_cast<const int64_t *>(&entryAt(at)->number);
  return at;
}

/// Walks a span for what is of an input, and tells `sink`:
///   emit(mine)        a record of the port, or of another one of the stage
///   keep(record)      a record of the port that counts; of a source's
///                     AssignBin, that a primitive begins: null
///   place(bucket)       its next bucket, above those before
///   insert(bucket)      a bucket that is not, and none of those before
///   next()            the position has ended
///   fail()            what no join can do
/// The rules are those of pikoir_append, pikoir_place and pikoir_next.
template <class Sink> class SpanReader {
public:
  SpanReader(const JoinInput &input, const Shape &shape, Sink &sink)
      : input_(input), placed_(shape.placed), buckets_(shape.buckets),
        sink_(sink) {}

  void read(const pikoir_span &span) {
    for (int64_t at = skipLinks(span.begin, span.end); at != span.end;
         at = skipLinks(at + entryAt(at)->bytes, span.end)) {
      const pikoir_entry *entry = entryAt(at);
      if (entry->stage != input_.stage)
        continue;
      switch (entry->kind) {
      case PIKOIR_ENTRY_RECORD:
        readRecord(entry);
        break;
      case PIKOIR_ENTRY_BUCKET:
        if (entry->number == input_.port)
          readBucket(entry, span);
        break;
      case PIKOIR_ENTRY_NEXT:
        readNext();
        break;
      default:
        break;
      }
    }
  }

private:
  void readRecord(const pikoir_entry *entry) {
    bool isMine = entry->number == input_.port;
    sink_.emit(isMine);
    if (!isMine)
      return;
    record_ = entry;
    last_ = -1;
    if (!placed_)
      sink_.keep(entry);
  }

  void readBucket(const pikoir_entry *entry, const pikoir_span &span) {
    auto bucket = *reinterpret_cast<const int64_t *>(payload(entry));
    if (static_cast<uint64_t>(bucket) >= static_cast<uint64_t>(buckets_) ||
        (!record_ && !input_.isSource))
      return sink_.fail();
    if (bucket == last_)
      return;
    if (last_ < 0) {
      firstBucket_ = entry;
      sink_.keep(record_);
    }
    if (bucket > last_) {
      last_ = bucket;
      sink_.place(static_cast<uint32_t>(bucket));
    } else if (!isKnown(entry, bucket, span)) {
      sink_.insert(static_cast<uint32_t>(bucket));
    }
  }

  /// Whether a bucket is among those of the record before `entry`.
  bool isKnown(const pikoir_entry *entry, int64_t bucket,
               const pikoir_span &span) const {
    auto end = reinterpret_cast<int64_t>(entry);
    for (auto at = reinterpret_cast<int64_t>(firstBucket_); at != end;
         at = skipLinks(at + entryAt(at)->bytes, span.end)) {
      const pikoir_entry *before = entryAt(at);
      if (before->kind == PIKOIR_ENTRY_BUCKET &&
          before->stage == input_.stage && before->number == input_.port &&
          *reinterpret_cast<const int64_t *>(payload(before)) == bucket)
        return true;
    }
    return false;
  }

  void readNext() {
    if (input_.isSource) {
      if (last_ < 0) {
        sink_.keep(nullptr);
        sink_.place(noBucket);
      }
      last_ = -1;
    }
    sink_.next();
  }

  const JoinInput &input_;
  bool placed_;
  int64_t buckets_;
  Sink &sink_;
  const pikoir_entry *record_ = nullptr, *firstBucket_ = nullptr;
  int64_t last_ = -1;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_ENTRIES_H
