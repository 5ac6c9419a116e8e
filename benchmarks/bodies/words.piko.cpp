// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Text: counts words and lines, and hashes each word.
#include <piko.h>

struct Range {
  int begin, end, index;
};
struct Counts {
  int words, lines;
  uint32_t hash;
};
struct State {
  piko::Buffer<uint8_t> text;
  piko::Buffer<Counts> counts;
};

struct Read : piko::Stage<0, 0, 1, Range>, piko::Uses<State> {
  static bool isLetter(uint8_t c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '\'';
  }
  void process(const Range &range) {
    Counts counts = {0, 0, 0};
    bool inside = false;
    uint32_t word = 2166136261u;
    for (int i = range.begin; i < range.end; ++i) {
      uint8_t c = state().text[i];
      if (isLetter(c)) {
        word = (word ^ (c | 32)) * 16777619u;
        inside = true;
        continue;
      }
      if (c == '\n')
        ++counts.lines;
      if (inside) {
        ++counts.words;
        counts.hash ^= word;
        word = 2166136261u;
      }
      inside = false;
    }
    state().counts[range.index] = counts;
  }
};
struct Words : piko::Pipe<State> {
  Read read;
  Words() { source(read); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Range> ranges;
  std::vector<uint8_t> text;
  std::vector<Counts> counts;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 1 << 20; ++i) {
      uint32_t kind = random.below(8);
      text.push_back(kind == 0   ? ' '
                     : kind == 1 ? "\n.,' "[random.below(5)]
                                 : uint8_t('a' + random.below(26)));
    }
    for (int i = 0; i < 256; ++i)
      ranges.push_back({i << 12, (i + 1) << 12, i});
    counts.resize(ranges.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().text, text);
    bodies::bind(pipe.state().counts, counts);
    pipe.feed(pipe.read, ranges);
  }
  uint64_t result(auto &) { return bodies::hash(counts); }
};
PIKO_BODY_MAIN(Words, Host)
#endif
