// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the small pipelines share.
#include <piko.h>

struct Point {
  int x, y;
  float value;
  int tag;
};

inline bool isOnScreen(const Point &p, glm::ivec2 domain) {
  return p.x < domain.x && p.y < domain.y;
}
