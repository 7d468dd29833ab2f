// What ar_viewer shows: the values of a scene file. Format: README.md, "Scene file".
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "ar_viewer/material.hpp"

namespace lightwell::viewer {

/// A pinhole camera with the distortion of Brown 1971, in OpenCV's order. Pixel coordinates of a point (x, y, z) of its
/// frame (-Z forward, +Y up) without distortion: (cx - fx x / z, cy + fy y / z); the centre of the top left pixel is
/// (0, 0).
struct CameraModel {
  int width = 640, height = 360;       ///< Pixels, 16 to 4096.
  double fx = 500, fy = 500;           ///< Pixels.
  double cx = 319.5, cy = 179.5;       ///< Pixels.
  std::array<double, 5> distortion{};  ///< k1, k2, p1, p2, k3. The background is resampled without it.

  static constexpr int kMinSide = 16, kMaxSide = 4096;
};

enum class TagFamily : std::uint8_t { tag36h11, tag_standard41h12, tag25h9, tag16h5 };
/// Names in a scene file, by TagFamily.
inline constexpr std::array<std::string_view, 4> kTagFamilies = {"tag36h11", "tagStandard41h12", "tag25h9", "tag16h5"};

/// A tag in the picture, by which the camera's pose is found in every frame. The tag's frame: origin in its centre, +Z
/// towards the viewer, +X right, +Y up.
struct TrackedTag {
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double size_m = 0;  ///< Edge between the detected corners: of tag36h11 the outside of the black frame.
  Pose T_world_tag;
};

/// A light source for the viewer.
struct LightUri {
  std::string uri;  ///< For Probe::connect().
};
struct LightFile {
  std::string path;  ///< A recording of descriptors (a frame shows one), or one encoded descriptor.
};
/// Stated in the scene; in the probe's axes.
struct LightValues {
  Descriptor descriptor;
};
using LightDescription = std::variant<LightUri, LightFile, LightValues>;

/// The real plane, which receives the shadows: a rectangle around the origin of its frame, whose +Y is its normal.
struct Ground {
  Pose T_world_plane;
  double width_m = 1;  ///< Along X.
  double depth_m = 1;  ///< Along Z.
};

enum class Anchor : std::uint8_t {
  world,
  marker_body,  ///< The origin of the descriptor, for a marker the centre of its body: Descriptor::T_probe_origin.
};

struct Object {
  std::string mesh = "sphere";  ///< sphere, box, cylinder, teapot, cloth, or the path of a .glb or .gltf file.
  /// Extents, m. One: the largest extent, the shape is kept. Three: those along X, Y, Z. None: as in the file, or 0.1
  /// m.
  std::vector<double> size_m;
  Anchor anchor = Anchor::world;
  Pose T_anchor_object;
  Material material;
  bool material_given = false;  ///< Otherwise a file's own materials are used.
};

/// How the light of the descriptor is used: all of it, or less, to compare.
enum class Shading : std::uint8_t {
  off,                 ///< The background alone.
  constant,            ///< The mean radiance of all light from everywhere; no shadow.
  main_light_and_sh9,  ///< The strongest light as a point, all else in nine coefficients: what phones estimate.
  full,
};
inline constexpr std::array kShadings = {Shading::off, Shading::constant, Shading::main_light_and_sh9, Shading::full};
inline constexpr std::array<std::string_view, kShadings.size()> kShadingNames = {"off", "constant",
                                                                                 "main_light_and_sh9", "full"};
[[nodiscard]] constexpr std::string_view to_string(Shading shading) {
  return kShadingNames[static_cast<std::size_t>(shading)];
}

/// How the real plane shows shadows.
enum class ShadowDisplay : std::uint8_t {
  ratio,       ///< Times irradiance with the objects / irradiance without them.
  alpha_test,  ///< As CubeMap360: black of opacity `strength` where the main light's visibility is below alpha_cutoff.
};

struct ShadowStyle {
  ShadowDisplay display = ShadowDisplay::ratio;
  float strength = 1;         ///< 0 (no shadow) to 1: the ratio becomes 1 - strength (1 - ratio).
  float gain = 1;             ///< 0 to 10: exponent of the ratio before that.
  float alpha_cutoff = 0.5F;  ///< 0 to 1.
  /// Stale light fades to its mean, without shadows, within this time after it became stale, s. 0: at once.
  double stale_fade_s = 2;
};

/// What image-based reflection and refraction show.
enum class ReflectionSource : std::uint8_t {
  prefiltered,  ///< radiance(d, r): the environment map, or the harmonics; lights as caps.
  cube_map,     ///< As CubeMap360: six faces, without prefilter, updated every few frames; lights in the faces.
};

struct ReflectionStyle {
  ReflectionSource source = ReflectionSource::prefiltered;
  int every_frames = 10;  ///< Of cube_map, 1 to 1000.
  int edge = 64;          ///< Texels along a face's edge, of both: 8, 16, 32 or 64.
  /// Edge of the cube maps that show the other objects to each object, texels; 0: objects do not reflect each other.
  int objects_edge = 64;
};

struct Scene {
  CameraModel camera;
  std::string background;               ///< A picture, a video or a camera device; empty: black.
  float exposure = 1;                   ///< Linear picture value = exposure * radiance; also of an EXR background.
  std::variant<Pose, TrackedTag> pose;  ///< T_world_camera, or the tag that gives it.
  /// Of the probe. None: as the probe reports it, or the identity.
  std::optional<Pose> T_world_probe;
  /// By name; that of the field "light" is "light".
  std::map<std::string, LightDescription> lights;
  std::optional<Ground> ground;
  std::vector<Object> objects;
  Shading shading = Shading::full;
  std::optional<Shading> side_by_side;  ///< Right half of the picture; none: all of it is `shading`.
  ShadowStyle shadow;
  ReflectionStyle reflection;

  static constexpr std::size_t kMaxObjects = 64;
};

/// Reads a scene file. Relative paths become relative to the folder of the file. not_found or data_loss if the file
/// cannot be read; invalid_argument names file, field and remedy: bad JSON, a field that is not known, a value that is
/// out of range.
[[nodiscard]] Result<Scene> read_scene(const std::string& path);

}  // namespace lightwell::viewer
