// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Capture.cpp - What a run takes, as a file --------------------------===//
//
// Numbers are of 64 bits in the machine's order, strings their length and their
// bytes; docs/RuntimeABI.md has the format. pikort/capture.h reads it.
//
//===----------------------------------------------------------------------===//

#include "common/HostCalls.h"

#include "Piko/Support/OutputFile.h"
#include "pikort/capture.h"

#include <charconv>
#include <cstdlib>
#include <cstring>

using namespace piko::rt;

namespace {

class CaptureWriter {
public:
  explicit CaptureWriter(pikort_pipeline &p) : p(p) {}

  std::string write() {
    text.append(captureMagic);
    add(p.name);
    add(p.rank);
    for (int64_t extent : p.domain)
      add(extent);
    add(p.stripSize);
    add(p.memory.budget());
    add(p.loopLimit);
    std::vector<State *> states;
    for (State &state : p.states)
      if (state.kind != PIKORT_IMAGE && state.perSource < 0 && state.bound)
        states.push_back(&state);
    add(static_cast<int64_t>(states.size()));
    for (State *state : states)
      addState(*state);
    add(static_cast<int64_t>(p.sources.size()));
    for (size_t s = 0; s < p.sources.size(); ++s)
      addSource(static_cast<int32_t>(s));
    add(static_cast<int64_t>(captureSum(text)));
    return std::move(text);
  }

private:
  void add(int64_t number) {
    text.append(reinterpret_cast<const char *>(&number), sizeof(number));
  }
  void add(const std::string &string) {
    add(static_cast<int64_t>(string.size()));
    text += string;
  }
  void addBytes(const void *data, int64_t size) {
    add(size);
    if (size > 0)
      text.append(static_cast<const char *>(data), static_cast<size_t>(size));
  }

  void addLayout(const Record &record) {
    add(record.name);
    add(record.size);
    add(static_cast<int64_t>(record.fields.size()));
    for (const Field &field : record.fields) {
      add(field.name);
      for (int64_t number : {field.offset, field.elements, field.stride,
                             static_cast<int64_t>(field.type)})
        add(number);
    }
  }

  void addState(State &state) {
    const Record &record = p.records[state.record];
    add(state.name);
    add(state.kind);
    addLayout(record);
    if (state.kind == PIKORT_CONSTANT)
      return addBytes(state.bytes.data(),
                      static_cast<int64_t>(state.bytes.size()));
    int64_t size = state.view.extent[0] * record.size;
    if (!state.onDevice) {
      if (state.owned)
        bringToHost(p, state);
      return addBytes(state.view.data, size);
    }
    add(size);
    size_t before = text.size();
    text.resize(before + static_cast<size_t>(size));
    if (size > 0)
      download(text.data() + before, state.view.data, size);
  }

  void addSource(int32_t number) {
    const Source &source = p.sources[number];
    const Record &record = p.records[p.hostRecord(source.stage)];
    add(p.stages[source.stage].name);
    addLayout(record);
    int64_t size = source.count * record.size;
    if (!source.onDevice)
      return addBytes(source.data, size);
    add(size);
    size_t before = text.size();
    text.resize(before + static_cast<size_t>(size));
    if (size > 0)
      download(text.data() + before, source.data, size);
  }

  void download(void *to, const void *from, int64_t size) {
    p.accelerator->download(static_cast<uint8_t *>(to),
                            static_cast<const uint8_t *>(from), size);
    p.accelerator->finishStream();
  }

  pikort_pipeline &p;
  std::string text;
};

} // namespace

void piko::rt::capture(pikort_pipeline &p, const std::string &path) {
  std::string content = CaptureWriter(p).write();
  if (auto done = support::writeFile(path, content); !done)
    throw Failure{PIKORT_NOT_WRITTEN,
                  "pipeline " + quoted(p.name) + ": " + done.error().message};
}

/// A pipeline's name as a file's.
static std::string fileNameOf(const std::string &name) {
  std::string file;
  for (char c : name) {
    bool isPlain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                   (c >= 'A' && c <= 'Z') || c == '_' || c == '-';
    file += isPlain ? c : '_';
  }
  return file + ".capture";
}

/// Of the pipeline's, from 1.
static int64_t findWantedRun(const pikort_pipeline &p) {
  const char *text = std::getenv("PIKO_CAPTURE_RUN");
  if (!text)
    return 1;
  int64_t number = 0;
  const char *end = text + std::strlen(text);
  auto [stop, error] = std::from_chars(text, end, number);
  if (error != std::errc() || stop != end || number < 1)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "pipeline " + quoted(p.name) +
                      ": PIKO_CAPTURE_RUN: expected the number of a run, from "
                      "1, but got " +
                      quoted(text)};
  return number;
}

void piko::rt::captureAsAsked(pikort_pipeline &p) {
  const char *folder = std::getenv("PIKO_CAPTURE");
  if (!folder || !*folder)
    return;
  if (++p.captureRuns == findWantedRun(p))
    capture(p, std::string(folder) + "/" + fileNameOf(p.name));
}
