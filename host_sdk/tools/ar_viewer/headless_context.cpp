#include "ar_viewer/headless_context.hpp"

#include <array>
#include <utility>

#include <epoxy/egl.h>
#include <epoxy/gl.h>

namespace lightwell::viewer {

struct HeadlessContext::Egl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;

  Egl() = default;
  Egl(const Egl&) = delete;
  Egl& operator=(const Egl&) = delete;
  ~Egl() {
    if (display == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    eglTerminate(display);
  }
};

HeadlessContext::HeadlessContext(std::unique_ptr<Egl> egl) : egl_(std::move(egl)) {}
HeadlessContext::HeadlessContext(HeadlessContext&&) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&&) noexcept = default;
HeadlessContext::~HeadlessContext() = default;

namespace {

/// Mesa's surfaceless platform, or else the first device of EGL, as drivers without that platform have it.
EGLDisplay open_display() {
  const auto opened = [](EGLenum platform, void* native) {
    const EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, nullptr);
    return display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE ? display : EGL_NO_DISPLAY;
  };
  EGLDisplay display = EGL_NO_DISPLAY;
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
    display = opened(EGL_PLATFORM_SURFACELESS_MESA, nullptr);
  if (display != EGL_NO_DISPLAY || !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) return display;
  EGLDeviceEXT device = EGL_NO_DEVICE_EXT;
  EGLint devices = 0;
  if (eglQueryDevicesEXT(1, &device, &devices) != EGL_TRUE || devices == 0) return EGL_NO_DISPLAY;
  return opened(EGL_PLATFORM_DEVICE_EXT, device);
}

}  // namespace

Result<HeadlessContext> HeadlessContext::make() {
  const auto failed = [](const char* what) {
    return Status(StatusCode::failed_precondition,
                  std::string(what) +
                      ": rendering without a display needs a graphics driver with EGL; Mesa's software renderer is in "
                      "libegl-mesa0 and libgl1-mesa-dri");
  };
  auto egl = std::make_unique<Egl>();
  egl->display = open_display();
  if (egl->display == EGL_NO_DISPLAY) return failed("EGL has no platform without a display");
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return failed("EGL has no OpenGL");
  constexpr std::array<EGLint, 5> kWanted = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                             EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (eglChooseConfig(egl->display, kWanted.data(), &config, 1, &configs) != EGL_TRUE || configs == 0)
    return failed("EGL has no configuration for OpenGL");
  constexpr std::array<EGLint, 7> kVersion = {
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  egl->context = eglCreateContext(egl->display, config, EGL_NO_CONTEXT, kVersion.data());
  if (egl->context == EGL_NO_CONTEXT ||
      eglMakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl->context) != EGL_TRUE)
    return failed("no context of OpenGL 3.3 core");
  return HeadlessContext(std::move(egl));
}

std::string HeadlessContext::renderer() const {
  return reinterpret_cast<const char*>(glGetString(GL_RENDERER));  // NOLINT: OpenGL's type of text
}

}  // namespace lightwell::viewer
