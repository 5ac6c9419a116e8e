//===- BindingTest.cpp - Scenes into pipelines, by type -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Binding.h"

#include <pikort/abi.h>

#include <gtest/gtest.h>

#include <functional>

using namespace piko;
using namespace piko::render;

namespace {

enum Record {
  CAMERA,
  SETTINGS,
  LIGHT,
  VERTEX,
  TRIANGLE,
  PATCH,
  COUNTER,
  COLOR,
  OTHER,
  PIXEL,
  NOTHING,
  BOUNDS,
  NODE,
  LEAF,
  INT,
  FLOAT
};

/// What a test's program declares beside the records.
std::function<void(pikort_pipeline *)> declareRest;

void declareRecord(pikort_pipeline *p, Record id, const char *name,
                   int64_t size) {
  pikoir_declare_record(p, id, name, size, 4);
}

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Test", 2);
  declareRecord(p, CAMERA, "piko::scene::Camera", sizeof(scene::Camera));
  declareRecord(p, SETTINGS, "piko::scene::Settings", sizeof(scene::Settings));
  declareRecord(p, LIGHT, "piko::scene::Light", sizeof(scene::Light));
  declareRecord(p, VERTEX, "piko::scene::Vertex", sizeof(scene::Vertex));
  declareRecord(p, TRIANGLE, "piko::scene::Triangle", sizeof(scene::Triangle));
  declareRecord(p, PATCH, "piko::scene::Patch", sizeof(scene::Patch));
  declareRecord(p, COUNTER, "piko::scene::Counter", sizeof(scene::Counter));
  declareRecord(p, COLOR, "piko::scene::Color", sizeof(scene::Color));
  declareRecord(p, OTHER, "Other", 4);
  declareRecord(p, PIXEL, "piko::scene::Pixel", sizeof(scene::Pixel));
  pikoir_declare_record(p, NOTHING, "piko::scene::Nothing", 1, 1);
  declareRecord(p, BOUNDS, "piko::scene::Bounds", sizeof(scene::Bounds));
  declareRecord(p, NODE, "piko::scene::BvhNode", sizeof(scene::BvhNode));
  declareRecord(p, LEAF, "piko::scene::BvhTriangle",
                sizeof(scene::BvhTriangle));
  declareRecord(p, INT, "int", 4);
  declareRecord(p, FLOAT, "float", 4);
  declareRest(p);
}

void declareState(pikort_pipeline *p, int id, const char *name, int kind,
                  Record record, int rank = 0, int perSource = -1,
                  const void *clear = nullptr) {
  pikoir_declare_state(p, id, name, kind, record, rank, perSource, clear);
}

void declareSource(pikort_pipeline *p, int index, Record record) {
  int64_t whole[] = {0, 0};
  pikoir_declare_stage(p, index, "stage", record, whole, PIKOIR_LOAD_BALANCE, 0,
                       0, 0);
  pikoir_declare_source(p, index, index);
}

class Binding : public testing::Test {
protected:
  Binding() {
    input.lights.resize(3);
    input.mesh.vertices.resize(4);
    input.mesh.triangles = {{{0, 1, 2}, 0}, {{0, 0, 3}, 1}};
    input.mesh.vertices[1].position = {1, 2, 3};
    input.settings.cullBackFaces = 1;
    input.size = {5, 3};
  }
  ~Binding() override { pikort_destroy(pipeline); }

  Result<std::string> bind(std::function<void(pikort_pipeline *)> rest) {
    declareRest = std::move(rest);
    pikort_program program{PIKORT_ABI_VERSION, "Test", setup,
                           [](pikort_pipeline *) { return int32_t(0); }};
    EXPECT_EQ(pikort_create(&program, &pipeline), PIKORT_OK)
        << pikort_message(pipeline);
    return bindScene(pipeline, input);
  }
  std::string errorOf(std::function<void(pikort_pipeline *)> rest) {
    auto result = bind(std::move(rest));
    return result ? "no error" : result.error().message;
  }

  static Table tableOfNumbers() {
    return {"numbers.csv", nullptr, {"number"}, {"7", "-8"}, {2, 3}};
  }

  SceneInput input{};
  pikort_pipeline *pipeline = nullptr;
};

TEST_F(Binding, EverythingByType) {
  auto output = bind([](pikort_pipeline *p) {
    declareSource(p, 0, VERTEX);
    declareSource(p, 1, TRIANGLE);
    declareState(p, 0, "view", PIKORT_CONSTANT, CAMERA);
    declareState(p, 1, "how", PIKORT_CONSTANT, SETTINGS);
    declareState(p, 2, "lamps", PIKORT_BUFFER, LIGHT, 1);
    declareState(p, 3, "mesh", PIKORT_BUFFER, TRIANGLE, 1);
    declareState(p, 4, "shaded", PIKORT_BUFFER, OTHER, 1, 0);
    declareState(p, 5, "depth", PIKORT_IMAGE, OTHER, 2);
    declareState(p, 6, "picture", PIKORT_IMAGE, COLOR, 2);
    int value = 5;
    declareState(p, 7, "bias", PIKORT_CONSTANT, OTHER, 0, -1, &value);
  });
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(*output, "picture");
  int64_t extent[] = {4, 4};
  ASSERT_EQ(pikort_set_domain(pipeline, 2, extent), PIKORT_OK);
  ASSERT_EQ(pikort_run(pipeline), PIKORT_OK) << pikort_message(pipeline);
  pikort_view view;
  ASSERT_EQ(pikort_get_view(pipeline, "how", &view), PIKORT_OK);
  EXPECT_EQ(static_cast<scene::Settings *>(view.data)->cullBackFaces, 1);
  ASSERT_EQ(pikort_get_view(pipeline, "lamps", &view), PIKORT_OK);
  EXPECT_EQ(view.extent[0], 3);
  ASSERT_EQ(pikort_get_view(pipeline, "bias", &view), PIKORT_OK);
  EXPECT_EQ(*static_cast<int *>(view.data), 5);
  pikort_source_info source;
  ASSERT_EQ(pikort_get_source_info(pipeline, 0, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 4);
  ASSERT_EQ(pikort_get_source_info(pipeline, 1, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 2);
}

TEST_F(Binding, PixelsOfTheImage) {
  auto output = bind([](pikort_pipeline *p) {
    declareSource(p, 0, PIXEL);
    declareState(p, 0, "picture", PIKORT_IMAGE, COLOR, 2);
  });
  ASSERT_TRUE(output) << output.error().message;
  pikort_source_info source;
  ASSERT_EQ(pikort_get_source_info(pipeline, 0, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 15);
  EXPECT_EQ(input.pixels.at(7).at, glm::ivec2(2, 1));
  EXPECT_FALSE(input.bvh); // not asked for
}

TEST_F(Binding, NothingAtAll) {
  auto output = bind([](pikort_pipeline *p) {
    declareSource(p, 0, NOTHING);
    declareState(p, 0, "picture", PIKORT_IMAGE, COLOR, 2);
  });
  ASSERT_TRUE(output) << output.error().message;
  pikort_source_info source;
  ASSERT_EQ(pikort_get_source_info(pipeline, 0, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 0);
  int64_t extent[] = {5, 3};
  ASSERT_EQ(pikort_set_domain(pipeline, 2, extent), PIKORT_OK);
  EXPECT_EQ(pikort_run(pipeline), PIKORT_OK) << pikort_message(pipeline);
}

TEST_F(Binding, TreeOfTheMesh) {
  auto output = bind([](pikort_pipeline *p) {
    declareSource(p, 0, VERTEX);
    declareState(p, 0, "picture", PIKORT_IMAGE, COLOR, 2);
    declareState(p, 1, "box", PIKORT_CONSTANT, BOUNDS);
    declareState(p, 2, "nodes", PIKORT_BUFFER, NODE, 1);
    declareState(p, 3, "leaves", PIKORT_BUFFER, LEAF, 1);
  });
  ASSERT_TRUE(output) << output.error().message;
  int64_t extent[] = {5, 3};
  ASSERT_EQ(pikort_set_domain(pipeline, 2, extent), PIKORT_OK);
  ASSERT_EQ(pikort_run(pipeline), PIKORT_OK) << pikort_message(pipeline);
  pikort_view view;
  ASSERT_EQ(pikort_get_view(pipeline, "nodes", &view), PIKORT_OK);
  EXPECT_EQ(view.extent[0], 1);
  ASSERT_EQ(pikort_get_view(pipeline, "leaves", &view), PIKORT_OK);
  EXPECT_EQ(view.extent[0], 2);
  ASSERT_EQ(pikort_get_view(pipeline, "box", &view), PIKORT_OK);
  EXPECT_EQ(static_cast<scene::Bounds *>(view.data)->hi, glm::vec3(1, 2, 3));
}

TEST_F(Binding, ValuesOfConstants) {
  auto rest = [](pikort_pipeline *p) {
    int value = 5;
    declareSource(p, 0, VERTEX);
    declareState(p, 0, "picture", PIKORT_IMAGE, COLOR, 2);
    declareState(p, 1, "depth", PIKORT_CONSTANT, INT, 0, -1, &value);
    declareState(p, 2, "part", PIKORT_CONSTANT, FLOAT, 0, -1, &value);
    declareState(p, 3, "other", PIKORT_CONSTANT, OTHER, 0, -1, &value);
  };
  input.values = {{"depth", "-3"}, {"part", "0.25"}};
  auto output = bind(rest);
  ASSERT_TRUE(output) << output.error().message;
  int64_t extent[] = {5, 3};
  ASSERT_EQ(pikort_set_domain(pipeline, 2, extent), PIKORT_OK);
  ASSERT_EQ(pikort_run(pipeline), PIKORT_OK) << pikort_message(pipeline);
  pikort_view view;
  ASSERT_EQ(pikort_get_view(pipeline, "depth", &view), PIKORT_OK);
  EXPECT_EQ(*static_cast<int32_t *>(view.data), -3);
  ASSERT_EQ(pikort_get_view(pipeline, "part", &view), PIKORT_OK);
  EXPECT_EQ(*static_cast<float *>(view.data), 0.25f);
}

TEST_F(Binding, WrongValues) {
  auto errorOfValue = [&](const char *name, const char *value) {
    pikort_destroy(pipeline);
    pipeline = nullptr;
    input.values = {{name, value}};
    return errorOf([](pikort_pipeline *p) {
      int value = 5;
      declareSource(p, 0, VERTEX);
      declareState(p, 0, "picture", PIKORT_IMAGE, COLOR, 2);
      declareState(p, 1, "depth", PIKORT_CONSTANT, INT, 0, -1, &value);
      declareState(p, 2, "other", PIKORT_CONSTANT, OTHER, 0, -1, &value);
    });
  };
  EXPECT_EQ(errorOfValue("depth", "1.5"),
            "pipeline 'Test': constant 'depth': expected a whole number, but "
            "got '1.5'");
  EXPECT_EQ(errorOfValue("other", "1"),
            "pipeline 'Test': constant 'other': expected an 'int' or a 'float' "
            "to set, but got 'Other'");
  EXPECT_EQ(errorOfValue("picture", "1"),
            "pipeline 'Test': expected a constant 'picture' to set, but it has "
            "none");
}

TEST_F(Binding, NoImage) {
  EXPECT_EQ(errorOf([](pikort_pipeline *p) { declareSource(p, 0, VERTEX); }),
            "pipeline 'Test': expected an image of 'piko::scene::Color' or "
            "'piko::scene::Color8' for the result, but it has none");
}

TEST_F(Binding, TwoImages) {
  EXPECT_EQ(
      errorOf([](pikort_pipeline *p) {
        declareSource(p, 0, VERTEX);
        declareState(p, 0, "a", PIKORT_IMAGE, COLOR, 2);
        declareState(p, 1, "b", PIKORT_IMAGE, COLOR, 2);
      }),
      "pipeline 'Test': expected one image of colours for the result, but "
      "got 'a' and 'b'");
}

TEST_F(Binding, UnknownConstant) {
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              declareSource(p, 0, VERTEX);
              declareState(p, 0, "knob", PIKORT_CONSTANT, OTHER);
            }),
            "pipeline 'Test': constant 'knob': expected 'piko::scene::Camera', "
            "'...::Settings', '...::Bounds', a default value or --set, but got "
            "'Other'");
}

TEST_F(Binding, UnknownBuffer) {
  EXPECT_EQ(
      errorOf([](pikort_pipeline *p) {
        declareSource(p, 0, VERTEX);
        declareState(p, 0, "data", PIKORT_BUFFER, OTHER, 1);
      }),
      "pipeline 'Test': buffer 'data': expected elements of "
      "'piko::scene::Light', '...::Vertex', '...::Triangle', "
      "'...::Patch', '...::BvhNode' or '...::BvhTriangle', but got 'Other'");
}

TEST_F(Binding, UnknownSource) {
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              declareSource(p, 0, OTHER);
              declareState(p, 0, "color", PIKORT_IMAGE, COLOR, 2);
            }),
            "pipeline 'Test': source 0: expected 'piko::scene::Vertex', "
            "'...::Triangle', '...::Patch', '...::Pixel', '...::Nothing' or a "
            "table in the place of the scene, but got 'Other'");
}

TEST_F(Binding, Patches) {
  input.mesh = {};
  input.mesh.patches.resize(5);
  auto output = bind([](pikort_pipeline *p) {
    declareSource(p, 0, PATCH);
    declareState(p, 0, "patches", PIKORT_BUFFER, PATCH, 1);
    declareState(p, 1, "picture", PIKORT_IMAGE, COLOR, 2);
  });
  ASSERT_TRUE(output) << output.error().message;
  pikort_source_info source;
  ASSERT_EQ(pikort_get_source_info(pipeline, 0, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 5);
}

TEST_F(Binding, SceneWithoutPatches) {
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              declareSource(p, 0, PATCH);
              declareState(p, 0, "color", PIKORT_IMAGE, COLOR, 2);
            }),
            "pipeline 'Test': 'piko::scene::Patch': expected a scene of "
            "patches, but it has triangles");
}

TEST_F(Binding, SceneOfPatchesAlone) {
  input.mesh = {};
  input.mesh.patches.resize(5);
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              declareSource(p, 0, PATCH);
              declareState(p, 0, "mesh", PIKORT_BUFFER, VERTEX, 1);
            }),
            "pipeline 'Test': 'piko::scene::Vertex': expected a scene of "
            "triangles, but it has patches");
}

// Primitives of the pipeline's own, beside a source that every picture has.
TEST_F(Binding, Tables) {
  input.table = tableOfNumbers();
  auto output = bind([](pikort_pipeline *p) {
    pikoir_declare_field(p, OTHER, "number", PIKORT_I32, 0, 1, 4);
    declareSource(p, 0, PIXEL);
    declareSource(p, 1, OTHER);
    declareState(p, 0, "color", PIKORT_IMAGE, COLOR, 2);
  });
  ASSERT_TRUE(output) << output.error().message;
  pikort_source_info source;
  ASSERT_EQ(pikort_get_source_info(pipeline, 1, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 2);
  auto *numbers =
      reinterpret_cast<const int32_t *>(input.records["Other"].memory.data());
  EXPECT_EQ(numbers[0], 7);
  EXPECT_EQ(numbers[1], -8);
}

TEST_F(Binding, TablesThatFeedNothing) {
  input.table = tableOfNumbers();
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              declareSource(p, 0, PIXEL);
              declareState(p, 0, "color", PIKORT_IMAGE, COLOR, 2);
            }),
            "pipeline 'Test': expected a source for table 'numbers.csv' whose "
            "primitives no scene has, but it has none");
}

TEST_F(Binding, TablesForTwo) {
  input.table = tableOfNumbers();
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              pikoir_declare_field(p, OTHER, "number", PIKORT_I32, 0, 1, 4);
              declareSource(p, 0, OTHER);
              declareSource(p, 1, OTHER);
              declareState(p, 0, "color", PIKORT_IMAGE, COLOR, 2);
            }),
            "pipeline 'Test': expected one source for table 'numbers.csv', but "
            "stage 'stage' of 'Other' and stage 'stage' of 'Other' take what "
            "no scene has; let an application feed both, and render its "
            "capture");
}

TEST_F(Binding, TablesHaveNoCamera) {
  input.table = tableOfNumbers();
  EXPECT_EQ(errorOf([](pikort_pipeline *p) {
              declareState(p, 0, "camera", PIKORT_CONSTANT, CAMERA);
              declareState(p, 1, "color", PIKORT_IMAGE, COLOR, 2);
            }),
            "pipeline 'Test': 'piko::scene::Camera': expected a scene, but "
            "'numbers.csv' is a table");
}

// Counted once for each element; a run clears them.
TEST_F(Binding, Counters) {
  auto output = bind([](pikort_pipeline *p) {
    declareSource(p, 0, VERTEX);
    declareState(p, 0, "lost", PIKORT_BUFFER, COUNTER, 1, 0);
    declareState(p, 1, "picture", PIKORT_IMAGE, COLOR, 2);
  });
  ASSERT_TRUE(output) << output.error().message;
  int64_t extent[] = {4, 4};
  ASSERT_EQ(pikort_set_domain(pipeline, 2, extent), PIKORT_OK);
  ASSERT_EQ(pikort_run(pipeline), PIKORT_OK) << pikort_message(pipeline);
  pikort_view view;
  ASSERT_EQ(pikort_get_view(pipeline, "lost", &view), PIKORT_OK);
  ASSERT_EQ(view.extent[0], 4);
  static_cast<scene::Counter *>(view.data)[1].count = 2;
  static_cast<scene::Counter *>(view.data)[3].count = 5;
  auto counts = readCounters(pipeline);
  ASSERT_TRUE(counts) << counts.error().message;
  ASSERT_EQ(counts->size(), 1u);
  EXPECT_EQ((*counts)[0].name, "lost");
  EXPECT_EQ((*counts)[0].sum, 7);
}

} // namespace
