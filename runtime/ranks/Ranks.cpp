// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Ranks.cpp - Runs and meetings of ranks -------------------===//

#include "ranks/Ranks.h"

#include "cpu/CPUExecutor.h"
#include "cpu/Queue.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <optional>

using namespace piko::rt;

// --- Runs -------------------------------------------------------------------

void Ranks::prepareRun() {
  sparse_.clear();
  sourceBuckets_.clear();
  balanceOwners();
  owners_.beginRun();
  findCommonMemory();
}

/// Where owners follow the load, tells others what this rank's bins had.
void Ranks::balanceOwners() {
  for (OwnedGrid &grid : owners_.grids()) {
    if (grid.way != PIKORT_OWNERS_LOAD)
      continue;
    std::vector<int64_t> own;
    for (size_t bin = 0; bin < grid.owners.size(); ++bin)
      if (grid.owners[bin] == rank())
        own.push_back(grid.load[bin]);
    std::vector<Piece> pieces(
        static_cast<size_t>(size()),
        {own.data(), static_cast<int64_t>(own.size() * sizeof(int64_t))});
    Traffic &counted = trafficOf({}, "owners of bins");
    counted.bytes += pieces[0].bytes * (size() - 1);
    std::vector<Landing> received = swap(pieces);
    std::vector<int64_t> load(grid.owners.size()),
        next(static_cast<size_t>(size()));
    for (size_t bin = 0; bin < load.size(); ++bin) {
      auto owner = static_cast<size_t>(grid.owners[bin]);
      std::memcpy(&load[bin],
                  received[owner].data + sizeof(int64_t) * next[owner]++,
                  sizeof(int64_t));
    }
    int64_t before = grid.moved;
    owners_.balance(grid, load);
    counted.records += grid.moved - before;
  }
}

void Ranks::beginRun() {
  for (Source &source : p_.sources)
    takePart(source);
}

void Ranks::takePart(Source &source) const {
  const Stage &stage = p_.stages[source.stage];
  int64_t first = source.stripBegin, count = source.stripEnd - first;
  if (stage.partition == PIKOIR_PARTS || isDivided(source)) {
    auto part = [&](int64_t number) {
      return first + static_cast<int64_t>(static_cast<__int128>(count) *
                                          number / size());
    };
    source.begin = part(rank());
    source.end = part(rank() + 1);
  } else if (stage.partition == PIKOIR_FIRST_RANK && rank() != 0) {
    source.end = first;
  }
}

// --- Strips -----------------------------------------------------------------

int64_t Ranks::agreeOnStrip(int64_t proposed, bool failed) {
  std::vector<int64_t> all =
      meet(failed ? Going::Failed : Going::On,
           std::vector<int64_t>(static_cast<size_t>(size()), proposed));
  return *std::min_element(all.begin(), all.end());
}

void Ranks::takeBack(const StripGroup &group) {
  agreed_ = false;
  sourceBuckets_.erase(group.source);
  for (int32_t s : group.stages)
    for (int32_t e : p_.stages[s].outputs)
      if (e >= 0 && p_.edges[e].exchanged && !p_.edges[e].leavesStrips)
        queueOf(p_, p_.edges[e]).reset();
}

void Ranks::noteBins(const Stage &stage, const Kernel &kernel) {
  if (stage.partition != PIKOIR_BINS || kernel.source >= 0)
    return;
  OwnedGrid &grid = owners_.of(stage);
  for (int64_t bin = 0; bin < stage.bins(); ++bin) {
    int64_t count = kernel.offsets[(bin + 1) * stage.tiles] -
                    kernel.offsets[bin * stage.tiles];
    auto at = static_cast<size_t>(bin);
    grid.load[at] += count;
    if (count > 0 || (stage.visitsAll && grid.owners[at] == rank()))
      grid.ran[at] = true;
  }
  for (int64_t call = 0; call < kernel.calls.size(); ++call)
    grid.ran[static_cast<size_t>(kernel.calls[call].bin)] = true;
}

void Ranks::noteBuckets(const Stage &stage, const Items &items) {
  if (stage.partition != PIKOIR_BINS)
    return;
  OwnedGrid &grid = owners_.of(stage);
  for (int64_t k = 0; k < items.pairCount; ++k) {
    uint32_t bucket = items.pairs[k] & ~PIKOIR_FIRST_BUCKET;
    auto bin = static_cast<size_t>(bucket / stage.tiles);
    ++grid.load[bin];
    grid.ran[bin] = true;
  }
}

// --- Memory that ranks share ------------------------------------------------

/// What $PIKO_RANK_MEMORY says: whether ranks of one machine share memory.
static bool sharesMemory() {
  const char *text = std::getenv("PIKO_RANK_MEMORY");
  std::string said = text && *text ? text : "common";
  if (said != "common" && said != "apart")
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "PIKO_RANK_MEMORY: expected common or apart, but got '" +
                      said + "'"};
  return said == "common";
}

/// The first rank's images are others', too, where these can map them. Who has
/// a limit for memory has memory of its own, as nobody else counts that.
void Ranks::findCommonMemory() {
  std::map<int32_t, int64_t> offsets;
  int64_t bytes = 0;
  for (size_t s = 0; s < p_.states.size(); ++s) {
    const State &state = p_.states[s];
    if (state.commonStage < 0)
      continue;
    int64_t size = p_.records[state.record].size;
    bool overflow = false;
    for (int32_t d = 0; d < p_.rank; ++d)
      overflow |= __builtin_mul_overflow(size, p_.domain[d], &size);
    if (overflow || size > INT64_MAX / 4 - bytes)
      throw OutOfMemory{INT64_MAX};
    offsets[static_cast<int32_t>(s)] = bytes;
    bytes += (size + 4095) / 4096 * 4096;
  }
  if (offsets.empty() || size() == 1)
    return;
  auto n = static_cast<size_t>(size());
  // The host of the first rank has seen what the run before has left there.
  std::vector<int64_t> all = meet(Going::Begin, std::vector<int64_t>(n, bytes));
  for (int64_t other : all)
    if (other != bytes)
      breakOff("expected all ranks to have the same domain, but they do not");
  if (bytes == commonBytes_)
    return;
  dropCommonMemory();
  commonBytes_ = bytes;
  bool shares = sharesMemory() && p_.memory.limit() == 0 && bytes > 0;
  CommonMemory::Place place;
  if (rank() == 0 && shares)
    place = common_.make(bytes);
  std::vector<CommonMemory::Place> places(n);
  std::vector<const void *> send(n, &place);
  std::vector<void *> receive(n);
  std::vector<int64_t> sendBytes(n, rank() == 0 ? sizeof place : 0),
      receiveBytes(n);
  for (size_t r = 0; r < n; ++r)
    receive[r] = &places[r];
  sendBytes[static_cast<size_t>(rank())] = 0;
  receiveBytes[0] = rank() == 0 ? 0 : sizeof place;
  callTransport(send, sendBytes, receive, receiveBytes);
  bool found =
      rank() == 0 ? place.file >= 0 : shares && common_.find(places[0]);
  all = meet(Going::Begin, std::vector<int64_t>(n, found));
  bool isCommon = found;
  for (int64_t other : all)
    isCommon &= other == 1;
  common_.close();
  if (isCommon)
    commonOffsets_ = std::move(offsets);
  else
    common_.reset();
}

/// No image lies there any more.
void Ranks::dropCommonMemory() {
  for (auto [state, offset] : std::exchange(commonOffsets_, {}))
    if (p_.states[state].owned.isBorrowed()) {
      p_.states[state].own({});
      p_.states[state].view.data = nullptr;
    }
  common_.reset();
  commonBytes_ = -1;
}

uint8_t *Ranks::commonMemory(const State &state) const {
  auto known =
      commonOffsets_.find(static_cast<int32_t>(&state - p_.states.data()));
  return known == commonOffsets_.end() ? nullptr
                                       : common_.data() + known->second;
}

bool Ranks::clearsOwnedOnly(const Stage &stage, int32_t state) {
  if (stage.partition != PIKOIR_BINS)
    return false;
  if (commonMemory(p_.states[state]))
    return true;
  // What goes to the first rank alone are bins that something has come to.
  if (rank() != 0)
    sparse_.insert(state);
  return rank() != 0;
}

// --- Meetings ---------------------------------------------------------------

void Ranks::callTransport(const std::vector<const void *> &send,
                          const std::vector<int64_t> &sendBytes,
                          const std::vector<void *> &receive,
                          const std::vector<int64_t> &receiveBytes) {
  if (broken_.empty() &&
      transport_.exchange(transport_.context, send.data(), sendBytes.data(),
                          receive.data(), receiveBytes.data()) == 0)
    return;
  if (broken_.empty())
    broken_ = "rank " + std::to_string(rank()) + " of " +
              std::to_string(size()) + ": " +
              transport_.message(transport_.context);
  throw Failure{PIKORT_RANK_FAILED,
                "pipeline " + quoted(p_.name) + ": " + broken_};
}

/// What a rank says first: how many meetings there have been, how it goes on,
/// and how many bytes follow, or at the end what it has done.
std::vector<int64_t> Ranks::meet(Going going, const std::vector<int64_t> &bytes,
                                 pikort_rank_totals own) {
  using Header = std::array<int64_t, 5>;
  auto n = static_cast<size_t>(size());
  std::vector<Header> out(n), in(n);
  std::vector<const void *> send(n);
  std::vector<void *> receive(n);
  std::vector<int64_t> sizes(n, sizeof(Header));
  ++meetings_;
  for (size_t r = 0; r < n; ++r) {
    out[r] = {meetings_, static_cast<int64_t>(going), bytes[r], own.bytes,
              own.peak};
    send[r] = &out[r];
    receive[r] = &in[r];
  }
  auto self = static_cast<size_t>(rank());
  in[self] = out[self];
  sizes[self] = 0;
  callTransport(send, sizes, receive, sizes);
  bool failed = false, same = true;
  std::vector<int64_t> result(n);
  for (size_t r = 0; r < n; ++r) {
    failed |= in[r][1] == static_cast<int64_t>(Going::Failed);
    same &= in[r][0] == meetings_ &&
            (in[r][1] == out[self][1] || failed || going == Going::Failed);
    result[r] = in[r][2];
  }
  if (failed)
    agreeOnError();
  if (!same)
    breakOff("expected all ranks to run the same program with the same number "
             "of runs, but they do not");
  if (going == Going::Finished) {
    totals.resize(n);
    for (size_t r = 0; r < n; ++r)
      totals[r] = {in[r][3], in[r][4]};
  }
  return result;
}

void Ranks::breakOff(const std::string &why) {
  broken_ = "rank " + std::to_string(rank()) + ": " + why;
  throw Failure{PIKORT_RANK_FAILED,
                "pipeline " + quoted(p_.name) + ": " + broken_};
}

/// Brings a piece to each rank; gives what each has for this one. Where memory
/// for that is refused it comes all the same, as others wait for nothing, and
/// is dropped; all hear of it in the next meeting.
std::vector<Ranks::Landing> Ranks::swap(const std::vector<Piece> &pieces,
                                        Placement placement) {
  auto n = static_cast<size_t>(size());
  auto self = static_cast<size_t>(rank());
  std::vector<int64_t> sendBytes(n);
  for (size_t r = 0; r < n; ++r)
    sendBytes[r] = pieces[r].bytes;
  std::vector<int64_t> receiveBytes = meet(Going::On, sendBytes);
  std::vector<Landing> result(n);
  std::vector<std::unique_ptr<uint8_t[]>> dropped(n);
  std::vector<const void *> send(n);
  std::vector<void *> receive(n);
  std::optional<OutOfMemory> refused;
  for (size_t r = 0; r < n; ++r) {
    send[r] = pieces[r].data;
    if (receiveBytes[r] == 0)
      continue;
    try {
      if (!refused)
        result[r] = land(receiveBytes[r], placement);
    } catch (const OutOfMemory &why) {
      refused = why;
    }
    receive[r] = result[r].data;
    if (!refused || r == self)
      continue;
    dropped[r].reset(new (std::nothrow)
                         uint8_t[static_cast<size_t>(receiveBytes[r])]);
    if (!dropped[r])
      breakOff("out of memory for what other ranks send");
    receive[r] = dropped[r].get();
  }
  if (sendBytes[self] > 0 && !refused)
    std::memcpy(receive[self], send[self],
                static_cast<size_t>(sendBytes[self]));
  sendBytes[self] = receiveBytes[self] = 0;
  callTransport(send, sendBytes, receive, receiveBytes);
  if (refused)
    throw *refused;
  return result;
}

/// Room for what comes. Bytes begin at multiples of eight.
Ranks::Landing Ranks::land(int64_t bytes, const Placement &placement) {
  Landing landing;
  landing.memory = Bytes(p_.memory, bytes + 8 * placement.size);
  landing.data = landing.memory.data();
  landing.bytes = bytes;
  auto like = reinterpret_cast<uintptr_t>(placement.like);
  auto size = static_cast<uintptr_t>(placement.size);
  for (uintptr_t pad = 0; pad < 8 * size; pad += 8) {
    auto at = reinterpret_cast<uintptr_t>(landing.memory.data()) + pad +
              static_cast<uintptr_t>(placement.after);
    if (at % size == like % size) {
      landing.data += pad;
      break;
    }
  }
  return landing;
}

// --- Errors -----------------------------------------------------------------

namespace {

/// An error of a rank, but for its texts.
struct Told {
  int64_t failed;
  ErrorPlace place;
  int64_t code;
  int64_t textBytes, nameBytes, barrierBytes;
};

struct Error {
  Told told;
  std::string text, name, barrier;
  auto key() const {
    const ErrorPlace &at = told.place;
    return std::make_tuple(at.kernel, at.depth, at.unit, told.code, at.stage,
                           name, at.bin, at.state, at.a, at.b, barrier);
  }
};

} // namespace

void Ranks::agreeOnError() {
  agreed_ = true;
  auto n = static_cast<size_t>(size());
  auto self = static_cast<size_t>(rank());
  p_.settle();
  Error mine{};
  mine.told.failed = p_.status != PIKORT_OK;
  if (mine.told.failed) {
    mine.told.place = p_.errorPlace;
    mine.told.code = p_.status;
    mine.text = p_.message;
    mine.name = p_.errorName;
    mine.barrier = p_.errorBarrier;
    if (mine.told.code == PIKORT_OUT_OF_MEMORY)
      mine.text = "rank " + std::to_string(rank()) + ": " + mine.text;
    mine.told.textBytes = static_cast<int64_t>(mine.text.size());
    mine.told.nameBytes = static_cast<int64_t>(mine.name.size());
    mine.told.barrierBytes = static_cast<int64_t>(mine.barrier.size());
  }
  std::vector<Error> all(n);
  std::vector<const void *> send(n, &mine.told);
  std::vector<void *> receive(n);
  std::vector<int64_t> sizes(n, sizeof(Told));
  for (size_t r = 0; r < n; ++r)
    receive[r] = &all[r].told;
  sizes[self] = 0;
  callTransport(send, sizes, receive, sizes);
  all[self] = mine;
  std::string texts = mine.text + mine.name + mine.barrier;
  std::vector<std::string> received(n);
  std::vector<int64_t> bytes(n);
  for (size_t r = 0; r < n; ++r) {
    const Told &told = all[r].told;
    bytes[r] = told.textBytes + told.nameBytes + told.barrierBytes;
    received[r].resize(static_cast<size_t>(bytes[r]));
    send[r] = texts.data();
    receive[r] = received[r].data();
    sizes[r] = static_cast<int64_t>(texts.size());
  }
  sizes[self] = bytes[self] = 0;
  callTransport(send, sizes, receive, bytes);
  const Error *first = nullptr;
  for (size_t r = 0; r < n; ++r) {
    Error &error = all[r];
    if (!error.told.failed)
      continue;
    if (r != self) {
      auto text = static_cast<size_t>(error.told.textBytes);
      auto name = static_cast<size_t>(error.told.nameBytes);
      error.text = received[r].substr(0, text);
      error.name = received[r].substr(text, name);
      error.barrier = received[r].substr(text + name);
    }
    if (!first || error.key() < first->key())
      first = &error;
  }
  p_.clearStatus();
  throw Failure{first ? static_cast<int32_t>(first->told.code)
                      : int32_t(PIKORT_RANK_FAILED),
                first ? first->text : "a rank failed and did not say why"};
}

void Ranks::finish() noexcept {
  p_.settle();
  if (!std::exchange(agreed_, false) && broken_.empty()) {
    bool failed = p_.status != PIKORT_OK;
    pikort_rank_totals own{0, p_.memory.peak()};
    for (const Traffic &edge : traffic)
      own.bytes += edge.bytes;
    guarded(&p_, "pipeline", [&] {
      meet(failed ? Going::Failed : Going::Finished,
           std::vector<int64_t>(static_cast<size_t>(size())), own);
    });
    agreed_ = false;
  } else if (!broken_.empty()) {
    guarded(&p_, "pipeline", [&] {
      throw Failure{PIKORT_RANK_FAILED,
                    "pipeline " + quoted(p_.name) + ": " + broken_};
    });
  }
  kept_.clear();
  fields_.clear();
}

Ranks::Traffic &Ranks::trafficOf(const std::string &from,
                                 const std::string &to) {
  for (Traffic &known : traffic)
    if (known.from == from && known.to == to)
      return known;
  return traffic.emplace_back(Traffic{from, to});
}
