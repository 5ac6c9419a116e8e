//===- Drawing.cpp - A scene as OpenGL draws it ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Drawing.h"

#include <algorithm>
#include <cstddef>
#include <limits>

using namespace piko;
using namespace piko::peer;

namespace {

// Places and bindings are those of the shaders' layouts.
constexpr GLuint positionPlace = 0, normalPlace = 1;
constexpr GLint matrixPlace = 0, settingsPlace = 1;
constexpr GLuint lightsBinding = 0;

const std::string version = "#version 430 core\n";

// Both passes of the technique with a pass of depths get the same depths.
const std::string vertexShader = version + R"(
  layout(location = 0) in vec3 position;
  layout(location = 1) in vec3 normal;
  layout(location = 0) uniform mat4 viewProjection;
  layout(location = 0) out vec3 surfacePosition;
  layout(location = 1) out vec3 surfaceNormal;
  invariant gl_Position;

  void main() {
    gl_Position = viewProjection * vec4(position, 1.0);
    surfacePosition = position;
    surfaceNormal = normal;
  }
)";

const std::string depthShader = version + "void main() {}\n";

// After the declaration of the lights.
const std::string shadeShader = R"(
  layout(location = 0) in vec3 surfacePosition;
  layout(location = 1) in vec3 surfaceNormal;
  layout(location = 1) uniform vec2 settings; // albedo, ambient
  layout(location = 0) out vec4 color;

  void main() {
    vec3 n = normalize(surfaceNormal);
    vec3 sum = vec3(settings.y);
    for (int i = 0; i < lightCount; ++i) {
      Light light = lights[i];
      vec3 l = light.position.xyz - light.position.w * surfacePosition;
      float facing = max(0.0, dot(n, l));
      sum += light.color.rgb * (facing * inversesqrt(dot(l, l)));
    }
    color = vec4(settings.x * sum, 1.0);
  }
)";

GLuint makeBuffer(const GL &gl, GLenum target, const void *data, size_t bytes) {
  GLuint buffer = 0;
  gl.GenBuffers(1, &buffer);
  gl.BindBuffer(target, buffer);
  gl.BufferData(target, GLsizeiptr(bytes), data, GL_STATIC_DRAW);
  return buffer;
}

} // namespace

Result<Drawing> Drawing::create(const GL &gl, const render::SceneInput &scene,
                                Technique technique) {
  Drawing drawing(gl, scene, technique);
  if (auto ok = drawing.makeImage(); !ok)
    return ok.error();
  if (auto ok = drawing.copyMesh(scene.mesh); !ok)
    return ok.error();
  if (auto ok = drawing.makePrograms(scene); !ok)
    return ok.error();
  gl.Enable(GL_DEPTH_TEST);
  if (scene.settings.cullBackFaces)
    gl.Enable(GL_CULL_FACE);
  if (auto ok = gl.check("preparing to draw"); !ok)
    return ok.error();
  return drawing;
}

Result<Done> Drawing::makeImage() {
  int64_t most = gl.number(GL_MAX_RENDERBUFFER_SIZE);
  if (std::max(size.x, size.y) > most)
    return Error{"expected an image of at most " + std::to_string(most) +
                 " pixels a side, but got " + std::to_string(size.x) + " x " +
                 std::to_string(size.y)};
  GLuint framebuffer = 0, images[2] = {};
  gl.GenFramebuffers(1, &framebuffer);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.GenRenderbuffers(2, images);
  auto attach = [&](GLuint image, GLenum format, GLenum place) {
    gl.BindRenderbuffer(GL_RENDERBUFFER, image);
    gl.RenderbufferStorage(GL_RENDERBUFFER, format, size.x, size.y);
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, image);
  };
  attach(images[0], GL_RGBA8, GL_COLOR_ATTACHMENT0);
  attach(images[1], GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
  if (auto ok = gl.check("making the image"); !ok)
    return ok;
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return Error{"the driver refuses an image of " + std::to_string(size.x) +
                 " x " + std::to_string(size.y) + " pixels"};
  gl.Viewport(0, 0, size.x, size.y);
  scene::Color background;
  gl.ClearColor(background.rgba.r, background.rgba.g, background.rgba.b,
                background.rgba.a);
  return Done{};
}

Result<Done> Drawing::copyMesh(const render::Mesh &mesh) {
  if (mesh.triangles.size() > std::numeric_limits<GLsizei>::max() / 3)
    return Error{"expected fewer triangles, but got " +
                 std::to_string(mesh.triangles.size())};
  struct Corner {
    glm::vec3 position, normal;
  };
  std::vector<Corner> corners;
  corners.reserve(mesh.vertices.size());
  for (const scene::Vertex &v : mesh.vertices)
    corners.push_back({v.position, v.normal});
  std::vector<glm::ivec3> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const scene::Triangle &t : mesh.triangles)
    triangles.push_back(t.vertex);
  indices = GLsizei(3 * triangles.size());

  GLuint array = 0;
  gl.GenVertexArrays(1, &array);
  gl.BindVertexArray(array);
  makeBuffer(gl, GL_ARRAY_BUFFER, corners.data(),
             corners.size() * sizeof(Corner));
  makeBuffer(gl, GL_ELEMENT_ARRAY_BUFFER, triangles.data(),
             triangles.size() * sizeof(glm::ivec3));
  auto describe = [&](GLuint place, size_t offset) {
    gl.EnableVertexAttribArray(place);
    gl.VertexAttribPointer(place, 3, GL_FLOAT, GL_FALSE, sizeof(Corner),
                           reinterpret_cast<const void *>(offset));
  };
  describe(positionPlace, offsetof(Corner, position));
  describe(normalPlace, offsetof(Corner, normal));
  return gl.check("copying the mesh");
}

/// A block of uniforms where they fit into one, which is faster on most cards.
std::string Drawing::declareLights(const render::SceneInput &scene) const {
  std::vector<scene::Light> lights = scene.lights;
  std::string count = std::to_string(lights.size());
  if (lights.empty())
    lights.emplace_back(); // which no shader reads
  size_t bytes = lights.size() * sizeof(scene::Light);
  bool fits = int64_t(bytes) <= gl.number(GL_MAX_UNIFORM_BLOCK_SIZE);
  GLenum target = fits ? GL_UNIFORM_BUFFER : GL_SHADER_STORAGE_BUFFER;
  gl.BindBufferBase(target, lightsBinding,
                    makeBuffer(gl, target, lights.data(), bytes));
  return "struct Light { vec4 position, color; };\n"
         "const int lightCount = " +
         count + ";\nlayout(binding = 0, " +
         (fits ? "std140) uniform" : "std430) readonly buffer") +
         " Lights { Light lights[" + std::to_string(lights.size()) + "]; };\n";
}

Result<Done> Drawing::makePrograms(const render::SceneInput &scene) {
  auto shade =
      gl.link(vertexShader, version + declareLights(scene) + shadeShader);
  if (!shade)
    return shade.error();
  auto depth = gl.link(vertexShader, depthShader);
  if (!depth)
    return depth.error();
  shadeProgram = *shade;
  depthProgram = *depth;
  for (GLuint program : {depthProgram, shadeProgram}) {
    gl.UseProgram(program);
    gl.UniformMatrix4fv(matrixPlace, 1, GL_FALSE,
                        &scene.camera.viewProjection[0][0]);
  }
  gl.Uniform2f(settingsPlace, scene.settings.albedo, scene.settings.ambient);
  return gl.check("making the shaders");
}

void Drawing::draw() const {
  auto drawMesh = [&](GLuint program, bool hasColor, GLenum test) {
    gl.UseProgram(program);
    GLboolean mask = hasColor ? GL_TRUE : GL_FALSE;
    gl.ColorMask(mask, mask, mask, mask);
    gl.DepthMask(test == GL_LESS ? GL_TRUE : GL_FALSE);
    gl.DepthFunc(test);
    gl.DrawElements(GL_TRIANGLES, indices, GL_UNSIGNED_INT, nullptr);
  };
  gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  gl.DepthMask(GL_TRUE);
  gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  bool isForward = technique == Technique::Forward;
  if (!isForward)
    drawMesh(depthProgram, false, GL_LESS);
  drawMesh(shadeProgram, true, isForward ? GL_LESS : GL_EQUAL);
}

Result<render::Image> Drawing::read() const {
  std::vector<uint8_t> bytes(size_t(size.x) * size.y * 4);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl.ReadPixels(0, 0, size.x, size.y, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
  if (auto ok = gl.check("drawing"); !ok)
    return ok.error();
  render::Image image{size.x, size.y, {}};
  image.pixels.resize(size_t(size.x) * size.y);
  auto *pixel = image.pixels.data();
  for (int y = size.y - 1; y >= 0; --y) // OpenGL's rows go upwards
    for (int x = 0; x < size.x; ++x, ++pixel)
      for (int channel = 0; channel < 4; ++channel)
        pixel->rgba[channel] =
            float(bytes[(size_t(y) * size.x + x) * 4 + channel]) / 255.0f;
  return image;
}
