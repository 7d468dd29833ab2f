// Path-traced trials of a virtual object beside a real one (tests/reference/mitsuba/viewer): camera pictures without
// and with the object, what the camera sees where, and the shadow that a picture shows.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "measure/shadow_outline.hpp"

namespace lightwell::measure {

/// What all trials share. World: +Y up, the table is y = 0; the object is an upright cylinder in the origin.
struct TrialSetup {
  std::string folder;  ///< Of the pictures.
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px; the centre of the top left pixel is (0, 0).
  Pose T_world_camera;                    ///< Camera: +X right, +Y up, -Z forward.
  double object_height_m = 0, object_radius_m = 0;
  std::array<double, 3> object_albedo{};
  std::array<double, 2> table_m{};  ///< Along x and z, about the origin.

  /// Unit direction of the ray through a place in the picture, in the world.
  [[nodiscard]] Vec3d ray(double u, double v) const;
  /// Where that ray meets the table; nullopt beside it. The object does not count.
  [[nodiscard]] std::optional<Vec3d> on_table(double u, double v) const;
  /// Whether it meets the object.
  [[nodiscard]] bool on_object(double u, double v) const;
};

struct ViewerTrial {
  std::string name;
  double azimuth_deg = 0;  ///< Of the lamp, seen from the object's top: of (sin a, 0, cos a), 0 towards the camera.
  double elevation_deg = 0;
  double distance_m = 0;  ///< Of the lamp from there.
  std::string width;      ///< "small" or "wide".
  Vec3d probe_top, probe_away;
  double shadow_m = 0;  ///< Of the object's axis.
  double gain = 0;      ///< Linear picture value per radiance.
};

/// Reads setup.json and trials.jsonl of the folder. not_found, data_loss: name file and line.
[[nodiscard]] Result<TrialSetup> load_trial_setup(const std::string& folder);
[[nodiscard]] Result<std::vector<ViewerTrial>> load_viewer_trials(const std::string& folder);

/// Linear r, g, b of each pixel, rows from the top.
struct ColorPicture {
  int width = 0, height = 0;
  std::vector<std::array<float, 3>> values;

  [[nodiscard]] const std::array<float, 3>& at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

/// PNG and JPEG: sRGB, decoded. EXR: as it is.
[[nodiscard]] Result<ColorPicture> read_color_picture(const std::string& path);

/// Pixels that see the object in all or none of their area, and those in between.
enum class Seen : std::uint8_t { table, object, edge, other };
/// `other`: neither table nor object. Pixels within 2 px of the object's outline are its edge.
[[nodiscard]] std::vector<Seen> seen_by(const TrialSetup& setup);

/// Distance around the object's foot within which a shadow of this length is looked for, m.
[[nodiscard]] double shadow_reach_m(double shadow_m);

/// Luminance of `with` per that of `without` at pixels that see the table within shadow_reach_m(); NaN elsewhere. Means
/// over 3 x 3 pixels, against noise.
[[nodiscard]] GreyPicture light_ratio(const TrialSetup& setup, const ViewerTrial& trial, const ColorPicture& with,
                                      const ColorPicture& without);

/// A shadow as CubeMap360 (section IV) evaluates it: by the place of its tip.
struct Shadow {
  std::vector<Segment> outline;  ///< Where half of the removed light is removed.
  double depth = 0;              ///< The removed share of the light inside.
  double azimuth_deg = 0;        ///< Of the light, opposite to the shadow of the centre of the object's top.
  double elevation_deg = 0;      ///< From the object's height and the length of the shadow to there.
};

/// nullopt without a shadow: less than 3 % of the light is removed.
[[nodiscard]] std::optional<Shadow> shadow_of(const TrialSetup& setup, const GreyPicture& ratio);

/// a - b within -180 to 180.
[[nodiscard]] double angle_difference_deg(double a, double b);

}  // namespace lightwell::measure
