// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "cpu/Autotuner.h"

#include <algorithm>
#include <cmath>

using namespace piko::rt;

/// Units of each candidate before anything is decided, and at the latest.
static constexpr int64_t fewestUnits = 6, mostUnits = 256;
/// By how many standard deviations rates must differ to be told apart.
static constexpr double surely = 4;
/// By how much another version must be faster to be worth the change.
static constexpr double margin = 0.98;
/// A unit that takes longer than so many others was interrupted.
static constexpr double interrupted = 8;

/// What a unit has to do, about: primitives and buckets, at least one.
static double weightOf(const pikoir_unit &unit) {
  return static_cast<double>(std::max<int64_t>(
      1, unit.end - unit.begin + unit.bucket_end - unit.bucket_begin));
}

void Autotuner::Samples::add(double ticks, double weight) {
  if (count >= fewestUnits)
    ticks = std::min(ticks, interrupted * rate() * weight);
  ++count;
  t += ticks;
  w += weight;
  tt += ticks * ticks;
  tw += ticks * weight;
  ww += weight * weight;
}

double Autotuner::Samples::variance() const {
  double r = rate();
  return (tt - 2 * r * tw + r * r * ww) / (w * w);
}

Autotuner::Autotuner(std::span<Mapping> mappings) : mappings_(mappings) {
  int64_t mask = 0;
  for (size_t i = 0; i < mappings.size(); ++i)
    mask |= int64_t(mappings[i].expected) << i;
  current_ = mask;
}

/// Whether a loop is to run as vectors, where the host says so.
static std::optional<bool> findFixed(const Mapping &mapping) {
  switch (mapping.choice) {
  case MappingChoice::Measured:
    return std::nullopt;
  case MappingChoice::Expected:
    return mapping.expected;
  default:
    return mapping.choice == MappingChoice::Vectors;
  }
}

void Autotuner::publish(int64_t mask, int32_t state) {
  for (size_t i = 0; i < mappings_.size(); ++i) {
    Mapping &mapping = mappings_[i];
    mapping.chosen = mask >> i & 1;
    mapping.state = findFixed(mapping) ? PIKORT_MAPPING_FIXED : state;
  }
}

/// A mask with what the host has fixed.
static int64_t applyFixed(std::span<const Mapping> mappings, int64_t mask) {
  for (size_t i = 0; i < mappings.size(); ++i)
    if (std::optional<bool> vectors = findFixed(mappings[i]))
      mask = (mask & ~(int64_t(1) << i)) | int64_t(*vectors) << i;
  return mask;
}

/// Forgets what was measured where the host has another choice now.
void Autotuner::followHost() {
  auto isSame = [](MappingChoice choice, const Mapping &mapping) {
    return choice == mapping.choice;
  };
  if (std::equal(choices_.begin(), choices_.end(), mappings_.begin(),
                 mappings_.end(), isSame))
    return;
  choices_.clear();
  for (const Mapping &mapping : mappings_)
    choices_.push_back(mapping.choice);
  classes_ = {};
}

int64_t Autotuner::getCurrent() const {
  return applyFixed(mappings_, current_);
}

void Autotuner::beginLaunch(std::span<const pikoir_unit> units) {
  class_ = nullptr;
  weight_ = 0;
  trying_ = isTrial_ = false;
  followHost();
  current_ = getCurrent();
  if (std::all_of(mappings_.begin(), mappings_.end(), findFixed))
    return publish(current_, PIKORT_MAPPING_FIXED);
  if (units.empty())
    return;
  for (const pikoir_unit &unit : units)
    weight_ += weightOf(unit);
  double mean = std::max(1.0, weight_ / static_cast<double>(units.size()));
  auto number = static_cast<size_t>(std::log2(mean) / 2);
  class_ = &classes_[std::min(number, classCount - 1)];
  bool isNew = !class_->settled && class_->candidates.empty();
  if (isNew)
    startRound(*class_, current_);
  current_ = class_->mask;
  if (!class_->settled) {
    ++class_->launches;
    trying_ = isTrial_ = true;
  }
  publish(current_, isTrial_ ? PIKORT_MAPPING_TRIED : PIKORT_MAPPING_MEASURED);
}

/// Tries a choice and all that differ from it in one loop which it runs, but
/// for the one of which it is known already.
void Autotuner::startRound(Class &of, int64_t mask, int32_t known) {
  of.mask = mask;
  of.launches = 0;
  of.candidates.clear();
  of.candidates.push_back({mask, -1, {}, false});
  ++round_;
  for (const Mapping &mapping : mappings_) {
    bool runs = true;
    for (int32_t at = mapping.within; at >= 0; at = mappings_[at].within)
      runs &= !(mask >> at & 1);
    if (runs && mapping.number != known && !findFixed(mapping))
      of.candidates.push_back(
          {mask ^ int64_t(1) << mapping.number, mapping.number, {}, false});
  }
  of.settled = of.candidates.size() == 1;
}

int64_t Autotuner::begin(int64_t unit, AutotunerThread &thread) {
  if (!trying_)
    return current_;
  std::lock_guard<std::mutex> lock(mutex_);
  if (class_->settled) // by now
    return current_;
  if (thread.round != round_)
    thread = {0, round_, 0};
  size_t count = class_->candidates.size();
  thread.candidate = static_cast<size_t>(unit + class_->launches) % count;
  // One that is out leaves its units to the first one.
  if (class_->candidates[thread.candidate].isOut)
    thread.candidate = 0;
  return class_->candidates[thread.candidate].mask;
}

void Autotuner::note(const pikoir_unit &unit, AutotunerThread &thread,
                     int64_t ticks) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (class_->settled || thread.round != round_)
    return;
  // The first time code and tables are not in the cache.
  uint32_t bit = uint32_t(1) << thread.candidate;
  if (!(thread.warm & bit)) {
    thread.warm |= bit;
    return;
  }
  class_->candidates[thread.candidate].samples.add(static_cast<double>(ticks),
                                                   weightOf(unit));
  judge(*class_);
}

void Autotuner::judge(Class &of) {
  const Samples &first = of.candidates[0].samples;
  if (first.count < fewestUnits)
    return;
  size_t best = 0;
  bool isOpen = false;
  for (size_t i = 1; i < of.candidates.size(); ++i) {
    Candidate &other = of.candidates[i];
    if (other.isOut)
      continue;
    const Samples &samples = other.samples;
    if (samples.count < fewestUnits) {
      isOpen = true;
      continue;
    }
    double difference = samples.rate() - margin * first.rate(),
           deviation = std::sqrt(first.variance() + samples.variance());
    bool isLast = first.count >= mostUnits && samples.count >= mostUnits;
    if (std::abs(difference) < surely * deviation && !isLast)
      isOpen = true;
    else if (difference > 0)
      other.isOut = true;
    else if (best == 0 || samples.rate() < of.candidates[best].samples.rate())
      best = i;
  }
  if (best != 0 || !isOpen)
    finishRound(of, best);
}

void Autotuner::finishRound(Class &of, size_t best) {
  noteRatios(of);
  ++of.rounds;
  int64_t mask = of.candidates[best].mask;
  auto most = static_cast<int32_t>(mappings_.size()) + 1;
  if (best != 0 && of.rounds < most)
    startRound(of, mask, of.candidates[best].loop);
  else
    of.settled = true;
  if (!of.settled)
    return;
  of.mask = mask;
  of.candidates.clear();
  of.rounds = 0;
  of.rate = 0;
  current_ = mask;
  trying_ = false;
}

/// Says how much faster one version of a loop was than the other.
void Autotuner::noteRatios(const Class &of) {
  const Candidate &current = of.candidates[0];
  for (const Candidate &other : of.candidates) {
    if (other.loop < 0 || other.samples.count < fewestUnits)
      continue;
    double ratio = other.samples.rate() / current.samples.rate();
    bool isVectors = other.mask >> other.loop & 1;
    mappings_[static_cast<size_t>(other.loop)].ratio =
        isVectors ? ratio : 1 / ratio;
  }
}

void Autotuner::endLaunch(int64_t ticks) {
  if (!class_)
    return;
  Class &of = *std::exchange(class_, nullptr);
  double rate = static_cast<double>(ticks) / std::max(1.0, weight_);
  if (!of.settled) {
    // Each candidate has run each unit as often as others: the sums are of the
    // same work.
    auto count = static_cast<int64_t>(of.candidates.size());
    bool isEven = of.launches % count == 0 && of.launches / count >= 2;
    auto isMeasured = [](const Candidate &each) {
      return each.isOut || each.samples.count >= fewestUnits;
    };
    if (isEven &&
        std::all_of(of.candidates.begin(), of.candidates.end(), isMeasured)) {
      size_t best = 0;
      for (size_t i = 1; i < of.candidates.size(); ++i)
        if (!of.candidates[i].isOut &&
            of.candidates[i].samples.rate() <
                (best == 0 ? margin : 1) * of.candidates[best].samples.rate())
          best = i;
      finishRound(of, best);
    }
  } else if (!isTrial_) {
    checkDrift(of, rate);
  }
  trying_ = false;
  current_ = of.mask;
  publish(current_,
          of.settled ? PIKORT_MAPPING_MEASURED : PIKORT_MAPPING_TRIED);
}

void Autotuner::checkDrift(Class &of, double rate) {
  constexpr double much = 2;
  if (of.rate == 0)
    of.rate = rate;
  bool drifted = rate > much * of.rate || rate * much < of.rate;
  of.drifted = drifted ? of.drifted + 1 : 0;
  if (of.drifted < of.patience)
    return;
  of.patience *= 2;
  of.drifted = 0;
  startRound(of, of.mask);
}
