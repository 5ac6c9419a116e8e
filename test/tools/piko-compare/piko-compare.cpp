// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-compare: runs a pipeline on the CPU target and on the reference executor,
// on the same made-up input, and compares all state bit for bit.
//
//   piko-compare FILE [--reference FILE] [--pipe NAME] [--domain W H ..]
//                [--count N] [--seed S] [--threads T ..] [--runs N]
//                [--check[=nan:RECORD.FIELD,..]]
//
// The input follows from the seed: integer fields are whole numbers from 0 to
// 63, floats multiples of 1/64 in [-8, 72), bytes 0 or 1. Buffers that no source
// sizes get 64 elements, constants one value. Exit status 0 if all is equal.

#include "Piko/Driver/PipelineLoader.h"

#include <cstdio>
#include <cstring>
#include <map>
#include <random>
#include <stdexcept>

using piko::ExecutionTarget;
using piko::LoadedProgram;

namespace {

struct Options {
  std::string file, reference, pipe;
  std::vector<int64_t> domain{64, 48};
  int64_t count = 1000;
  unsigned seed = 1;
  std::vector<int> threads{1, 2, 7};
  int runs = 3;
  piko::CheckOptions check;
};

Options parse(int argc, char **argv) {
  Options options;
  auto isWord = [&](int i) {
    return i < argc && std::strncmp(argv[i], "--", 2) != 0;
  };
  for (int i = 1; i < argc;) {
    std::string name = argv[i++];
    if (name == "--check" || name.rfind("--check=", 0) == 0) {
      auto check = piko::parseCheckOptions(name.substr(7));
      if (!check)
        throw std::runtime_error("expected --check[=nan:RECORD.FIELD,..]");
      options.check = *check;
      continue;
    }
    if (name.rfind("--", 0) != 0) {
      options.file = name;
      continue;
    }
    std::vector<std::string> values;
    bool list = name == "--domain" || name == "--threads";
    while (isWord(i) && (list || values.empty()))
      values.push_back(argv[i++]);
    if (values.empty())
      throw std::runtime_error(name + " lacks its value");
    if (name == "--domain") {
      options.domain.clear();
      for (const std::string &value : values)
        options.domain.push_back(std::stoll(value));
    } else if (name == "--threads") {
      options.threads.clear();
      for (const std::string &value : values)
        options.threads.push_back(std::stoi(value));
    } else if (name == "--reference") {
      options.reference = values[0];
    } else if (name == "--pipe") {
      options.pipe = values[0];
    } else if (name == "--count") {
      options.count = std::stoll(values[0]);
    } else if (name == "--seed") {
      options.seed = unsigned(std::stoul(values[0]));
    } else if (name == "--runs") {
      options.runs = std::stoi(values[0]);
    } else {
      throw std::runtime_error("unknown option " + name);
    }
  }
  if (options.file.empty())
    throw std::runtime_error("expected a file");
  if (options.reference.empty())
    options.reference = options.file;
  return options;
}

/// A pipeline with made-up input.
class Run {
public:
  Run(const std::string &file, const Options &options, ExecutionTarget target);
  ~Run() { pikort_destroy(pipeline); }
  Run(const Run &) = delete;

  /// Runs; the bytes of all state by name, or the error as the only entry.
  std::map<std::string, std::string> operator()(int threads);

private:
  void check(int32_t status) {
    if (status != PIKORT_OK)
      throw std::runtime_error(pikort_message(pipeline));
  }
  std::string makeRecords(int32_t record, int64_t count,
                          const std::string &who);
  void bind();

  const Options &options;
  std::unique_ptr<LoadedProgram> program;
  pikort_pipeline *pipeline = nullptr;
  std::map<std::string, std::string> initial, memory;
};

Run::Run(const std::string &file, const Options &options,
         ExecutionTarget target)
    : options(options) {
  piko::LoadOptions load;
  load.pipeName = options.pipe;
  load.target = target;
  load.check = options.check;
  if (target == ExecutionTarget::Reference)
    load.check.numbers.clear();
  std::string diagnostics;
  program = piko::loadPipeline(file, load, diagnostics);
  if (!program)
    throw std::runtime_error("cannot load " + file + "\n" + diagnostics);
  check(pikort_create(&program->get(), &pipeline));
  check(pikort_set_domain(pipeline, int32_t(options.domain.size()),
                          options.domain.data()));
  for (int32_t i = 0; i < pikort_source_count(pipeline); ++i) {
    pikort_source_info info;
    check(pikort_get_source_info(pipeline, i, &info));
    std::string name = "source " + std::to_string(i);
    memory[name] = makeRecords(info.record, options.count, name);
    pikort_record_info record;
    check(pikort_get_record(pipeline, info.record, &record));
    check(pikort_bind_source(pipeline, i, memory[name].data(), options.count,
                             record.size));
  }
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info info;
    check(pikort_get_state_info(pipeline, i, &info));
    if (info.kind != PIKORT_IMAGE && info.per_source < 0)
      initial[info.name] = makeRecords(
          info.record, info.kind == PIKORT_BUFFER ? 64 : 1, info.name);
  }
}

std::string Run::makeRecords(int32_t index, int64_t count,
                             const std::string &who) {
  pikort_record_info record;
  check(pikort_get_record(pipeline, index, &record));
  std::string bytes(size_t(record.size * count), '\0');
  // What an input holds must not depend on the order of declarations.
  unsigned hash = options.seed;
  for (char c : who)
    hash = hash * 31 + unsigned(c);
  std::mt19937 random(hash);
  for (int64_t i = 0; i < count; ++i)
    for (int32_t f = 0; f < record.field_count; ++f) {
      pikort_field_info field;
      check(pikort_get_field(pipeline, index, f, &field));
      for (int64_t e = 0; e < field.elements; ++e) {
        char *at =
            &bytes[size_t(i * record.size + field.offset + e * field.stride)];
        unsigned bits = random();
        float real = float(bits % 5120) / 64 - 8;
        double wide = real;
        int64_t whole = field.type == PIKORT_I8 ? bits & 1 : bits & 63;
        switch (field.type) {
        case PIKORT_F32:
          std::memcpy(at, &real, 4);
          break;
        case PIKORT_F64:
          std::memcpy(at, &wide, 8);
          break;
        default:
          std::memcpy(at, &whole, size_t(1) << (field.type - PIKORT_I8));
        }
      }
    }
  return bytes;
}

void Run::bind() {
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

std::map<std::string, std::string> Run::operator()(int threads) {
  bind();
  check(pikort_set_threads(pipeline, threads));
  std::map<std::string, std::string> result;
  if (pikort_run(pipeline) != PIKORT_OK) {
    result["error"] = pikort_message(pipeline);
    return result;
  }
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info info;
    check(pikort_get_state_info(pipeline, i, &info));
    pikort_view view;
    check(pikort_get_view(pipeline, info.name, &view));
    int64_t bytes = view.record_size;
    for (int64_t extent : view.extent)
      bytes *= extent;
    if (bytes)
      result[info.name].assign(static_cast<const char *>(view.data),
                               size_t(bytes));
  }
  return result;
}

/// Says where two results differ first; true if they do not.
bool isEqual(const std::map<std::string, std::string> &expected,
             const std::map<std::string, std::string> &actual,
             const std::string &when) {
  if (expected == actual)
    return true;
  for (const auto &[name, bytes] : expected) {
    auto found = actual.find(name);
    if (found != actual.end() && found->second == bytes)
      continue;
    std::printf("%s: '%s' differs", when.c_str(), name.c_str());
    if (found != actual.end() && found->second.size() == bytes.size()) {
      size_t at = 0, count = 0;
      for (size_t i = bytes.size(); i-- > 0;)
        if (bytes[i] != found->second[i])
          at = i, ++count;
      std::printf(" in %zu of %zu bytes, first at %zu", count, bytes.size(),
                  at);
    }
    std::printf("\n");
  }
  for (const char *name : {"error"})
    for (const auto *side : {&expected, &actual})
      if (auto found = side->find(name); found != side->end())
        std::printf("  %s: %s\n", side == &expected ? "expected" : "got",
                    found->second.c_str());
  return false;
}

bool isBlank(const std::string &bytes) {
  return bytes.find_first_not_of('\0') == std::string::npos;
}

int compare(const Options &options) {
  Run reference(options.reference, options, ExecutionTarget::Reference);
  Run compiled(options.file, options, ExecutionTarget::CPU);
  std::map<std::string, std::string> expected = reference(1);
  bool blank = true;
  for (const auto &[name, bytes] : expected)
    blank &= isBlank(bytes);
  if (blank)
    throw std::runtime_error("the reference executor wrote nothing");
  bool equal = true;
  for (int threads : options.threads)
    for (int run = 0; run < options.runs; ++run)
      equal &= isEqual(expected, compiled(threads),
                       std::to_string(threads) + " threads, run " +
                           std::to_string(run));
  if (auto error = expected.find("error"); error != expected.end())
    std::printf("both stop: %s\n", error->second.c_str());
  else if (equal)
    std::printf("equal\n");
  return equal ? 0 : 1;
}

} // namespace

int main(int argc, char **argv) {
  try {
    return compare(parse(argc, argv));
  } catch (const std::exception &error) {
    std::fprintf(stderr, "piko-compare: %s\n", error.what());
    return 2;
  }
}
