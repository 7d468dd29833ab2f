// The path-traced rooms of tests/reference/mitsuba/field: what probes measure there, and the truth at points.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <lightwell/field.hpp>
#include <lightwell/result.hpp>

namespace lightwell::measure {

inline constexpr std::array kFieldRooms = {"square", "corridor", "corner"};

/// A lamp at a point.
struct LampTruth {
  double free = 0, seen = 0;  ///< Luminance of its vector irradiance without and with occlusion.
  Vec3d towards;              ///< Unit.
};

struct PointTruth {
  Vec3d position;
  std::vector<std::array<double, 3>> irradiance;  ///< At FieldRoom::normals.
  std::vector<LampTruth> lamps;

  /// The lamp with the largest `seen`.
  [[nodiscard]] std::size_t strongest() const;
  /// As the README beside the rooms defines it.
  [[nodiscard]] bool visible() const;
};

struct FieldRoom {
  std::string stem;  ///< Of its files: folder and name.
  std::string name;
  Vec3d size;                                   ///< Its floor is at y = 0, its middle at x = z = 0.
  std::vector<std::array<Vec3d, 2>> occluders;  ///< Centre and size.
  std::vector<Vec3d> lamps;                     ///< Centres; the window is the last.
  std::vector<Vec3f> normals;
  std::vector<Pose> probes;  ///< T_world_probe.
  std::vector<PointTruth> points;
};

/// tests/reference/mitsuba/field.
[[nodiscard]] std::string field_rooms_folder();

[[nodiscard]] Result<FieldRoom> load_field_room(const std::string& folder, const std::string& name);

/// Descriptors of the room's probes: the panorama estimator behind a simulated pair of 640x480, 8 bits, three
/// exposures, encoded and decoded.
[[nodiscard]] Result<std::vector<Descriptor>> probe_descriptors(const FieldRoom& room);

/// Triangles of walls, floor, ceiling and occluders; the furniture is left out.
struct RoomGeometry {
  std::vector<Vec3f> vertices;
  std::vector<std::uint32_t> indices;
};
[[nodiscard]] RoomGeometry geometry_of(const FieldRoom& room);

/// Samples at time 0. The poses have a standard deviation of 0.05 degrees and 2 mm.
[[nodiscard]] std::vector<FieldSample> samples_of(const FieldRoom& room, const std::vector<Descriptor>& descriptors);

}  // namespace lightwell::measure
