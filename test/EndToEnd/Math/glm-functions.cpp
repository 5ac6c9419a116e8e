// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What shaders use of GLM gives the same bits as in a plain C++ build.
// REQUIRES: all
// RUN: %compare_targets %s --count 64 --runs 1 --threads 1 | FileCheck %s
// CHECK: equal
#include "../Inputs/functions.h"

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

template <class Put> struct Writer {
  Put put;

  void operator()(glm::vec3 v) { put(v.x, v.y, v.z); }
  void operator()(glm::vec4 v) { put(v.x, v.y, v.z, v.w); }
  void operator()(glm::quat q) { put(q.x, q.y, q.z, q.w); }
  void operator()(const glm::mat3 &m) {
    (*this)(m[0]);
    (*this)(m[1]);
    (*this)(m[2]);
  }
  void operator()(const glm::mat4 &m) {
    (*this)(m[0]);
    (*this)(m[1]);
    (*this)(m[2]);
    (*this)(m[3]);
  }
};

struct Vectors {
  static void call(auto put, int i, float x, float y, float z) {
    glm::vec3 a(x, y, z), b(y + 1.0f, z * 2.0f, x - 3.0f), c(z, y, x);
    Writer<decltype(put)> write{put};
    write(glm::mix(a, b, x));
    write(glm::mix(a, b, c));
    write(glm::clamp(a, -1.0f, 1.0f));
    write(glm::step(a, b));
    write(glm::smoothstep(0.0f, 1.0f, a));
    write(glm::fract(a));
    write(glm::mod(a, b));
    write(glm::reflect(a, b));
    write(glm::refract(glm::normalize(a), glm::normalize(b), 0.7f));
    write(glm::faceforward(a, b, c));
    write(glm::cross(a, b));
    write(glm::normalize(a));
    write(glm::floor(a) + glm::ceil(b) + glm::trunc(c) + glm::round(a));
    write(glm::sign(a) + glm::abs(b) + glm::min(a, c) + glm::max(a, b));
    write(glm::sqrt(a));
    write(glm::inversesqrt(a));
    put(glm::dot(a, b), glm::length(a), glm::distance(a, b), glm::radians(x),
        glm::degrees(x), glm::fma(x, y, z));
    put(glm::any(glm::lessThan(a, b)), glm::all(glm::equal(a, c)),
        glm::any(glm::isnan(a)), glm::floatBitsToInt(x));
    put(glm::packUnorm4x8(glm::vec4(a, 1)), glm::packHalf2x16(glm::vec2(a)),
        glm::bitfieldReverse(i), glm::findMSB(i), glm::bitCount(i));
  }
};
struct Matrices {
  static void call(auto put, int i, float x, float y, float z) {
    float f = float(i % 32) * 0.3f;
    glm::vec3 s(f, 1.5f, float(i % 7)), t(2.25f, f - 3.0f, float(i % 5));
    glm::mat3 m(s, t, glm::vec3(1, 2, 5));
    Writer<decltype(put)> write{put};
    write(m * m + m - m * 0.3f);
    write(glm::inverse(m));
    write(glm::transpose(m));
    write(glm::outerProduct(s, t));
    write(m * glm::vec3(x, y, z));
    write(glm::vec3(x, y, z) * m);
    put(glm::determinant(m), glm::determinant(glm::mat4(m)));
  }
};
struct Matrices4 {
  static void call(auto put, int i, float x, float y, float z) {
    float f = float(i % 32) * 0.3f;
    glm::vec4 s(f, 1.5f, 2.0f, float(i % 7)), t(2.25f, f - 3.0f, 0.1f, 1.0f);
    glm::mat4 m(s, t, glm::vec4(1, 2, 5, 7), glm::vec4(3, f, 0, 9));
    Writer<decltype(put)> write{put};
    write(glm::transpose(m) * m);
    write(glm::inverse(m));
    write(m * glm::vec4(x, y, z, 1));
    write(glm::translate(m, glm::vec3(s)) + glm::scale(m, glm::vec3(t)));
  }
};
struct Transforms {
  static void call(auto put, int i, float x, float y, float z) {
    float f = float(i % 32) * 0.3f;
    glm::quat q(0.5f, f, 0.25f, float(i % 7)), r(1, f - 1.0f, 0.75f, -f);
    Writer<decltype(put)> write{put};
    write(q * r);
    write(q * glm::vec3(x, y, z));
    write(glm::normalize(q));
    write(glm::inverse(q) + glm::conjugate(r));
    write(glm::lerp(q, r, 0.25f));
    write(glm::mat3_cast(q));
    write(glm::quat_cast(glm::mat3_cast(glm::normalize(r))));
    write(glm::lookAt(glm::vec3(f, 1, 2), glm::vec3(1, f, 5),
                      glm::vec3(0, 1, 0)));
    write(glm::ortho(-1.0f, 1.0f + f, -2.0f, 2.0f, 0.1f, f + 5.0f));
  }
};
struct Pipeline : piko::Pipe<State> {
  Call<Vectors> vectors;
  Call<Matrices> matrices;
  Call<Matrices4> matrices4;
  Call<Transforms> transforms;
  Pipeline() {
    source(vectors);
    source(matrices);
    source(matrices4);
    source(transforms);
  }
};
