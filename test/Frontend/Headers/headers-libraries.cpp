// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What large libraries bring along: builtins and registers of the machine,
// exceptions, thread-local storage, atomics. Only what a phase calls is judged.
// REQUIRES: all
// RUN: piko-translate --cpp-to-piko -I/usr/include/eigen3 %s 2>&1 | FileCheck %s
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <OpenImageIO/imageio.h>
#include <assimp/scene.h>
#include <boost/algorithm/string.hpp>
#include <boost/align/aligned_allocator.hpp>
#include <boost/any.hpp>
#include <boost/asio.hpp>
#include <boost/atomic.hpp>
#include <boost/circular_buffer.hpp>
#include <boost/container/flat_map.hpp>
#include <boost/container/small_vector.hpp>
#include <boost/container/static_vector.hpp>
#include <boost/dynamic_bitset.hpp>
#include <boost/functional/hash.hpp>
#include <boost/intrusive/list.hpp>
#include <boost/lexical_cast.hpp>
#include <boost/lockfree/queue.hpp>
#include <boost/math/constants/constants.hpp>
#include <boost/math/special_functions.hpp>
#include <boost/multi_array.hpp>
#include <boost/multiprecision/cpp_int.hpp>
#include <boost/numeric/ublas/matrix.hpp>
#include <boost/optional.hpp>
#include <boost/pool/object_pool.hpp>
#include <boost/random.hpp>
#include <boost/range/adaptors.hpp>
#include <boost/rational.hpp>
#include <boost/shared_ptr.hpp>
#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <boost/thread.hpp>
#include <boost/tokenizer.hpp>
#include <boost/uuid/uuid_generators.hpp>
#include <boost/variant.hpp>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>
#include <zlib.h>

#include <piko.h>

struct Point {
  float x, y, z;
};

// CHECK-NOT: error
// CHECK-LABEL: piko.stage @turn
struct Turn : piko::Stage<0, 0, 1, Point, Point> {
  void process(const Point &p) {
    float half = boost::math::float_constants::half;
    // CHECK: arith.mulf
    // CHECK: piko.emit
    emit(Point{p.z * half, p.y, -p.x});
  }
};
struct Drain : piko::Stage<0, 0, 1, Point> {
  void process(const Point &) {}
};
struct Pipeline : piko::Pipe<> {
  Turn turn;
  Drain drain;
  Pipeline() {
    source(turn);
    connect(turn, 0, drain);
  }
};
