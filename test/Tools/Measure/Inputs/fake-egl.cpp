//===- fake-egl.cpp - EGL of a machine with cards -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The machine's own EGL, of which Mesa's device in software appears as three
// more: CUDA devices 1 and 0, in this order, and one of somebody else's. They
// draw by the same renderer, which calls itself a card's. FAKE_EGL is what of
// it fails, a list of words.
//
//===----------------------------------------------------------------------===//
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>

#include <cstdlib>
#include <cstring>
#include <dlfcn.h>

namespace {

void *own() {
  static void *library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
  return library;
}

template <class T> T core(const char *name) {
  return reinterpret_cast<T>(dlsym(own(), name));
}

auto find(const char *name) {
  return core<PFNEGLGETPROCADDRESSPROC>("eglGetProcAddress")(name);
}

bool fails(const char *what) {
  const char *words = std::getenv("FAKE_EGL");
  return words && std::strstr(words, what);
}

char devices[4]; // whose addresses are the devices

EGLBoolean queryDevices(EGLint most, EGLDeviceEXT *found, EGLint *count) {
  *count = 4;
  for (int i = 0; found && i < most && i < 4; ++i)
    found[i] = &devices[i];
  return EGL_TRUE;
}

const char *queryDeviceString(EGLDeviceEXT device, EGLint) {
  const char *of[] = {"EGL_MESA_device_software", "EGL_NV_device_cuda",
                      "EGL_NV_device_cuda EGL_EXT_device_drm", ""};
  return of[static_cast<char *>(device) - devices];
}

EGLBoolean queryDeviceAttrib(EGLDeviceEXT device, EGLint, EGLAttrib *value) {
  *value = device == &devices[1] ? 1 : 0;
  return EGL_TRUE;
}

EGLDisplay getPlatformDisplay(EGLenum, void *native, const EGLint *) {
  const char *names[] = {"device-0", "device-1", "device-2", "device-3"};
  for (int i = 0; i < 4; ++i)
    if (native == &devices[i] && fails(names[i]))
      return EGL_NO_DISPLAY;
  if (!native && fails("surfaceless"))
    return EGL_NO_DISPLAY;
  return reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      find("eglGetPlatformDisplayEXT"))(EGL_PLATFORM_SURFACELESS_MESA, nullptr,
                                        nullptr);
}

const GLubyte *getString(GLenum name) {
  if (name == GL_RENDERER)
    return reinterpret_cast<const GLubyte *>("a card");
  return reinterpret_cast<PFNGLGETSTRINGPROC>(find("glGetString"))(name);
}

void getShader(GLuint shader, GLenum name, GLint *value) {
  *value = name == GL_COMPILE_STATUS ? 0 : 64;
}

void getShaderLog(GLuint, GLsizei size, GLsizei *, char *log) {
  std::strncpy(log, "line 7: this card has no floor", size_t(size));
}

GLenum checkFramebuffer(GLenum) { return GL_FRAMEBUFFER_UNSUPPORTED; }

void bufferData(GLenum, GLsizeiptr, const void *, GLenum) {}

GLenum getError() {
  static int calls = 0;
  return ++calls == 2 ? GL_OUT_OF_MEMORY : GL_NO_ERROR;
}

template <class T> auto fake(T function) {
  return reinterpret_cast<__eglMustCastToProperFunctionPointerType>(function);
}

} // namespace

extern "C" {

__eglMustCastToProperFunctionPointerType eglGetProcAddress(const char *name) {
  auto is = [&](const char *other) { return !std::strcmp(name, other); };
  if (is("eglQueryDevicesEXT"))
    return fake(queryDevices);
  if (is("eglQueryDeviceStringEXT"))
    return fake(queryDeviceString);
  if (is("eglQueryDeviceAttribEXT"))
    return fake(queryDeviceAttrib);
  if (is("eglGetPlatformDisplayEXT"))
    return fails("platforms") ? nullptr : fake(getPlatformDisplay);
  if (is("glGetString"))
    return fake(getString);
  if (is("glGetShaderiv") && fails("shader"))
    return fake(getShader);
  if (is("glGetShaderInfoLog") && fails("shader"))
    return fake(getShaderLog);
  if (is("glCheckFramebufferStatus") && fails("framebuffer"))
    return fake(checkFramebuffer);
  if (is("glBufferData") && fails("memory"))
    return fake(bufferData);
  if (is("glGetError") && fails("memory"))
    return fake(getError);
  if (is("glBeginQuery") && fails("function"))
    return nullptr;
  return find(name);
}

const char *eglQueryString(EGLDisplay display, EGLint name) {
  if (display == EGL_NO_DISPLAY)
    return "EGL_EXT_platform_device EGL_MESA_platform_surfaceless";
  if (fails("extensions"))
    return "";
  return core<PFNEGLQUERYSTRINGPROC>("eglQueryString")(display, name);
}

EGLint eglGetError() { return core<PFNEGLGETERRORPROC>("eglGetError")(); }

EGLBoolean eglInitialize(EGLDisplay display, EGLint *major, EGLint *minor) {
  return core<PFNEGLINITIALIZEPROC>("eglInitialize")(display, major, minor);
}

EGLBoolean eglTerminate(EGLDisplay display) {
  return core<PFNEGLTERMINATEPROC>("eglTerminate")(display);
}

EGLBoolean eglBindAPI(EGLenum api) {
  return core<PFNEGLBINDAPIPROC>("eglBindAPI")(api);
}

EGLBoolean eglChooseConfig(EGLDisplay display, const EGLint *wanted,
                           EGLConfig *configs, EGLint size, EGLint *count) {
  return core<PFNEGLCHOOSECONFIGPROC>("eglChooseConfig")(display, wanted,
                                                         configs, size, count);
}

EGLContext eglCreateContext(EGLDisplay display, EGLConfig config,
                            EGLContext shared, const EGLint *wanted) {
  EGLint tooNew[] = {EGL_CONTEXT_MAJOR_VERSION, 9, EGL_NONE};
  return core<PFNEGLCREATECONTEXTPROC>("eglCreateContext")(
      display, config, shared, fails("context") ? tooNew : wanted);
}

EGLBoolean eglMakeCurrent(EGLDisplay display, EGLSurface draw, EGLSurface read,
                          EGLContext context) {
  return core<PFNEGLMAKECURRENTPROC>("eglMakeCurrent")(display, draw, read,
                                                       context);
}
}
