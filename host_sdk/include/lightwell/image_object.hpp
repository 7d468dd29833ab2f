// Image-based objects: photographs of an object under many light positions, relit by any lights without its geometry
// (optional library lightwell_image_object).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// How an object was captured. The object's frame: origin on the axis of the turntable, +Y up along it, metres. The
/// frame of the rig does not turn: the camera is at +Z and looks along -Z; at turn 0 both frames are equal.
struct ObjectRig {
  int columns = 0, rows = 0;  ///< Pixels of each picture, 1 to kMaxSide.
  /// Positions of the light in the frame of the rig, 1 to kMaxLights. Their directions from the origin count: a light
  /// is taken as distant.
  std::vector<Vec3f> light_positions;
  /// Turn of the object for each view, rad, right-handed about +Y: p_rig = R_y(turn) p_object.
  std::vector<float> turns_rad;
  /// Irradiance at normal incidence of the light at each of its positions, at the origin, in the unit in which lights
  /// are given to ObjectRelighter. A light of this irradiance reproduces the picture.
  float reference_irradiance = 1;
  float camera_distance_m = 0;  ///< From the camera to the origin, above 0.
  float half_width_m = 0;       ///< Half of the picture's width at that distance, above 0.

  static constexpr int kMaxSide = 4096;
  static constexpr std::size_t kMaxLights = 1024, kMaxViews = 4096;

  /// invalid_argument, naming the member and the value.
  [[nodiscard]] Status validate() const;
};

/// A light that illuminates an object, in the object's frame.
struct ObjectLight {
  Vec3f direction;        ///< Towards the light, any length above 0.
  Irradiance irradiance;  ///< At normal incidence, at the object's origin.
  /// Of the cap, 0 to pi / 2. It softens the shadow that the object casts (object_shadow.hpp); the shadows on the
  /// object are those of the captured light.
  float angular_radius_rad = 0;
};

/// How a light between the captured positions is reproduced.
enum class LightInterpolation : std::uint8_t {
  nearest,  ///< The captured light with the nearest direction, as CyberMirage does.
  smooth,   ///< Interpolated between the nearest captured lights; equal to the capture at their directions.
};

/// What a picture was computed from.
struct RelightSummary {
  int lights = 0;  ///< Lights with irradiance.
  /// Largest angle between a light and the nearest captured one, rad. Well above the spacing of the captured positions:
  /// that light is outside of what was captured, and is replaced by the nearest light inside.
  float outside_rad = 0;
};

namespace image_object {
struct DecodedView;
}

/// One view of an object, decoded. Immutable; copies share their memory, threads may read it concurrently.
class ObjectView {
 public:
  [[nodiscard]] int columns() const;
  [[nodiscard]] int rows() const;
  [[nodiscard]] float turn_rad() const;
  /// Share of each pixel that the object covers, 0 to 255; rows from the top.
  [[nodiscard]] std::span<const std::uint8_t> coverage() const;
  /// Bytes that relighting this view reads.
  [[nodiscard]] std::size_t bytes_read() const;

  /// Used by the library.
  explicit ObjectView(std::shared_ptr<const image_object::DecodedView> decoded) : decoded_(std::move(decoded)) {}
  [[nodiscard]] const image_object::DecodedView& decoded() const { return *decoded_; }

 private:
  std::shared_ptr<const image_object::DecodedView> decoded_;
};

/// A data set: views of an object, each under every light position, compressed. Each view is decoded by itself.
class ImageObject {
 public:
  /// Reads the table of contents; views are decoded when view() is called. Takes the bytes of a file. data_loss where
  /// they are damaged or truncated, invalid_argument for another format or version; sizes are checked before anything
  /// is allocated.
  [[nodiscard]] static Result<ImageObject> from_bytes(std::string bytes);

  [[nodiscard]] const ObjectRig& rig() const { return rig_; }
  /// Compressed bytes of a view; 0 if there is no such view.
  [[nodiscard]] std::size_t view_bytes(std::size_t view) const;
  /// Decodes a view. not_found if there is no such view, data_loss if its bytes are damaged. Any number of threads.
  [[nodiscard]] Result<ObjectView> view(std::size_t view) const;
  /// Decodes the coverage of a view alone. As view().
  [[nodiscard]] Result<std::vector<std::uint8_t>> coverage(std::size_t view) const;
  /// The view whose turn is nearest to the one from which an eye at that position (object's frame, m) sees the object.
  /// Heights are ignored: the views are on one circle. nullopt for an eye on the axis.
  [[nodiscard]] std::optional<std::size_t> nearest_view(Vec3d eye) const;

 private:
  struct Entry {
    std::size_t offset = 0, size = 0;
    std::uint32_t crc = 0;
  };
  /// The bytes of a view, after the check of their checksum.
  [[nodiscard]] Result<std::span<const std::byte>> checked_bytes(std::size_t view) const;

  std::shared_ptr<const std::string> bytes_;
  ObjectRig rig_;
  std::vector<Entry> entries_;
};

/// Computes pictures of a view under lights. Create it once and reuse it: a call allocates nothing if it has not more
/// lights than a call before. One thread.
///
/// Method. H_r = H_b sum_s I_s L_s (equations 8 to 10 of the CyberMirage paper: base colour, relative luminance), in
/// linear light. L_s is the square of a sum over basis functions of the light's position; the basis, not the pictures,
/// is interpolated between positions. Highlights, whose colour is that of the light, are a second luminance
/// (dichromatic reflection, Shafer 1985). Sums run over the transform coefficients that are not zero (as in Ng,
/// Ramamoorthi & Hanrahan 2003).
class ObjectRelighter {
 public:
  ObjectRelighter();
  ObjectRelighter(ObjectRelighter&&) noexcept;
  ObjectRelighter& operator=(ObjectRelighter&&) noexcept;
  ~ObjectRelighter();

  /// Most lights of a call.
  static constexpr std::size_t kMaxLights = 1024;

  /// Fills out[row * columns + column]: linear, multiplied by the coverage of the pixel; black without lights. Never
  /// NaN or negative. invalid_argument, and nothing written, for a light whose direction is zero or not finite, whose
  /// irradiance is negative or not finite, for a radius out of range, too many lights, and for a span of another size.
  [[nodiscard]] Result<RelightSummary> relight(const ObjectView& view, std::span<const ObjectLight> lights,
                                               LightInterpolation interpolation, std::span<Radiance> out);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The lights of a lighting as an object sees them: its discrete lights, then its residual radiance (spherical
/// harmonics or environment map) as `residual_directions` lights of equal solid angles. A light of known distance is
/// seen from the object's origin, with the irradiance there. `lights` is cleared first. The number of lights without
/// irradiance is not added. failed_precondition for a lighting without values (validity none, before_history,
/// invalid_query); invalid_argument for a pose that is not finite, and for a light at the object's origin.
[[nodiscard]] Status object_lights(const Lighting& lighting, const Pose& T_lighting_object, int residual_directions,
                                   std::vector<ObjectLight>& lights);

}  // namespace lightwell
