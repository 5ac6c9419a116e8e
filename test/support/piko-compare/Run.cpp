// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Run.h"

#include "Piko/Replay/CaptureFile.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>

using namespace piko;

namespace {

/// The value of one field.
class Values {
public:
  Values(unsigned seed, bool wide) : random(seed), wide(wide) {}

  void make(int32_t type, char *at, bool exact) {
    unsigned bits = random();
    bool any = wide && random() % 2 == 0 && !exact;
    switch (type) {
    case PIKORT_F32:
      return write(at, any ? anyFloat<float>() : float(plain(bits)));
    case PIKORT_F64:
      return write(at, any ? anyFloat<double>() : plain(bits));
    case PIKORT_I8: // may be a bool
      return write(at, int8_t(bits & 1));
    }
    int64_t whole = any ? anyInteger() : bits & 63;
    std::memcpy(at, &whole, size_t(1) << (type - PIKORT_I8));
  }

private:
  template <class T> static void write(char *at, T value) {
    std::memcpy(at, &value, sizeof(T));
  }
  static double plain(unsigned bits) { return double(bits % 5120) / 64 - 8; }
  int64_t anyInteger() {
    const int64_t special[] = {-1, INT32_MIN, INT32_MAX, INT64_MIN, INT64_MAX};
    unsigned choice = random() % 10;
    if (choice < 5)
      return special[choice];
    return int64_t(uint64_t(random()) << 32 | random()) >> random() % 64;
  }
  template <class T> T anyFloat() {
    using Limits = std::numeric_limits<T>;
    const T special[] = {Limits::infinity(),       -Limits::infinity(),
                         Limits::quiet_NaN(),      T(-0.0),
                         Limits::denorm_min() * 3, -Limits::max()};
    unsigned choice = random() % 12;
    if (choice < 6)
      return special[choice];
    T scaled = std::ldexp(T(1 + random() % 1000), int(random() % 60) - 30);
    return random() % 2 ? scaled : -scaled;
  }

  std::mt19937 random;
  bool wide;
};

} // namespace

void Run::check(int32_t status) {
  if (status != PIKORT_OK)
    throw std::runtime_error(pikort_message(pipeline));
}

Run::Run(Program made, const Case &input)
    : program(std::move(made)), input(input) {
  check(pikort_create(&program.program, &pipeline));
  if (input.capture.empty()) {
    makeInput();
    return;
  }
  auto capture = replay::readCapture(input.capture);
  if (!capture)
    throw std::runtime_error(capture.error().message);
  given = std::move(*capture);
}

void Run::makeInput() {
  check(pikort_set_domain(pipeline, int32_t(input.domain.size()),
                          input.domain.data()));
  if (input.loopLimit)
    check(pikort_set_loop_limit(pipeline, input.loopLimit));
  for (int32_t i = 0; i < pikort_source_count(pipeline); ++i) {
    pikort_source_info info;
    check(pikort_get_source_info(pipeline, i, &info));
    std::string name = "source " + std::to_string(i);
    int64_t count = input.count(size_t(i));
    memory[name] = makeRecords(info.record, count, name);
    pikort_record_info record;
    check(pikort_get_record(pipeline, info.record, &record));
    check(pikort_bind_source(pipeline, i, memory[name].data(), count,
                             record.size));
  }
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info info;
    check(pikort_get_state_info(pipeline, i, &info));
    if (info.kind != PIKORT_IMAGE && info.per_source < 0)
      initial[info.name] = makeRecords(
          info.record, info.kind == PIKORT_BUFFER ? input.elements : 1,
          info.name);
  }
}

std::string Run::makeRecords(int32_t index, int64_t count,
                             const std::string &who) {
  pikort_record_info record;
  check(pikort_get_record(pipeline, index, &record));
  std::string bytes(size_t(record.size * count), '\0');
  unsigned hash = input.seed;
  for (char c : who)
    hash = hash * 31 + unsigned(c);
  Values values(hash, input.wide);
  std::vector<replay::Field> fields = replay::getFields(pipeline, index);
  for (int64_t i = 0; i < count; ++i)
    for (const replay::Field &field : fields)
      for (int64_t e = 0; e < field.elements; ++e) {
        char *at =
            &bytes[size_t(i * record.size + field.offset + e * field.stride)];
        values.make(field.type, at, field.name.starts_with("exact"));
        if (field.name == "serial")
          std::memcpy(at, &i, size_t(1) << (field.type - PIKORT_I8));
      }
  return bytes;
}

void Run::bind() {
  if (given) {
    bound = given;
    if (std::string wrong = bound->bind(pipeline); !wrong.empty())
      throw std::runtime_error(input.capture + ": " + wrong);
    return;
  }
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info info;
    check(pikort_get_state_info(pipeline, i, &info));
    if (!initial.count(info.name))
      continue;
    std::string &bytes = memory[info.name] = initial[info.name];
    pikort_record_info record;
    check(pikort_get_record(pipeline, info.record, &record));
    if (info.kind == PIKORT_CONSTANT)
      check(pikort_bind_constant(pipeline, info.name, bytes.data(),
                                 int64_t(bytes.size())));
    else
      check(pikort_bind_buffer(pipeline, info.name, bytes.data(),
                               int64_t(bytes.size()) / record.size,
                               record.size));
  }
}

void Run::divide(int64_t strip, int64_t budget) {
  if (given)
    return;
  check(pikort_set_strip_size(pipeline, strip));
  check(pikort_set_memory_budget(pipeline, budget));
}

void Run::recordOwners() {
  check(pikort_set_unit_report(
      pipeline,
      [](void *data, const pikort_unit_run *unit) {
        Run &run = *static_cast<Run *>(data);
        std::lock_guard<std::mutex> lock(run.ownersMutex);
        for (int64_t bin = unit->bin_begin; bin < unit->bin_end; ++bin)
          run.threadsOf[{unit->stage, bin}].insert(unit->thread);
      },
      this));
}

void Run::capture(const std::string &path) {
  bind();
  check(pikort_capture(pipeline, path.c_str()));
}

replay::Outcome Run::operator()(int threads) {
  bind();
  check(pikort_set_threads(pipeline, threads));
  if (pikort_run(pipeline) == PIKORT_OK)
    return replay::readOutcome(pipeline);
  replay::Outcome outcome;
  outcome.error = pikort_message(pipeline);
  return outcome;
}
