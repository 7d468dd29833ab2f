// Sequences of pictures of a glossy plane with their ground truth (tests/reference/glossy_plane), as noisy frames of a
// simulated sensor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "measure/shots.hpp"
#include "reference/glossy_sequence.hpp"

namespace lightwell::measure {

struct SpecularSequenceOptions {
  std::string name;
  /// "lamps", "gradient", or the path of a panorama of linear radiance.
  std::string environment = "lamps";
  double alpha = 0.1;  ///< Of the plane's gloss; 0: a matte plane.
  reference::FresnelTerm fresnel = reference::FresnelTerm::kSchlick;
  std::optional<double> right_alpha;  ///< Of the half x >= 0, where it is of another material; 0: matte.
  double curl = 0;                    ///< GlossyScene::curl.
  bool textured = true;
  reference::PlaneTexture albedo{};  ///< Of the plane; empty: a printed cover, or grey where `textured` is false.
  std::uint64_t seed = 1;
  int frames = 600;
  double turns = 5;                         ///< Of the spiral of its views; held-out views have 5.
  double highest_deg = 82, lowest_deg = 8;  ///< Elevations of the camera. Held-out views are between 82 and 17.
  double farthest_m = 0.55;                 ///< From the plane's middle, at most.
  /// From this frame on the strongest light is off.
  std::optional<int> light_out_at;
  /// Every 100 frames, from the 50th on, the picture shows a hand over the plane for this number of frames.
  int hand_frames = 0;
  /// In this share of the frames the tags' pose is that of wrong corners: off by 5 degrees and 2 cm.
  double jump_share = 0;
  int width = 640, height = 480;
  double focal_px = 560;
  double rotation_noise_rad = 0.3 / 180 * 3.14159265358979, translation_noise_m = 0.001;  ///< Of the tag's poses.
  /// Diffuse radiance of white paper (albedo 0.8), share of full scale.
  double white = 0.6;
  double exposure_factor = 1;  ///< Exposures vary by this factor, in turn.
  PixelFormat format = PixelFormat::rgb8;
  /// Keeps its pictures in this folder, which exists, so that a sequence of the same options renders none of them
  /// again; empty: does not. Pictures of another renderer are refused.
  std::string frames_folder;
};

/// The sequences of tests/figures: a room, an office, panoramas, lamps; roughness 0.17, 0.32, 0.45; one with saturated
/// highlights, one whose exposure varies.
[[nodiscard]] std::vector<std::string> sequence_names();
/// not_found: an unknown name, or a panorama that `cmake/fetch_panoramas` has not fetched.
[[nodiscard]] Result<SpecularSequenceOptions> sequence_options(const std::string& name);

/// A square of kPlane_m under distant light. Renders each picture when it is asked for.
class SpecularSequence {
 public:
  static constexpr double kPlane_m = 0.2;
  static constexpr double kExposure_s = 0.01;

  /// failed_precondition: frames_folder has pictures that this renderer does not make.
  [[nodiscard]] static Result<std::unique_ptr<SpecularSequence>> make(const SpecularSequenceOptions& options);

  [[nodiscard]] const SpecularSequenceOptions& options() const { return options_; }
  [[nodiscard]] const RigParameters& rig() const { return camera_->rig(); }
  /// Frame k of the trajectory.
  [[nodiscard]] Shot frame(int k) const;
  /// T_probe_plane of frame k: true, and with the tag's noise.
  [[nodiscard]] Pose true_pose(int k) const;
  [[nodiscard]] UncertainPose tag_pose(int k) const;

  /// Views that are not in the sequence, of another trajectory through the same directions.
  [[nodiscard]] int held_out_count() const { return kHeldOut; }
  [[nodiscard]] Pose held_out_pose(int k) const;
  /// Normalised intensity: share of full scale at kExposure_s, not clipped. `coverage` is 1 on the plane.
  [[nodiscard]] reference::GlossyView held_out_view(int k) const;
  /// Its diffuse part; black off the plane.
  [[nodiscard]] reference::GlossyView held_out_diffuse(int k) const;

  /// In frame k. In the plane's world axes, in the same unit as the pictures' normalised intensity.
  [[nodiscard]] const reference::Panorama& environment(int k) const { return lit(k).environment; }
  [[nodiscard]] const reference::GlossyScene& scene(int k) const { return lit(k).scene; }
  /// Those of the last frame.
  [[nodiscard]] const reference::Panorama& environment() const { return lights_.back().environment; }
  [[nodiscard]] const reference::GlossyScene& scene() const { return lights_.back().scene; }
  [[nodiscard]] reference::PinholeCamera pinhole() const;

 private:
  static constexpr int kHeldOut = 24;
  explicit SpecularSequence(const SpecularSequenceOptions& options) : options_(options) {}

  struct LitScene {
    reference::Panorama environment;
    std::unique_ptr<reference::SpecularTable> table, right_table;
    reference::GlossyScene scene;
  };
  [[nodiscard]] Shot rendered(int k) const;
  [[nodiscard]] std::array<double, 1> exposures(int k) const;
  /// Of the kept picture of frame k; nullopt where there is none.
  [[nodiscard]] std::optional<std::vector<std::byte>> kept_pixels(int k) const;
  [[nodiscard]] LitScene lit_by(reference::Panorama environment) const;
  [[nodiscard]] const LitScene& lit(int k) const {
    return options_.light_out_at && k >= *options_.light_out_at ? lights_.back() : lights_.front();
  }

  SpecularSequenceOptions options_;
  std::vector<LitScene> lights_;  ///< One, or before and after a light is off.
  std::vector<reference::Pose> trajectory_, held_out_;
  std::unique_ptr<Camera> camera_;
  std::string kept_;  ///< Folder of the kept pictures of these options; empty: none are kept.
};

/// Reads OpenEXR or Radiance, averaged to at most 512x256.
[[nodiscard]] Result<reference::Panorama> load_environment(const std::string& path);

}  // namespace lightwell::measure
