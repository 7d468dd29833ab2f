// The path-traced pictures of a marker body (tests/reference/mitsuba/marker), with what is true of them, and the noisy
// 8-bit frames that a camera makes of them. Judges nothing and estimates nothing.
//   load_traced_frames    scenes.json: what stands where
//   load_traced_bodies    the bodies in them
//   true_irradiance       what the lamps and the light around give, in closed form
//   TracedPicture         one picture's radiance, and frames of it
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "measure/shots.hpp"

namespace lightwell::measure {

/// The probe's frame, m.
struct TracedLamp {
  Vec3d direction;  ///< Towards it from the body's centre, unit.
  Vec3d position;
  double distance_m = 0;               ///< From the body's centre.
  std::array<double, 3> irradiance{};  ///< At the body's centre, normal incidence.
  int visible_lit_faces = 0;              ///< Faces that the camera sees and the lamp lights.
};

struct TracedFrame {
  std::string name, file;
  std::string group;  ///< "grid": the thesis's; the others stand in mitsuba/marker/README.md.
  std::string body;   ///< "white" or "grey".
  std::string view;   ///< "straight", "turned", or "other".
  std::string place;  ///< Of the first lamp: "front", "front_right", "right", "back_right", "behind", or "other".
  RigParameters rig;  ///< The pinhole; its photometry is that of an ideal linear sensor.
  Pose probe_body;    ///< T_probe_body.
  bool board = false;
  std::vector<TracedLamp> lamps;  ///< In a room: its strongest light alone, whose distance_m is 0.
  std::array<double, 3>
      ambient_radiance{};  ///< Of the light that comes alike from everywhere besides the lamps; 0 in a room.
  /// Of a room: irradiance at normals within 60 degrees of the camera, and what share of what a surface that faces the
  /// strongest light gets comes from that light.
  std::vector<Vec3d> normals;
  std::vector<std::array<double, 3>> irradiance;
  double strongest_share = 0;
};

/// Of scenes.json in `folder`. not_found; data_loss names the frame and the field.
[[nodiscard]] Result<std::vector<TracedFrame>> load_traced_frames(const std::string& folder);

/// dodecahedron_100mm_{white,grey}.textproto of `folder`, by TracedFrame::body. Errors: load_marker_body's.
[[nodiscard]] Result<std::map<std::string, MarkerBody>> load_traced_bodies(const std::string& folder);

/// Of a frame that is no room, at the body's centre and a unit normal (probe frame), as if nothing but the lamps and
/// the even light around were there: each lamp's irradiance times the cosine, where it is above the horizon, and pi
/// times the ambient radiance.
[[nodiscard]] std::array<double, 3> true_irradiance(const TracedFrame& frame, Vec3d normal);

/// What a camera of 8 bits does to light.
struct TracedSensor {
  bool srgb = false;          ///< sRGB as webcams have it, or linear.
  double electrons = 10'000;  ///< That fill the scale: shot noise.
  double read_noise = 0.003;  ///< Standard deviation, share of full scale.
  double white_level = 0.8;   ///< The share of full scale to which the brightest white patch in view is exposed.
};

class TracedPicture {
 public:
  /// `body` is the frame's. data_loss where the file has another size than scenes.json says; not_found.
  [[nodiscard]] static Result<TracedPicture> load(const std::string& folder, const TracedFrame& frame,
                                                  const MarkerBody& body);

  /// The mean radiance, the largest channel, of the brightest of the whitest patches that face the camera and of which
  /// 20 pixels or more lie 1.5 px inside of its outline.
  [[nodiscard]] double white_radiance() const { return white_; }

  /// A frame in rgb8. The same `number` has the same noise; its rig is rig_for(sensor).
  [[nodiscard]] Shot expose(const TracedSensor& sensor, std::uint64_t number) const;
  [[nodiscard]] RigParameters rig_for(const TracedSensor& sensor) const;

 private:
  TracedPicture() = default;

  RigParameters rig_;
  LensRadiance radiance_;
  double white_ = 0;
};

}  // namespace lightwell::measure
