// Path-traced images of a marker body (tests/reference/mitsuba/marker) with their ground truth, and noisy 8-bit frames
// made from them by a simulated sensor.
//   load_traced_frames    reads scenes.json: poses, lamps, irradiance
//   load_traced_bodies    reads the bodies
//   true_irradiance       irradiance by all light of a scene with lamps
//   irradiance_facing_camera, irradiance_error   the error of a descriptor at normals near the camera
//   TracedPicture         radiance of one image, and frames made from it
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "measure/shots.hpp"

namespace lightwell::measure {

/// A lamp of the scene; probe frame, lengths in m.
struct TracedLamp {
  Vec3d direction;  ///< From the body's centre towards the lamp, unit.
  Vec3d position;
  double distance_m = 0;               ///< From the body's centre.
  std::array<double, 3> irradiance{};  ///< At the body's centre, normal incidence.
  int visible_lit_faces = 0;           ///< Number of faces that are visible to the camera and lit by the lamp.
};

/// The rectangle on which the body stands; probe frame, m.
struct TracedBoard {
  Vec3d center, normal;
  Vec3d x;  ///< Unit vector along the first side.
  std::array<double, 2> size_m{};
  double albedo = 0;
};

struct TracedFrame {
  std::string name, file;
  std::string group;  ///< "grid": as in the thesis; other groups: mitsuba/marker/README.md.
  std::string body;   ///< "white" or "grey".
  std::string view;   ///< "straight", "turned", or "other".
  std::string place;  ///< Of the first lamp: "front", "front_right", "right", "back_right", "behind", or "other".
  RigParameters rig;  ///< A pinhole with the photometry of an ideal linear sensor.
  Pose probe_body;    ///< T_probe_body.
  std::optional<TracedBoard> board;
  std::vector<TracedLamp> lamps;             ///< In a room: only its strongest light, with distance_m 0.
  std::array<double, 3> ambient_radiance{};  ///< Of the uniform ambient light; 0 in a room.
  /// In a room: irradiance at normals within 60 degrees of the camera, and the share of the strongest light in the
  /// irradiance of a surface that faces it.
  std::vector<Vec3d> normals;
  std::vector<std::array<double, 3>> irradiance;
  double strongest_share = 0;
};

/// Reads scenes.json in `folder`. not_found: it cannot be read; data_loss: names the frame and the field.
[[nodiscard]] Result<std::vector<TracedFrame>> load_traced_frames(const std::string& folder);

/// Reads dodecahedron_100mm_{white,grey}.textproto in `folder`; keys are TracedFrame::body. Errors of load_marker_body.
[[nodiscard]] Result<std::map<std::string, MarkerBody>> load_traced_bodies(const std::string& folder);

/// Irradiance at the body's centre for each unit normal (probe frame) by all light that arrives there if the body is
/// absent: the lamps, the ambient light where the board does not hide it, and light of both that the board reflects, by
/// a sum over 10,000 directions. Not for rooms.
[[nodiscard]] std::vector<std::array<double, 3>> true_irradiance(const TracedFrame& frame,
                                                                 std::span<const Vec3d> normals);

/// At normals within 60 degrees of the direction to the camera: 512 of a Fibonacci lattice; in a room those of
/// scenes.json.
struct TrueIrradiance {
  std::vector<Vec3d> normals;
  std::vector<std::array<double, 3>> irradiance;
};
/// Occluders are ignored.
[[nodiscard]] TrueIrradiance irradiance_facing_camera(const TracedFrame& frame);

/// Relative RMS error of a descriptor's irradiance over these normals and three channels.
[[nodiscard]] double irradiance_error(const TrueIrradiance& truth, const Descriptor& answer);

/// Model of an 8-bit camera's sensor.
struct TracedSensor {
  bool srgb = false;          ///< sRGB response, as webcams have; otherwise linear.
  double electrons = 10'000;  ///< At full scale; determines shot noise.
  double read_noise = 0.003;  ///< Standard deviation, relative to full scale.
  double white_level = 0.8;   ///< Exposure: level of the brightest visible white patch, relative to full scale.
};

class TracedPicture {
 public:
  /// `body`: the frame's body. data_loss: the file's size differs from scenes.json; not_found.
  [[nodiscard]] static Result<TracedPicture> load(const std::string& folder, const TracedFrame& frame,
                                                  const MarkerBody& body);

  /// Mean radiance (largest channel) of the brightest patch among those with the highest albedo that face the camera
  /// and have at least 20 pixels 1.5 px inside their outline.
  [[nodiscard]] double white_radiance() const { return white_; }

  /// A frame in rgb8, whose rig is rig_for(sensor). `number` seeds the noise.
  [[nodiscard]] Shot expose(const TracedSensor& sensor, std::uint64_t number) const;
  [[nodiscard]] RigParameters rig_for(const TracedSensor& sensor) const;

 private:
  TracedPicture() = default;

  RigParameters rig_;
  LensRadiance radiance_;
  double white_ = 0;
};

}  // namespace lightwell::measure
