// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The standard library's algorithms on local arrays: pointers that are halved,
// moved towards each other, swapped between two arrays, compared and
// subtracted, and functions that change what they have captured.
// RUN: %compare_targets %s --count 3000 --wide | FileCheck %s
// CHECK: equal
#include <piko.h>

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>

struct Numbers {
  int values[7];
  int x, y, serial;
};
struct Result {
  int64_t found[24];
};
struct State {
  piko::Buffer<Result> results;
};
struct Total {
  int64_t sum;
  int32_t count;
};
struct Pair {
  int key, value;
};

struct Algorithm : piko::Stage<0, 0, 64, Numbers>, piko::Uses<State> {
  void process(const Numbers &p) {
    int64_t *out = state().results[p.serial].found;
    search(p, out);
    change(p, out);
    capture(p, out);
    equal(p, out);
  }

  static void search(const Numbers &p, int64_t *out) {
    std::array<int, 7> a;
    std::copy(std::begin(p.values), std::end(p.values), a.begin());
    std::partial_sort(a.begin(), a.end(), a.end());
    auto lower = std::lower_bound(a.begin(), a.end(), p.x);
    out[0] = lower - a.begin();
    out[1] = lower != a.end() ? *lower : -1;
    out[2] = std::upper_bound(a.begin() + 1, a.end() - 1, p.y) - a.begin();
    out[3] = std::binary_search(a.begin(), a.end(), p.values[p.x & 3]);
    auto [first, last] = std::equal_range(a.begin(), a.end(), p.values[2]);
    out[4] = last - first;
    auto *point = std::partition_point(a.data(), a.data() + 7,
                                       [&](int v) { return v < p.y; });
    out[5] = point - a.data();
    out[6] = std::ranges::lower_bound(a, p.y, std::less()) - a.begin();
    Pair pairs[3] = {{-5, p.x}, {p.x & 7, 1}, {9, p.y}};
    auto *pair = std::lower_bound(pairs, pairs + 2, p.y & 15,
                                  [](auto &l, int r) { return l.key < r; });
    out[7] = pair->value * 3 + pair->key;
    out[8] = std::min_element(p.values, p.values + 7) - p.values;
    auto [low, high] = std::minmax_element(p.values, p.values + 7);
    out[9] = *low + int64_t(*high) * 3 + (high - low);
    auto *found = std::find(p.values, p.values + 6, p.values[p.y & 7 % 6]);
    out[10] = found - p.values;
  }

  static void change(const Numbers &p, int64_t *out) {
    int a[7], b[7];
    for (int i = 0; i < 7; ++i)
      b[i] = a[i] = p.values[i];
    int *even = std::partition(a, a + 7, [](int v) { return v % 2 == 0; });
    out[11] = (even - a) * 100 + a[0] + int64_t(a[6]) * 3;
    int *end = std::unique(b, b + 7);
    for (int *i = b; i != end; ++i)
      out[12] += *i;
    end = std::remove(b, end, p.x);
    out[13] = end - b;
    int *i = a, *j = a + 6;
    while (i < j)
      if (*i > p.x)
        std::swap(*i, *j--);
      else
        ++i;
    out[14] = a[0] + int64_t(a[3]) * 5 + (i - a);
    int *walk = p.y % 2 ? a : b;
    for (int n = 0; n < 5; ++n)
      if (*walk < p.y)
        ++walk;
    out[15] = *walk;
    for (int *k = a + 1; k != a + 7; ++k) {
      int value = *k, *to = k;
      for (; to != a && to[-1] > value; --to)
        *to = to[-1];
      *to = value;
    }
    out[16] = a[1] + int64_t(a[5]) * 7;
    const Pair pairs[4] = {{p.x, 1}, {2, p.y}, {p.y, p.x}, {0, 3}};
    const Pair *best = pairs;
    for (const Pair &pair : pairs)
      if (pair.key > best->key)
        best = &pair;
    const int *member = p.x % 2 ? &best->value : &a[2];
    out[17] = *member;
    glm::ivec3 points[2] = {glm::ivec3(p.x), glm::ivec3(p.y, 2, 3)};
    glm::ivec3 *nearest = points;
    int *coordinate = p.values[0] % 2 ? &nearest->x : &nearest->y;
    for (glm::ivec3 &point : points)
      if (point.z < nearest->z)
        nearest = &point;
    out[18] = nearest->y + int64_t(*coordinate) * 3;
  }

  static void capture(const Numbers &p, int64_t *out) {
    Total total{};
    std::for_each(p.values, p.values + 7, [&](const int &v) {
      total.sum += v;
      total.count += v > p.x;
    });
    out[19] = total.sum + total.count;
    glm::ivec2 vector(0);
    int bins[4] = {};
    auto add = std::for_each(p.values, p.values + 6, [&](int v) {
      vector += glm::ivec2(v & 255, 1);
      bins[v & 3] += 1;
    });
    add(p.y);
    out[20] = vector.x + vector.y * 1000 + bins[0] + bins[3] * 10;
    struct Counter {
      Total total{};
      void operator()(int v) {
        total.sum += v;
        total.count += v % 3 == 0;
      }
    };
    Counter counter = std::for_each(p.values, p.values + 7, Counter());
    out[21] = counter.total.sum - counter.total.count;
  }

  /// The library calls memcmp for these.
  static void equal(const Numbers &p, int64_t *out) {
    std::array<int, 3> a{p.values[0] & 3, p.values[1] & 1, 2}, b = a;
    b[p.x & 1] ^= p.y & 1;
    std::array<uint8_t, 5> small, other;
    for (int i = 0; i < 5; ++i) {
      small[i] = uint8_t(p.values[i] & 1 ? 200 : 100);
      other[i] = uint8_t(p.values[(i + p.x) & 3] & 1 ? 200 : 100);
    }
    bool isLess = std::lexicographical_compare(small.begin(), small.end(),
                                               other.begin(), other.end());
    out[22] = (a == b) + 2 * std::equal(p.values, p.values + 2, a.begin()) +
              4 * (small == other) + 8 * isLess + 16 * (a < b);
    int64_t wide[3] = {p.x & 1, p.y & 1, 1};
    out[23] = std::equal(wide, wide + 1 + (p.x & 1), wide + (p.y & 1)) +
              2 * std::ranges::equal(a, std::array{1, 1, 2});
  }
};

struct Algorithms : piko::Pipe<State> {
  Algorithm algorithm;
  Algorithms() {
    source(algorithm);
    allocateForSource(state().results, 0);
  }
};
