// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The 8 nearest points, kept in order in private arrays.
#include <piko.h>

struct Query {
  glm::vec3 at;
  int index;
};
struct State {
  piko::Buffer<glm::vec3> points;
  piko::Buffer<int> nearest;
};
constexpr int K = 8;

struct Search : piko::Stage<0, 0, 1, Query>, piko::Uses<State> {
  void process(const Query &q) {
    float distance[K];
    int index[K];
    int count = 0;
    for (int i = 0; i < int(state().points.size()); ++i) {
      glm::vec3 d = state().points[i] - q.at;
      float r = glm::dot(d, d);
      if (count == K && r >= distance[K - 1])
        continue;
      int at = count < K ? count++ : K - 1;
      while (at > 0 && distance[at - 1] > r) {
        distance[at] = distance[at - 1];
        index[at] = index[at - 1];
        --at;
      }
      distance[at] = r;
      index[at] = i;
    }
    for (int k = 0; k < count; ++k)
      state().nearest[q.index * K + k] = index[k];
  }
};
struct Nearest : piko::Pipe<State> {
  Search search;
  Nearest() { source(search); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<glm::vec3> points;
  std::vector<Query> queries;
  std::vector<int> nearest = std::vector<int>(500 * K);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 4000; ++i)
      points.push_back({random.unit(), random.unit(), random.unit()});
    for (int i = 0; i < 500; ++i)
      queries.push_back({{random.unit(), random.unit(), random.unit()}, i});
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().points, points);
    bodies::bind(pipe.state().nearest, nearest);
    pipe.feed(pipe.search, queries);
  }
  uint64_t result(auto &) { return bodies::hash(nearest); }
};
PIKO_BODY_MAIN(Nearest, Host)
#endif
