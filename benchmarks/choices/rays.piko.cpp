// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raytrace with other tests of a ray and a triangle, and distances in
// double.
#include "raytrace/raytrace.piko.cpp"

namespace raytrace {

/// Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection",
/// 1997. Each triangle rounds for itself, so that a ray may pass between two.
template <class Float, class Distance = float> class DirectRay {
public:
  using Hit = HitAt<Distance>;

  DirectRay(glm::vec3 origin, glm::vec3 direction)
      : origin(origin), direction(direction) {}

  bool intersect(const piko::scene::BvhTriangle &triangle, Hit &nearest) const {
    using Vector = glm::tvec3<Float>;
    auto corner = [&](int i) {
      return Vector(triangle.corner[i][0], triangle.corner[i][1],
                    triangle.corner[i][2]);
    };
    Vector a = corner(0), ab = corner(1) - a, ac = corner(2) - a;
    Vector along(direction), from = Vector(origin) - a;
    Vector p = glm::cross(along, ac), q = glm::cross(from, ab);
    Float inverse = 1 / glm::dot(ab, p);
    Float v = glm::dot(from, p) * inverse, w = glm::dot(along, q) * inverse;
    Distance t = Distance(glm::dot(ac, q) * inverse);
    if (!(v >= 0 && w >= 0 && v + w <= 1 && t > 0 && t <= nearest.t))
      return false;
    if (t == nearest.t && nearest.triangle < triangle.index)
      return false;
    nearest.t = t;
    nearest.triangle = triangle.index;
    nearest.weight = {float(1 - v - w), float(v), float(w)};
    return true;
  }

private:
  glm::vec3 origin, direction;
};

} // namespace raytrace

template <class Test>
struct Rays : raytrace::MappedRaytracer<{.bin = 16, .apart = false}, Test> {};
struct Watertight : Rays<raytrace::ShearedRay> {};
struct DirectFloat : Rays<raytrace::DirectRay<float>> {};
struct DirectDouble : Rays<raytrace::DirectRay<double>> {};
struct FarWatertight : Rays<raytrace::ShearedRayTo<double>> {};
struct FarDirectDouble : Rays<raytrace::DirectRay<double, double>> {};
