//===- GL.cpp - The part of OpenGL that the peer calls --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "GL.h"

#include <vector>

using namespace piko;
using namespace piko::peer;

Result<GL> GL::load(const Find &find) {
  GL gl;
#define GL_FUNCTION(TYPE, NAME)                                                \
  gl.NAME = reinterpret_cast<TYPE>(find("gl" #NAME));                          \
  if (!gl.NAME)                                                                \
    return Error{"expected the function gl" #NAME ", which it does not have"};
#include "GL.def"
#undef GL_FUNCTION
  return gl;
}

std::string GL::text(GLenum name) const {
  const auto *bytes = reinterpret_cast<const char *>(GetString(name));
  return bytes ? bytes : "unknown";
}

int64_t GL::number(GLenum name) const {
  GLint64 value = 0;
  GetInteger64v(name, &value);
  return value;
}

static std::string describe(GLenum error) {
  switch (error) {
  case GL_INVALID_ENUM:
    return "GL_INVALID_ENUM";
  case GL_INVALID_VALUE:
    return "GL_INVALID_VALUE";
  case GL_INVALID_OPERATION:
    return "GL_INVALID_OPERATION";
  case GL_INVALID_FRAMEBUFFER_OPERATION:
    return "GL_INVALID_FRAMEBUFFER_OPERATION";
  case GL_OUT_OF_MEMORY:
    return "GL_OUT_OF_MEMORY";
  default:
    return "error " + std::to_string(error);
  }
}

Result<Done> GL::check(const std::string &what) const {
  std::string errors;
  // A context that is lost has no end of them.
  for (int i = 0; i < 8; ++i) {
    GLenum error = GetError();
    if (error == GL_NO_ERROR)
      break;
    errors += (errors.empty() ? "" : ", ") + describe(error);
  }
  if (!errors.empty())
    return Error{what + ": " + errors};
  return Done{};
}

/// What a driver says of a shader or a program.
template <class GetNumber, class GetLog>
static std::string readLog(GLuint object, GetNumber getNumber, GetLog getLog) {
  GLint length = 0;
  getNumber(object, GL_INFO_LOG_LENGTH, &length);
  std::vector<char> log(size_t(length) + 1);
  getLog(object, length, nullptr, log.data());
  return log.data();
}

static Result<GLuint> compile(const GL &gl, GLenum kind,
                              const std::string &text) {
  GLuint shader = gl.CreateShader(kind);
  const char *start = text.c_str();
  gl.ShaderSource(shader, 1, &start, nullptr);
  gl.CompileShader(shader);
  GLint isCompiled = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &isCompiled);
  if (!isCompiled)
    return Error{
        std::string("cannot compile the ") +
        (kind == GL_VERTEX_SHADER ? "vertex" : "fragment") +
        " shader: " + readLog(shader, gl.GetShaderiv, gl.GetShaderInfoLog)};
  return shader;
}

Result<GLuint> GL::link(const std::string &vertex,
                        const std::string &fragment) const {
  GLuint program = CreateProgram();
  for (auto [kind, text] : {std::pair(GLenum(GL_VERTEX_SHADER), &vertex),
                            std::pair(GLenum(GL_FRAGMENT_SHADER), &fragment)}) {
    auto shader = compile(*this, kind, *text);
    if (!shader)
      return shader;
    AttachShader(program, *shader);
    DeleteShader(*shader); // goes with the program
  }
  LinkProgram(program);
  GLint isLinked = 0;
  GetProgramiv(program, GL_LINK_STATUS, &isLinked);
  if (!isLinked)
    return Error{"cannot link the shaders: " +
                 readLog(program, GetProgramiv, GetProgramInfoLog)};
  return program;
}
