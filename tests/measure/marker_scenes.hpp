// Path-traced pictures of random marker scenes (tests/reference/mitsuba/marker_scenes) with their truth, and the errors
// of an estimate.
//   load_marker_scenes   reads the truth of a set
//   score                errors of a descriptor
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell::measure {

/// A lamp, seen from the body's centre; probe frame.
struct SceneLamp {
  Vec3d direction;         ///< Unit.
  double azimuth_deg = 0;  ///< In the table's plane, 0 towards the camera, -180 to 180.
};

/// What can be expected of an estimate (README.md of the scenes).
enum class SceneClass {
  lit_faces,      ///< Two visible faces receive at least 60 % of their light from the strongest lamp.
  shadow_behind,  ///< Not so; the strongest lamp is behind the body, a shadow on a plain or weakly patterned table is
                  ///< in the picture.
  other,
};
[[nodiscard]] const char* to_string(SceneClass scene_class);

struct MarkerScene {
  std::string name;    ///< "dev/0003".
  std::string body;    ///< Name of the body's file without extension.
  std::string defect;  ///< Of the set `defects`, otherwise empty.
  std::string table;   ///< Kind of its texture.
  double size_px = 0;  ///< Larger side of the body's bounding box.
  int frame = 0;       ///< Within a sequence.
  /// As a camera reports it: of the first frame of a sequence 1, later ones relative to it (automatic exposure).
  double exposure_s = 1;
  RigParameters rig;  ///< The probe's frame is the camera's.
  Pose probe_body;
  std::vector<SceneLamp> lamps;  ///< The strongest first.
  /// At the body's centre without the body, in units of the descriptor (picture value 1 for an exposure of 1 s): each
  /// normal, probe frame.
  std::vector<Vec3d> normals;
  std::vector<std::array<double, 3>> irradiance;
  SceneClass scene_class = SceneClass::other;
};

/// Reads SET.jsonl in `folder`, in its order. not_found: it cannot be read; data_loss: names the line.
[[nodiscard]] Result<std::vector<MarkerScene>> load_marker_scenes(const std::string& folder, const std::string& set);

struct SceneScore {
  bool answered = false;  ///< Whether there is a descriptor.
  bool unsure = true;
  bool light = false;  ///< Whether the descriptor has a light; without one the next three are not set.
  /// Of the strongest lamp, against the nearest of as many estimated lights as there are lamps, strongest first.
  double error_deg = 0, sigma_deg = 0, mahalanobis2 = 0;
  double primary_error_deg = 0;  ///< Of the strongest lamp, against the strongest estimated light.
  double irradiance_rms = 0;     ///< Relative, over all normals and channels.
};

/// std::nullopt: the estimator had no answer.
[[nodiscard]] SceneScore score(const MarkerScene& scene, const std::optional<Descriptor>& answer);

}  // namespace lightwell::measure
