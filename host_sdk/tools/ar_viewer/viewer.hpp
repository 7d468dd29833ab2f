// A scene that runs: reads pictures and light, and draws frame by frame.
#pragma once

#include <memory>
#include <string>

#include <lightwell/result.hpp>

#include "ar_viewer/renderer.hpp"
#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

struct FrameReport {
  double sdk_ms = 0;     ///< Queries of the SDK: the newest light, in the world, irradiance and radiance of the maps.
  double shadow_ms = 0;  ///< The SDK's ShadowCaster.
  double render_ms = 0;  ///< All else but reading the picture: with the tag, until the picture is drawn.
  Validity validity = Validity::none;  ///< Of the light.
  bool camera_found = true;            ///< Whether the tag was found; without it the background is shown alone.
};

/// Needs a current context of OpenGL 3.3 core until it is destroyed.
class Viewer {
 public:
  /// Errors of Background::open(), Renderer::make() and open_light_source(); invalid_argument for a source that the
  /// scene does not have.
  [[nodiscard]] static Result<Viewer> make(Scene scene, const std::string& source = "light");
  Viewer(Viewer&&) noexcept;
  Viewer& operator=(Viewer&&) noexcept;
  ~Viewer();

  /// Takes the next picture and light and draws them into renderer().target().
  [[nodiscard]] Result<FrameReport> draw_next();
  /// Draws the shadow of that frame into renderer().target(): Renderer::draw_shadow().
  [[nodiscard]] Status draw_shadow();

  /// Changes to shading, side_by_side, shadow and exposure apply to the next frame.
  [[nodiscard]] Scene& scene();
  [[nodiscard]] Renderer& renderer();
  [[nodiscard]] const std::string& source() const;
  [[nodiscard]] Status set_source(const std::string& name);

 private:
  struct Impl;
  explicit Viewer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell::viewer
