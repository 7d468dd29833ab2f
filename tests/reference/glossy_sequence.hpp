// Scene material for sequences of a glossy plane, by seed: trajectories, noise of poses, albedo, environments.
#pragma once

#include <cstdint>
#include <vector>

#include "reference/glossy_plane.hpp"

namespace lightwell::reference {

// A generator of its own and no distribution of the standard library: the same seed gives the same numbers on every
// machine, up to the rounding of its sine, cosine and logarithm.

/// SplitMix64 (Steele, Lea & Flood, "Fast splittable pseudorandom number generators", 2014). `stream` makes independent
/// generators from one seed.
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed, std::uint64_t stream = 0);
  std::uint64_t next();
  double uniform(double from = 0, double to = 1);  ///< in the open interval
  double gaussian();                               ///< mean 0, deviation 1 (Box & Muller 1958)

 private:
  std::uint64_t state_;
};

/// A hand that browses a plane. The camera's height over the plane, as the sine of its elevation seen from the plane's
/// centre, swings between the limits; its azimuth grows steadily, with a small slow wobble. A swing down and up lasts
/// 1.618 turns of azimuth, so that each fills the widest gaps of those before it: 20.8 s at 28 degrees/s. A sequence
/// must last half of that (312 frames) to reach both limits. The direction that is farthest from all views is 35
/// degrees from the nearest after 750 frames, 20 after 1500, 12.5 after 3000, 7.5 after 5400.
struct TrajectoryOptions {
  double frames_per_s = 30;
  double nearest_m = 0.25, farthest_m = 0.55;  ///< from the plane's centre
  double lowest_deg = 12, highest_deg = 88;    ///< elevation, highest_deg < 90
  double azimuth_deg_per_s = 28;
  double gaze_radius_m = 0.05;  ///< the optical axis meets the plane within this distance of its centre
  double roll_deg = 15;         ///< about the optical axis, to either side
  double tremor_deg = 0.2;      ///< the largest rotation of the hand's tremor about each axis, 3 to 9 Hz
};

/// T_camera_plane of a hand that is guided to see all directions: a spiral from highest_deg to lowest_deg whose turns
/// are evenly spaced in elevation, at constant speed of the viewing direction. A camera that sees 28 degrees of
/// directions at once, as one 0.4 m from a plane of 0.2 m, leaves no gap with four turns. azimuth_deg_per_s and
/// frames_per_s only set the time scale of gaze, roll and tremor.
std::vector<Pose> guided_trajectory(std::uint64_t seed, int frames, double turns,
                                    const TrajectoryOptions& options = {});

/// T_camera_plane of each frame: sums of sines of time, smooth everywhere. Without tremor the camera turns by no more
/// than 40 degrees/s at the default options. Image up is towards the plane's +Z, turned by the roll.
std::vector<Pose> hand_held_trajectory(std::uint64_t seed, int frames, const TrajectoryOptions& options = {});

/// Independent for each frame: a rotation exp(w), w Gaussian with that deviation about each axis, and a translation.
Pose pose_noise(std::uint64_t seed, int frame, double sigma_rad, double sigma_m);

/// T_camera_plane with noise on the camera's side: p_camera := noise.rotation p_camera + noise.translation.
Pose perturbed(const Pose& T_camera_plane, const Pose& noise);

/// A printed cover, n x n texels: white margin, frame, areas of colour, gradients, a smooth random picture, bars like
/// lines of text 2 to 6 texels thick. Albedo 0.03 to 0.8, on average about 0.35.
PlaneTexture book_texture(std::uint64_t seed, int n);

PlaneTexture plain_texture(int n, const Rgb& albedo);

/// A lamp of uniform radiance.
struct DiscLight {
  V3 towards{0, 1, 0};  ///< world axes, a unit vector
  double radius_rad = 0.05;
  Rgb radiance{1, 1, 1};
};

/// Radiance nadir + (zenith - nadir)(1 + y)/2 from world direction (x, y, z), plus lamps. Without lamps the irradiance
/// of the plane is pi m + 2 pi d / 3, m = (zenith + nadir)/2, d = (zenith - nadir)/2.
Panorama lamps_on_gradient(int width, int height, const Rgb& zenith, const Rgb& nadir,
                           const std::vector<DiscLight>& lamps);

/// lamps_on_gradient with `lamps` lamps of 2 to 6 degrees in radius at elevations of 20 to 80 degrees, at least 15
/// degrees from each other where there is room, of 30 to 100 times the gradient's radiance.
Panorama random_lamps(std::uint64_t seed, int width, int height, int lamps);

}  // namespace lightwell::reference
