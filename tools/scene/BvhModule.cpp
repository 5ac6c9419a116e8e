//===- BvhModule.cpp - Bounding volume hierarchies, by Embree -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Embree builds a tree of pointers in its own memory, on all cores, which is
// then laid out in depth-first order.
//
//===----------------------------------------------------------------------===//
#include "BvhModule.h"
#include "meshes/Vectors.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <span>

using namespace piko;
using namespace piko::render;

namespace {

/// An inner node if it has children, else a leaf.
struct BuildNode {
  unsigned childCount = 0, triangleCount = 0;
  const BuildNode *children[scene::bvhWidth] = {};
  unsigned *triangles = nullptr;
};

template <class T>
T *allocate(RTCThreadLocalAllocator allocator, size_t count = 1) {
  return static_cast<T *>(
      rtcThreadLocalAlloc(allocator, count * sizeof(T), alignof(T)));
}

void *createNode(RTCThreadLocalAllocator allocator, unsigned childCount,
                 void *) {
  auto *node = new (allocate<BuildNode>(allocator)) BuildNode;
  node->childCount = childCount;
  return node;
}

void setChildren(void *node, void **children, unsigned count, void *) {
  for (unsigned i = 0; i < count; ++i)
    static_cast<BuildNode *>(node)->children[i] =
        static_cast<const BuildNode *>(children[i]);
}

void *createLeaf(RTCThreadLocalAllocator allocator,
                 const RTCBuildPrimitive *primitives, size_t count, void *) {
  auto *leaf = new (allocate<BuildNode>(allocator)) BuildNode;
  leaf->triangleCount = unsigned(count);
  leaf->triangles = allocate<unsigned>(allocator, count);
  for (size_t i = 0; i < count; ++i)
    leaf->triangles[i] = primitives[i].primID;
  std::sort(leaf->triangles, leaf->triangles + count);
  return leaf;
}

scene::Bounds emptyBounds() {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  return {glm::vec3(infinity), glm::vec3(-infinity)};
}

void include(scene::Bounds &bounds, const scene::Bounds &other) {
  bounds = {glm::min(bounds.lo, other.lo), glm::max(bounds.hi, other.hi)};
}

/// The boxes of all triangles whose corners are finite.
std::vector<RTCBuildPrimitive> boxTriangles(const Mesh &mesh) {
  std::vector<RTCBuildPrimitive> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const scene::Triangle &t : mesh.triangles) {
    glm::vec3 a = mesh.vertices[t.vertex.x].position;
    glm::vec3 b = mesh.vertices[t.vertex.y].position;
    glm::vec3 c = mesh.vertices[t.vertex.z].position;
    if (!isFinite(a) || !isFinite(b) || !isFinite(c))
      continue;
    glm::vec3 lo = glm::min(a, glm::min(b, c));
    glm::vec3 hi = glm::max(a, glm::max(b, c));
    boxes.push_back({lo.x, lo.y, lo.z, 0, hi.x, hi.y, hi.z, unsigned(t.index)});
  }
  return boxes;
}

/// Lays out a tree.
class Flattener {
public:
  Flattener(const Mesh &mesh, Bvh &bvh) : mesh(mesh), bvh(bvh) {}

  void addRoot(const BuildNode &root) {
    BuildNode parent;
    parent.childCount = 1;
    parent.children[0] = &root;
    bvh.bounds = addNode(root.childCount ? root : parent);
  }

private:
  scene::Bounds addNode(const BuildNode &node) {
    size_t place = bvh.nodes.size();
    bvh.nodes.emplace_back();
    scene::BvhNode flat{};
    scene::Bounds all = emptyBounds();
    for (unsigned i = 0; i < scene::bvhWidth; ++i) {
      scene::Bounds box = emptyBounds();
      if (i < node.childCount) {
        const BuildNode &child = *node.children[i];
        flat.count[i] = int32_t(child.triangleCount);
        flat.child[i] =
            int32_t(child.childCount ? bvh.nodes.size() : bvh.triangles.size());
        box = child.childCount ? addNode(child) : addLeaf(child);
      }
      for (int k = 0; k < 3; ++k) {
        flat.bounds[k][i] = box.lo[k];
        flat.bounds[k + 3][i] = box.hi[k];
      }
      include(all, box);
    }
    bvh.nodes[place] = flat;
    return all;
  }

  scene::Bounds addLeaf(const BuildNode &leaf) {
    scene::Bounds all = emptyBounds();
    for (unsigned index : std::span(leaf.triangles, leaf.triangleCount)) {
      scene::BvhTriangle flat{};
      flat.index = int32_t(index);
      for (int i = 0; i < 3; ++i) {
        int32_t vertex = mesh.triangles[index].vertex[i];
        glm::vec3 p = mesh.vertices[vertex].position;
        include(all, {p, p});
        for (int k = 0; k < 3; ++k)
          flat.corner[i][k] = p[k];
      }
      bvh.triangles.push_back(flat);
    }
    return all;
  }

  const Mesh &mesh;
  Bvh &bvh;
};

RTCBuildArguments makeArguments(RTCBVH tree,
                                std::vector<RTCBuildPrimitive> &boxes) {
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.maxBranchingFactor = scene::bvhWidth;
  arguments.maxDepth = scene::bvhDepth;
  arguments.maxLeafSize = 8;
  // Relative to a node's. It makes leaves of about two triangles, which are as
  // quick as leaves of one, in a tree of half the size.
  arguments.intersectionCost = 0.3f;
  arguments.bvh = tree;
  arguments.primitives = boxes.data();
  arguments.primitiveCount = boxes.size();
  arguments.primitiveArrayCapacity = boxes.capacity();
  arguments.createNode = createNode;
  arguments.setNodeChildren = setChildren;
  // The boxes follow from the triangles.
  arguments.setNodeBounds = [](void *, const RTCBounds **, unsigned, void *) {};
  arguments.createLeaf = createLeaf;
  return arguments;
}

template <class T, void (*Release)(T *)>
using Handle =
    std::unique_ptr<T, std::integral_constant<void (*)(T *), Release>>;

Error embreeError(RTCDevice device) {
  return {"cannot build a tree: Embree's error " +
          std::to_string(rtcGetDeviceError(device))};
}

Result<Bvh> build(const Mesh &mesh) {
  Bvh bvh;
  std::vector<RTCBuildPrimitive> boxes = boxTriangles(mesh);
  if (boxes.empty())
    return bvh;
  Handle<RTCDeviceTy, rtcReleaseDevice> device(rtcNewDevice(nullptr));
  if (!device)
    return embreeError(nullptr);
  Handle<RTCBVHTy, rtcReleaseBVH> tree(rtcNewBVH(device.get()));
  if (!tree)
    return embreeError(device.get());
  RTCBuildArguments arguments = makeArguments(tree.get(), boxes);
  auto *root = static_cast<const BuildNode *>(rtcBuildBVH(&arguments));
  if (!root)
    return embreeError(device.get());
  Flattener(mesh, bvh).addRoot(*root);
  return bvh;
}

} // namespace

extern "C" __attribute__((visibility("default")))
const BvhFunctions piko_bvh_functions = {build};
