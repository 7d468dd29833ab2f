// Scenes of the campaign of the error bound (README.md): a panorama with lamps that switch and move, and the true
// irradiance of each of its states, the sum of that of its parts.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "firmware/estimate/extremes/scene.hpp"
#include "reference/vector.hpp"
#include "sim/panorama.hpp"

namespace lightwell::measure {

enum class SceneKind { real, uniform, gradient, checker, stripes, windows, lamps, room, dark };
inline constexpr SceneKind kSceneKinds[] = {SceneKind::real,    SceneKind::uniform, SceneKind::gradient,
                                            SceneKind::checker, SceneKind::stripes, SceneKind::windows,
                                            SceneKind::lamps,   SceneKind::room,    SceneKind::dark};
[[nodiscard]] std::string_view to_string(SceneKind kind);

/// Pixels of an equirectangular picture that are not black, and their irradiance.
struct PixelLight {
  std::vector<std::size_t> pixels;  ///< Indices, row by row.
  std::vector<Radiance> radiance;
  std::vector<reference::Rgb> irradiance;  ///< At truth_normals(), world frame.
};

/// A lamp of uniform radiance: a disc of this angular radius, or a rectangle in the plane that touches the sphere at
/// `axis`.
struct LampShape {
  enum class Outline { disc, rectangle };
  Outline outline = Outline::disc;
  Vec3d axis;                                      ///< Unit, world frame.
  double half_width_rad = 0, half_height_rad = 0;  ///< Below pi / 2. A disc has its radius in both.
  Radiance radiance;
};

/// The pixels of a picture of `width` x `width` / 2 with the share of each that the lamp covers (16 samples). A lamp
/// between all samples is one pixel with its energy.
[[nodiscard]] PixelLight rasterized(const LampShape& lamp, int width);

struct LampState {
  Vec3d axis;         ///< Of a lamp of the panorama itself: not used, it stays where it is.
  double factor = 1;  ///< Of its radiance. 0: off.

  friend bool operator==(const LampState&, const LampState&) = default;
};

/// `gain` is a factor of all light.
struct LightState {
  double gain = 1;
  std::vector<LampState> lamps;  ///< As many as the scene's.

  friend bool operator==(const LightState&, const LightState&) = default;
};

class CampaignScene {
 public:
  /// Draws a scene of this kind. Real ones are drawn from all_panoramas() and kept in memory once they were read.
  /// not_found where they are missing.
  [[nodiscard]] static Result<CampaignScene> draw(SceneKind kind, extremes::Chance& chance);

  /// The kind; of a real one, its file's name.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// All lamps as drawn, half of those that are not the panorama's own switched off.
  [[nodiscard]] const LightState& first_state() const { return first_; }
  /// Whether the lamp can move.
  [[nodiscard]] bool movable(std::size_t lamp) const { return lamps_[lamp].shape.has_value(); }

  /// The panorama in this state, and its true irradiance at truth_normals(). Both stay valid until the next set().
  void set(const LightState& state);
  [[nodiscard]] const sim::Panorama& panorama() const { return panorama_; }
  [[nodiscard]] const std::vector<reference::Rgb>& irradiance() const { return irradiance_; }

 private:
  struct Lamp {
    std::optional<LampShape> shape;  ///< None for pixels of the panorama.
    PixelLight light;                ///< Of `shape`.
  };
  void append_lamp(const LampShape& shape, double factor);
  void add_random_lamps(int count, double largest_share, extremes::Chance& chance);
  [[nodiscard]] double mean_irradiance() const;

  std::string name_;
  sim::Panorama base_;
  std::vector<reference::Rgb> base_irradiance_;
  std::vector<Lamp> lamps_;
  LightState first_;
  sim::Panorama panorama_;
  std::vector<reference::Rgb> irradiance_;
};

}  // namespace lightwell::measure
