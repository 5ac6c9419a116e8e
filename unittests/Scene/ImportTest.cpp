//===- ImportTest.cpp - Scenes that another process reads -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "../Support/TemporaryFolder.h"

#include "Piko/Scene/SceneFile.h"

#include <cstdlib>
#include <filesystem>
#include <signal.h>
#include <zlib.h>

using namespace piko::render;

namespace {

class Import : public TemporaryFolder {
protected:
  ~Import() override { unsetenv("PIKO_IMPORTER"); }

  std::string writeSquare() {
    return write("square.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                               "4 0 1 2 3\n");
  }
  /// What loading the square says where a script takes the importer's place.
  std::string errorOf(const std::string &script) {
    std::string program = write("importer", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv("PIKO_IMPORTER", program.c_str(), /*overwrite=*/1);
    auto mesh = loadMesh(writeSquare());
    return mesh ? "no error" : mesh.error().message;
  }
};

TEST_F(Import, ReadsAnotherFormat) {
  auto mesh = loadMesh(writeSquare());
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 2u);
  EXPECT_EQ(mesh->vertices.size(), 4u);
  for (const auto &vertex : mesh->vertices)
    EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
}

TEST_F(Import, ReadsAPackedFile) {
  std::string name = pathOf("square.off.gz");
  gzFile file = gzopen(name.c_str(), "wb");
  gzputs(file, "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n");
  gzclose(file);
  auto mesh = loadMesh(name);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 1u);
}

TEST_F(Import, SaysWhatIsWrong) {
  auto mesh = loadMesh(write("broken.off", "OFF\n4 1 0\n0 0 zero\n"));
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().message.find("broken.off"), std::string::npos);
  EXPECT_FALSE(loadMesh(write("scene.unknown", "nothing")));
}

// Whatever becomes of it, the host lives on and hears of it.
TEST_F(Import, SurvivesItsEnd) {
  EXPECT_NE(errorOf("kill -ABRT $$").find("ended by signal 6"),
            std::string::npos);
  EXPECT_NE(errorOf("exit 3").find("ended with status 3"), std::string::npos);
  EXPECT_NE(errorOf("echo noise >&2; echo 'piko-import: error: out of memory' "
                    ">&2; exit 1")
                .find("square.off': out of memory"),
            std::string::npos);
  EXPECT_NE(errorOf("kill -XCPU $$").find("takes longer than 600 s"),
            std::string::npos);
}

TEST_F(Import, ChecksWhatItSays) {
  EXPECT_NE(errorOf("echo nonsense"), "no error");
  EXPECT_NE(errorOf("true"), "no error");
  EXPECT_NE(errorOf("printf 'ply\\nformat ascii 1.0\\nelement vertex 3\\n'"),
            "no error");
  std::string header = "ply\\nformat ascii 1.0\\nelement vertex 1\\n"
                       "property float x\\nproperty float y\\n"
                       "property float z\\nelement face 1\\n"
                       "property list uchar int vertex_indices\\nend_header\\n";
  EXPECT_NE(errorOf("printf '" + header + "0 0 0\\n3 0 1 2\\n'"), "no error");
}

TEST_F(Import, ThereIsNone) {
  setenv("PIKO_IMPORTER", "/nowhere/piko-import", /*overwrite=*/1);
  auto mesh = loadMesh(writeSquare());
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().message.find("cannot start 'piko-import', which reads "
                                      "formats other than PLY"),
            std::string::npos)
      << mesh.error().message;
}

// Formats with a reader of their own do not need it.
TEST_F(Import, IsNotAskedForUsualFormats) {
  setenv("PIKO_IMPORTER", "/nowhere/piko-import", /*overwrite=*/1);
  EXPECT_TRUE(
      loadMesh(write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")));
}

// What the host ignores and blocks stays as it is.
TEST_F(Import, LeavesSignalsAlone) {
  sigset_t before, after;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  ASSERT_TRUE(loadMesh(writeSquare()));
  pthread_sigmask(SIG_SETMASK, nullptr, &after);
  for (int number = 1; number < 32; ++number)
    EXPECT_EQ(sigismember(&before, number), sigismember(&after, number));
}

} // namespace
