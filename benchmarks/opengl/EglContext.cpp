//===- EglContext.cpp - A context of OpenGL without a window --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "EglContext.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <algorithm>
#include <cstdio>
#include <dlfcn.h>
#include <utility>
#include <vector>

using namespace piko;
using namespace piko::peer;

namespace {

/// EGL's functions. Those of extensions may be null.
struct Functions {
  PFNEGLGETPROCADDRESSPROC getProcAddress;
  PFNEGLQUERYSTRINGPROC queryString;
  PFNEGLGETERRORPROC getError;
  PFNEGLINITIALIZEPROC initialize;
  PFNEGLTERMINATEPROC terminate;
  PFNEGLBINDAPIPROC bindAPI;
  PFNEGLCHOOSECONFIGPROC chooseConfig;
  PFNEGLCREATECONTEXTPROC createContext;
  PFNEGLMAKECURRENTPROC makeCurrent;
  PFNEGLGETPLATFORMDISPLAYEXTPROC getPlatformDisplay;
  PFNEGLQUERYDEVICESEXTPROC queryDevices;
  PFNEGLQUERYDEVICESTRINGEXTPROC queryDeviceString;
  PFNEGLQUERYDEVICEATTRIBEXTPROC queryDeviceAttrib;
};

/// What may have a context.
struct Candidate {
  std::string name;
  EGLenum platform;
  void *native;
  std::pair<int, int> rank; ///< the least is taken first
};

bool hasWord(const char *words, const std::string &word) {
  return words && (" " + std::string(words) + " ").find(" " + word + " ") !=
                      std::string::npos;
}

bool isSoftware(const std::string &renderer) {
  return std::ranges::any_of(
      std::initializer_list<const char *>{"llvmpipe", "softpipe", "swrast",
                                          "Software"},
      [&](const char *name) { return renderer.find(name) != renderer.npos; });
}

Result<Functions> loadFunctions(const std::string &path) {
  // It stays: what drivers leave for the process's end is in it.
  void *library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library)
    return Error{std::string("expected EGL, but ") + dlerror()};
  Functions egl{};
  bool hasAll = true;
  auto find = [&]<class T>(T &function, const char *name) {
    function = reinterpret_cast<T>(dlsym(library, name));
    hasAll &= function != nullptr;
  };
  find(egl.getProcAddress, "eglGetProcAddress");
  find(egl.queryString, "eglQueryString");
  find(egl.getError, "eglGetError");
  find(egl.initialize, "eglInitialize");
  find(egl.terminate, "eglTerminate");
  find(egl.bindAPI, "eglBindAPI");
  find(egl.chooseConfig, "eglChooseConfig");
  find(egl.createContext, "eglCreateContext");
  find(egl.makeCurrent, "eglMakeCurrent");
  if (!hasAll)
    return Error{"'" + path + "': expected EGL 1.4 or later"};
  auto findExtension = [&]<class T>(T &function, const char *name) {
    function = reinterpret_cast<T>(egl.getProcAddress(name));
  };
  findExtension(egl.getPlatformDisplay, "eglGetPlatformDisplayEXT");
  findExtension(egl.queryDevices, "eglQueryDevicesEXT");
  findExtension(egl.queryDeviceString, "eglQueryDeviceStringEXT");
  findExtension(egl.queryDeviceAttrib, "eglQueryDeviceAttribEXT");
  return egl;
}

/// Looks for a context, and notes why there is none.
class Search {
public:
  Search(const Functions &egl, const ContextOptions &options)
      : egl(egl), options(options) {}

  /// The display, if there is one, with its context current.
  EGLDisplay find(GL &gl, std::string &device) {
    for (const Candidate &candidate : list()) {
      EGLDisplay display =
          egl.getPlatformDisplay(candidate.platform, candidate.native, nullptr);
      if (display == EGL_NO_DISPLAY ||
          !egl.initialize(display, nullptr, nullptr)) {
        note(candidate, "it cannot be initialized");
        continue;
      }
      auto loaded = enter(display);
      if (loaded) {
        gl = *loaded;
        device = candidate.name;
        return display;
      }
      note(candidate, loaded.error().message);
      egl.makeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      egl.terminate(display);
    }
    return EGL_NO_DISPLAY;
  }

  std::string reasons; ///< of each that was looked at

private:
  void note(const Candidate &candidate, const std::string &why) {
    reasons += "\n  " + candidate.name + ": " + why;
  }

  std::vector<Candidate> list() {
    std::vector<Candidate> found;
    const char *extensions = egl.queryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!egl.getPlatformDisplay)
      return found;
    if (hasWord(extensions, "EGL_EXT_platform_device") && egl.queryDevices &&
        egl.queryDeviceString)
      found = listDevices();
    if (hasWord(extensions, "EGL_MESA_platform_surfaceless"))
      found.push_back({"Mesa's surfaceless platform",
                       EGL_PLATFORM_SURFACELESS_MESA,
                       reinterpret_cast<void *>(EGL_DEFAULT_DISPLAY),
                       {3, 0}});
    std::ranges::sort(found, {}, &Candidate::rank);
    return found;
  }

  std::vector<Candidate> listDevices() {
    EGLint count = 0;
    egl.queryDevices(0, nullptr, &count);
    std::vector<EGLDeviceEXT> devices(size_t(std::max(count, 0)));
    if (!egl.queryDevices(count, devices.data(), &count))
      return {};
    std::vector<Candidate> found;
    for (int i = 0; i < count; ++i)
      addDevice(i, devices[i], found);
    return found;
  }

  void addDevice(int number, EGLDeviceEXT device,
                 std::vector<Candidate> &found) {
    const char *extensions = egl.queryDeviceString(device, EGL_EXTENSIONS);
    bool software = hasWord(extensions, "EGL_MESA_device_software");
    Candidate candidate{"EGL's device " + std::to_string(number),
                        EGL_PLATFORM_DEVICE_EXT,
                        device,
                        {2, number}};
    EGLAttrib ordinal = -1;
    if (hasWord(extensions, "EGL_NV_device_cuda") && egl.queryDeviceAttrib &&
        egl.queryDeviceAttrib(device, EGL_CUDA_DEVICE_NV, &ordinal)) {
      candidate.name += ", CUDA device " + std::to_string(ordinal);
      candidate.rank.first = ordinal == options.cudaDevice ? 0 : 1;
    }
    if (software == options.software)
      found.push_back(candidate);
    else
      note(candidate, software ? "it is software, which --software takes"
                               : "it is no software, which --software takes");
  }

  /// Makes a context, and its functions.
  Result<GL> enter(EGLDisplay display) {
    const char *extensions = egl.queryString(display, EGL_EXTENSIONS);
    if (!hasWord(extensions, "EGL_KHR_surfaceless_context"))
      return Error{"it has no context without a surface"};
    if (!egl.bindAPI(EGL_OPENGL_API))
      return Error{"it has no OpenGL"};
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT,
                             EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint count = 0;
    if ((!egl.chooseConfig(display, wanted, &config, 1, &count) || !count) &&
        !hasWord(extensions, "EGL_KHR_no_config_context"))
      return Error{"it has no configuration for OpenGL"};
    const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                              4,
                              EGL_CONTEXT_MINOR_VERSION,
                              3,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                              EGL_NONE};
    EGLContext context =
        egl.createContext(display, config, EGL_NO_CONTEXT, version);
    if (context == EGL_NO_CONTEXT ||
        !egl.makeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
      char code[16];
      std::snprintf(code, sizeof code, "0x%x", unsigned(egl.getError()));
      return Error{"it has no context of OpenGL 4.3, core profile: EGL's "
                   "error " +
                   std::string(code)};
    }
    return loadGL();
  }

  Result<GL> loadGL() {
    auto gl = GL::load([&](const char *name) {
      return reinterpret_cast<GL::Function>(egl.getProcAddress(name));
    });
    if (!gl)
      return gl;
    std::string renderer = gl->text(GL_RENDERER);
    if (isSoftware(renderer) && !options.software)
      return Error{"its renderer '" + renderer +
                   "' is software, which --software takes"};
    if (!isSoftware(renderer) && options.software)
      return Error{"its renderer '" + renderer + "' is no software"};
    return gl;
  }

  const Functions &egl;
  const ContextOptions &options;
};

} // namespace

struct EglContext::State {
  Functions egl;
  GL gl;
  std::string device;
  EGLDisplay display = EGL_NO_DISPLAY;

  explicit State(const Functions &egl) : egl(egl) {}
  State(const State &) = delete;
  State &operator=(const State &) = delete;
  ~State() {
    if (display == EGL_NO_DISPLAY)
      return;
    egl.makeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    egl.terminate(display); // and all that is its own
  }
};

EglContext::EglContext(std::shared_ptr<State> state)
    : state(std::move(state)) {}

const GL &EglContext::gl() const { return state->gl; }
const std::string &EglContext::device() const { return state->device; }

Result<EglContext> EglContext::create(const ContextOptions &options) {
  auto egl = loadFunctions(options.library);
  if (!egl)
    return egl.error();
  auto state = std::make_shared<State>(*egl);
  Search search(state->egl, options);
  state->display = search.find(state->gl, state->device);
  if (state->display == EGL_NO_DISPLAY)
    return Error{
        "'" + options.library + "': expected OpenGL 4.3 " +
        (options.software ? "in software" : "of a card") +
        (search.reasons.empty()
             ? ", but it has neither devices nor Mesa's surfaceless platform"
             : ", but there is none:" + search.reasons)};
  return EglContext(std::move(state));
}
