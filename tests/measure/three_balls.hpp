// Images of a diffuse, a matte silver and a mirror ball, lit by the true panorama and by an estimate, and the errors
// between them: the usual comparison of light estimates.
//
// The protocol is that of the literature (Wang et al., "StyleLight", ECCV 2022, followed by DiffusionLight, CVPR 2024;
// code: github.com/DiffusionLight/DiffusionLight-evaluation, stylelight/) with these differences: errors are taken over
// the pixels of the ball only; si-RMSE has ONE scale for all pixels and channels; the albedo is 0.8. Their camera is 16
// radii away and 7 degrees above; here it is at infinity and level, so that a mirror ball shows every direction once.
//
// They render with tone-mapped environments (published_environment); applications render linear radiance. Both are
// available:
//   linear     ball_error(ball_pictures(view, truth.sums), ball_pictures(view, irradiance, radiance), ball,
//                         exposure(truth.sums.panorama()))
//   published  the same with both environments through published_environment() and PanoramaSums, exposure 1; comparable
//              to StyleLight's results on Laval Indoor (its issue 9): mirror, matte silver, diffuse:
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

/// Perceptual roughness of the reflection; 1 for the diffuse ball, which does not use it. Matte silver has 0.3271, from
/// the protocol's matte_silver.py (whose additional lobe of 0.369 at grazing angles is omitted here).
[[nodiscard]] double ball_roughness(Ball ball);

/// An estimate of radiance(d, r) as defined in proto/README.md.
using RadianceAnswer = std::function<reference::Rgb(const reference::V3& unit_direction, double perceptual_roughness)>;

/// Geometry of a ball that fills the square image of an orthographic camera.
struct BallView {
  /// `towards_viewer` is the direction from ball to camera, of any length but zero, not along +Y.
  explicit BallView(int size = 128, const reference::V3& towards_viewer = {0, 0, 1});

  int size = 0;
  std::vector<std::size_t> pixels;         ///< Row-major indices of the pixels whose centre is on the ball.
  std::vector<reference::V3> normals;      ///< Unit normal at each of these pixels.
  std::vector<reference::V3> reflections;  ///< Mirrored view direction at each of these pixels.
};

/// Linear radiance towards the camera, one entry per pixel of the view, in the environment's unit.
using BallPicture = std::vector<reference::Rgb>;

/// Index: static_cast<std::size_t>(Ball).
using BallPictures = std::array<BallPicture, kBalls.size()>;

/// 0.8 E(n) / pi for the diffuse ball, 0.8 radiance(reflection, roughness) for the others (N = V = R = d, as
/// proto/README.md defines radiance(d, r), so highlights are not elongated at grazing angles).
[[nodiscard]] BallPictures ball_pictures(const BallView& view, const IrradianceAnswer& irradiance,
                                         const RadianceAnswer& radiance);

/// Balls lit by a panorama; at roughness 0 it is interpolated bilinearly. 1.7 s at 1024x512, 0.8 s at 512x256.
[[nodiscard]] BallPictures ball_pictures(const BallView& view, const PanoramaSums& sums);

struct BallError {
  double rmse = 0;  ///< sqrt(sum over pixels and channels of the squared difference / pixels): fast_rmse.py divides by
                    ///< pixels, not by three times as many.
  double si_rmse = 0;      ///< RMSE after scaling the estimate by the one factor that minimizes it.
  double angular_deg = 0;  ///< Mean over pixels of the angle between the two colours, 0 where one is black.
  double truth_rms = 0;    ///< RMS of the truth, normalized as rmse; divide by it for relative errors.
};

/// Errors between two images of one view, both multiplied by `exposure`; all errors but the angular one scale with it.
[[nodiscard]] BallError ball_error(const BallPicture& truth, const BallPicture& answer, double exposure);

/// si-RMSE after both images were divided by the 99.9th percentile of the truth's values and clipped to 0..1: lamps, of
/// which a display shows no more than white, do not outweigh all else. NaN for a black truth.
[[nodiscard]] double clipped_si_rmse(const BallPicture& truth, const BallPicture& answer);

/// The factor that brings the median of the positive values of a panorama (at 256x128, all channels) to 0.5: the
/// protocol's tone mapping without its gamma. Use the same factor for truth and estimate, so that RMSE includes errors
/// of scale.
[[nodiscard]] double exposure(const reference::Panorama& panorama);

/// The protocol's tone-mapped environment: averaged to 256x128, then x^(1/2.4), times the factor that brings the median
/// of the positive values to 0.5 (a separate factor for truth and estimate); not clipped.
[[nodiscard]] reference::Panorama published_environment(const reference::Panorama& panorama);

/// A light of an estimate: a uniform spherical cap.
struct CapLight {
  reference::V3 direction;  ///< Towards it, unit.
  double angular_radius_rad = 0;
  reference::Rgb vector_irradiance{};
};

/// An estimate as an environment of 256x128: its radiance without lights (negative values become 0), and the lights
/// drawn as discs with their power and a radius of at least half a pixel.
[[nodiscard]] reference::Panorama answer_environment(
    const std::function<reference::Rgb(const reference::V3&)>& radiance, std::span<const CapLight> lights);

}  // namespace lightwell::measure
