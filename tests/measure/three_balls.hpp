// The balls by which light estimation is compared: pictures of a grey diffuse, a matte silver and a mirror ball lit
// by the truth and by an answer, and the errors between them.
//
// The protocol is the one of the literature (Wang et al., "StyleLight", ECCV 2022, followed by DiffusionLight, CVPR
// 2024; code: github.com/DiffusionLight/DiffusionLight-evaluation, stylelight/), except where said: errors over the
// pixels of the ball alone; ONE scale for all pixels and channels in si-RMSE; albedo 0.8. Their camera is 16 radii
// away and 7 degrees above; ours is at infinity and level, so that a mirror ball shows every direction once.
//
// They render under environments that were tone-mapped first (published_environment); what an application renders is
// linear. Both can be had:
//   linear     ball_error(ball_pictures(view, truth.sums), ball_pictures(view, irradiance, radiance), ball,
//                         exposure(truth.sums.panorama()))
//   published  the same with both environments through published_environment() and PanoramaSums, exposure 1;
//              to be set beside StyleLight's own on Laval Indoor (its issue 9): mirror, matte silver, diffuse:
//              RMSE 0.56, 0.30, 0.15; si-RMSE 0.55, 0.29, 0.11; angular error 4.30, 2.96, 2.41 degrees.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "measure/panorama_sums.hpp"
#include "measure/panorama_truth.hpp"

namespace lightwell::measure {

enum class Ball { diffuse, matte_silver, mirror, mirror_25, mirror_50 };

inline constexpr std::array<Ball, 5> kBalls = {Ball::diffuse, Ball::matte_silver, Ball::mirror, Ball::mirror_25,
                                               Ball::mirror_50};

/// "diffuse", "matte silver", "mirror", "mirror 0.25", "mirror 0.5".
[[nodiscard]] std::string_view ball_name(Ball ball);

/// Perceptual roughness of the reflection; 1 for the diffuse one, which asks for none. Matte silver is the 0.3271 of
/// the protocol's matte_silver.py (which mixes in a lobe of 0.369 at grazing angles, left out here).
[[nodiscard]] double ball_roughness(Ball ball);

/// An answer to proto/README.md's radiance(d, r).
using RadianceAnswer = std::function<reference::Rgb(const reference::V3& unit_direction, double perceptual_roughness)>;

/// Where an orthographic camera sees a ball that fills its square picture.
struct BallView {
  /// `towards_viewer` is the direction from ball to camera, of any length but zero, not along +Y.
  explicit BallView(int size = 128, const reference::V3& towards_viewer = {0, 0, 1});

  int size = 0;
  std::vector<std::size_t> pixels;         ///< Row-major indices of the pixels whose centre is on the ball.
  std::vector<reference::V3> normals;      ///< Of each.
  std::vector<reference::V3> reflections;  ///< Of each: the direction that a mirror there shows.
};

/// Linear radiance towards the camera, one entry a pixel of the view, in the environment's unit.
using BallPicture = std::vector<reference::Rgb>;

/// Index: static_cast<std::size_t>(Ball).
using BallPictures = std::array<BallPicture, kBalls.size()>;

/// 0.8 E(n) / pi for the diffuse ball, 0.8 radiance(reflection, roughness) for the others (N = V = R = d, as
/// proto/README.md defines radiance(d, r), so without the stretch of highlights at grazing angles).
[[nodiscard]] BallPictures ball_pictures(const BallView& view, const IrradianceAnswer& irradiance,
                                         const RadianceAnswer& radiance);

/// Lit by a panorama. At roughness 0 it is looked up, bilinear. 1.7 s at 1024x512, 0.8 s at 512x256.
[[nodiscard]] BallPictures ball_pictures(const BallView& view, const PanoramaSums& sums);

struct BallError {
  double rmse = 0;  ///< sqrt(sum over pixels and channels of the squared difference / pixels): fast_rmse.py divides by
                    ///< pixels, not by three times as many.
  double si_rmse = 0;      ///< The same after the answer is scaled by the one factor that makes it least.
  double angular_deg = 0;  ///< Mean over pixels of the angle between the two colours, 0 where one is black.
  double truth_rms = 0;    ///< Of the truth, as rmse is: what makes the others relative.
};

/// Both pictures times `exposure`, which the first two and the last scale with. Pictures of one view.
[[nodiscard]] BallError ball_error(const BallPicture& truth, const BallPicture& answer, double exposure);

/// The factor that brings the median of the positive values of a panorama (at 256x128, all channels) to 0.5: what
/// the protocol's tone-mapping does without its gamma. One for truth and answer, so that RMSE sees a wrong scale.
[[nodiscard]] double exposure(const reference::Panorama& panorama);

/// The environment that the protocol lights balls with: the mean over the pixels of 256x128, then x^(1/2.4), times the
/// factor that brings the median of the positive values to 0.5 (its own, for truth and answer each); not clipped.
[[nodiscard]] reference::Panorama published_environment(const reference::Panorama& panorama);

/// A light of an answer: a uniform cap.
struct CapLight {
  reference::V3 direction;  ///< Towards it, unit.
  double angular_radius_rad = 0;
  reference::Rgb vector_irradiance{};
};

/// An answer as an environment of 256x128: its radiance without lights (negative values become 0) with the lights
/// drawn as discs of their power, those smaller than half a pixel as large as that.
[[nodiscard]] reference::Panorama answer_environment(
    const std::function<reference::Rgb(const reference::V3&)>& radiance, std::span<const CapLight> lights);

}  // namespace lightwell::measure
